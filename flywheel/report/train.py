"""The steps of the train: where the power of a cycle goes from the motor to the tool, and what every mesh loses of it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flywheel.language import text as _
from flywheel.report.document import Cell, Figure, Formula, Note, Part, Section, Step, Table
from flywheel.report.formulas import Quantity
from flywheel.report.regime import Known, number, quantity
from flywheel.sizing.power_flow import PowerFlow
from flywheel.tables.power_flow import entries, given, place, sentence
from flywheel.tables.trade_units import SI

_SAME = 1e-9  # share within which two powers are one
_ANGLES = 721  # at which the greatest power of the loads is looked for


def train(known: Known) -> Section | None:
    """The power flow over a cycle: its picture, the shafts and their meshes, the losses, and their sum."""
    flow = known.sizing.power_flow
    if flow is None or not given(flow, entries(flow)) > _SAME * flow.scale:
        return None
    parts: list[Part] = [
        Step(
            _("Over a cycle the loads take what comes in, or it is lost; inertias and weights give back what they take"),
            "total(integral(P_k, t, 0, tau), k) = 0",
            definitions=("P_k",),
        ),
        *_pictures(flow),
    ]
    if len(flow.shafts) > 1:
        parts += [_shafts(flow), *_meshes(flow)]
    parts += _balance(flow)
    return Section(_("The train: where the power goes"), tuple(parts))


def _pictures(flow: PowerFlow) -> Iterator[Part]:
    """The Sankey diagram of the mean, and of the angle at which the loads take most."""
    at = _hardest(flow)
    titles: dict[float | None, str] = {None: _("Power flow from the motor to the tool, mean over the cycle")}
    titles[at] = _("Power flow at {phi}, where the loads take most", phi=quantity(at, "deg", 4))
    for angle, title in titles.items():

        def drawn(angle: float | None = angle) -> str:
            from flywheel.pictures import power_flow as pictures  # which takes long to import

            return pictures.panel(flow, at=angle)

        streams = [entry for entry in entries(flow, angle) if entry.stream.kind != "shaft" and entry.power]
        told = "; ".join(f"{entry.label} {SI.read(entry.power, 'power', 4)}" for entry in streams)
        yield Figure(drawn, title, f"{told}.")


def _hardest(flow: PowerFlow) -> float:
    """The crank angle (rad) at which the loads take the greatest power."""
    phi = np.linspace(0.0, flow.scene.cycle, _ANGLES)
    taken = [k for k, stream in enumerate(flow.streams) if stream.kind == "load"]
    return float(phi[flow.along(phi)[taken].sum(axis=0).argmax()])


def _shafts(flow: PowerFlow) -> Table:
    """Every shaft with its place in the train, its speed, and the torque that its mesh carries on its own side."""
    scene = flow.scene
    rows: list[tuple[Cell, ...]] = []
    for row in reversed(flow.shafts):
        torques = (row.torque_mean, row.torque_greatest, row.torque_rms)
        least = _SAME * abs(row.torque_greatest or 0.0)
        told = ["–" if torque is None else Quantity("", torque if abs(torque) > least else 0.0, "N m") for torque in torques]
        turns = "–" if row.on is None else number(scene.shafts[row.shaft] / scene.shafts[row.on])
        near = "–" if row.on is None else place(row.on)
        rows.append((place(row.shaft), near, turns, Quantity("", row.speed, "rpm"), *told))
    head = (_("shaft"), _("meshes with"), _("turns for one of that"), _("speed, rpm"))
    return Table(
        _("Shafts: speed (mean of extremes), and the torque that their mesh carries on their own side"),
        (*head, _("mean torque, N m"), _("greatest, N m"), _("rms, N m")),
        tuple(rows),
        formula="tau_k = I_k*derivative(omega, t) + derivative(I_k, phi)*omega**2/2 - M_k + total(k_c*tau_c, c)",
    )


def _meshes(flow: PowerFlow) -> Iterator[Part]:
    """What passes every mesh that has losses, and what it loses by slip and by friction."""
    meshes = _lossy(flow)
    if not meshes:
        return
    rows, steps = [], list[Part]()
    for k, name in enumerate(meshes, 1):
        mesh = flow.scene.transmissions[name]
        of_mesh = [stream for stream in flow.streams if stream.name == f"shafts.{name}"]
        enters = Quantity(f"P_{k}", sum(s.mean for s in of_mesh if s.kind in ("shaft", "mesh", "slip")), "W")
        numbers = (Quantity(f"eta_{k}", mesh.efficiency), Quantity(f"s_{k}", mesh.slip), enters)
        rows.append((f"{place(name)}–{place(mesh.on)}", enters, *numbers[:2]))
        steps += _lost(flow, name, k, numbers)
    yield Table(
        _("Meshes: the mean power that enters, the efficiency whichever way it goes, and the slip"),
        (_("mesh"), _("power in, W"), _("efficiency"), _("slip")),
        tuple(rows),
        formula="P_out = eta_k*(1 - s_k)*P_in",
    )
    yield from steps


def _lossy(flow: PowerFlow) -> list[str]:
    """The shafts whose mesh loses power, nearer to the motor first."""
    return [row.shaft for row in reversed(flow.shafts) if flow.scene.efficiencies.get(row.shaft, 1.0) < 1.0]


def _lost(flow: PowerFlow, name: str, k: int, numbers: tuple[Quantity, Quantity, Quantity]) -> Iterator[Step]:
    """The losses of a mesh, each from what enters where power goes one way all the cycle."""
    found = {entry.stream.kind: entry for entry in entries(flow) if entry.stream.name == f"shafts.{name}"}
    efficiency, slip, enters = numbers
    slips = slip.value > 0.0
    of_kind = {
        "slip": (f"P_s{k}", f"s_{k}", numbers[1:], slip.value),
        "mesh": (
            f"P_v{k}",
            f"(1 - eta_{k})*(1 - s_{k})" if slips else f"(1 - eta_{k})",
            numbers if slips else (efficiency, enters),
            (1.0 - efficiency.value) * (1.0 - slip.value),
        ),
    }
    for kind, (symbol, share, used, factor) in of_kind.items():
        if kind not in found:
            continue
        lost = Quantity(symbol, found[kind].stream.mean, "W")
        one_way = abs(lost.value - factor * enters.value) <= _SAME * abs(enters.value)
        yield Step(
            _("Lost: {name}", name=found[kind].label),
            f"{symbol} = {share}*P_{k}" if one_way else f"{symbol} = {share}*integral(P_in(t), t, 0, tau)/tau",
            used if one_way else (),
            lost,
            how="" if one_way else _("power enters from either side within the cycle: by quadrature"),
        )


def _balance(flow: PowerFlow) -> Iterator[Part]:
    """Input, losses and output as a table that sums up, and what share of the input arrives."""
    whole = given(flow, entries(flow))
    share = (lambda value: Quantity("", value / whole, "%", 4)) if whole > 0.0 else (lambda value: "–")
    enters, leaves = Quantity("P_e", flow.input, "W"), Quantity("P_a", flow.output, "W")
    rows: list[tuple[Cell, ...]] = [(_("comes in"), Formula("P_e"), enters, share(flow.input))]
    symbols: list[Quantity] = []
    of_mesh = _symbols(flow)
    for entry in entries(flow):
        if entry.stream.lost and entry.stream.mean:
            symbol = of_mesh.get((entry.stream.kind, entry.stream.name), f"P_l{len(symbols) + 1}")
            symbols.append(Quantity(symbol, entry.stream.mean, "W"))
            rows.append((_("lost: {name}", name=entry.label), Formula(symbol), symbols[-1], share(entry.stream.mean)))
    rows.append((_("taken by the loads"), Formula("P_a"), leaves, share(flow.output)))
    caption = _("The balance of power, mean over a cycle of {period}", period=quantity(flow.period, "s"))
    yield Table(caption, (_("power"), _("symbol"), _("mean, W"), _("share of the input")), tuple(rows))
    if symbols:
        lost = Quantity("P_v", flow.losses, "W")
        yield Step(_("All losses together"), f"P_v = {' + '.join(n.symbol for n in symbols)}", tuple(symbols), lost)
        yield Step(_("Taken and lost is what comes in"), "P_e = P_a + P_v", (leaves, lost), enters)
    if flow.efficiency is not None and flow.output > 0.0:
        told = _("Efficiency of the whole train")
        yield Step(told, "eta = P_a/P_e", (leaves, enters), Quantity("eta", flow.efficiency))
    if (summary := sentence(flow)) is not None:
        yield Note(f"{summary}.")


def _symbols(flow: PowerFlow) -> dict[tuple[str, str], str]:
    """The symbols of what meshes lose, by kind and name of the stream, as the steps have them."""
    found: dict[tuple[str, str], str] = {}
    for k, shaft in enumerate(_lossy(flow), 1):
        found |= {("slip", f"shafts.{shaft}"): f"P_s{k}", ("mesh", f"shafts.{shaft}"): f"P_v{k}"}
    return found
