"""The steps of the drive: torque by speed, power, heat, the gas of an engine; shafts and losses; the stroke by clutch."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from math import isnan

import numpy as np

from flywheel.components.energy import ServoLoad
from flywheel.components.motors.motor import Fact
from flywheel.components.motors.thermal import Temperature
from flywheel.components.press_work import engage
from flywheel.language import message
from flywheel.language import text as _
from flywheel.motions.single_stroke import BY_KEY, SingleStroke, exceeds, load_limits, rate_limit, share_name
from flywheel.motions.stroke_course import driven_inertia, driving_inertia, driving_sides, servo_load, temperature
from flywheel.numerics.cells import TIE
from flywheel.report.document import Cell, Context, Figure, Formula, Note, Part, Section, Step, Table, number, quantity
from flywheel.report.formulas import Quantity
from flywheel.sizing.drive import trip_messages
from flywheel.sizing.results import PhaseLoad, PowerFlow
from flywheel.tables.power import entries, input_power, sentence, with_and_without
from flywheel.tables.rows import SI, place
from flywheel.tables.sizing import limit_names

_MOST_POINTS = 30  # of a curve in a table


def motor(context: Context) -> Section | None:
    """The motor's torque against its speed, from its name plate."""
    own = context.scene.motor
    if own is None:
        return None
    parts = [*_parts(own.facts())]
    if own.points:
        rows = tuple((Quantity("", one.speed, "rpm"), Quantity("", one.torque, "N m")) for one in own.points[:_MOST_POINTS])
        head = _("speed, rpm"), _("torque, N m")
        parts.append(Table(_("Its torque against its speed, by a table"), head, rows))
    if (data := own.thermal) is not None:
        slow, *winding = data.bodies
        quantities = [(_("rise at the rated point"), Formula("theta_n"), Quantity("theta_n", data.rise, "K"))]
        quantities.append((_("time constant"), Formula("T_1"), Quantity("T_1", slow[1], "s")))
        for rise, constant, _cooled in winding:
            quantities.append(
                (_("time constant of the windings over the iron"), Formula("T_2"), Quantity("T_2", constant, "s"))
            )
            quantities.append((_("their share of the rise"), Formula("a"), Quantity("a", rise / data.rise)))
        quantities.append(
            (_("greatest rise that their class allows"), Formula("theta_g"), Quantity("theta_g", data.limit, "K"))
        )
        parts.append(Table(_("How the windings warm up"), (_("quantity"), _("symbol"), _("value")), tuple(quantities)))
    if (breakdown := own.breakdown) is not None and own.breakdown_torque is None and not own.keeps_step:
        title = _(
            "Below {speed}, where it gives {torque}, its torque falls and it would stall.",
            speed=quantity(breakdown.speed, "rpm"),
            torque=quantity(breakdown.torque, "N m"),
        )
        parts.append(Note(title, "remark"))
    return Section(_("The motor: {kind}", kind=message(own.title)), tuple(parts))


def _parts(facts: Iterable[Fact], remark: str = "") -> Iterator[Part]:
    """Facts of a motor as tables, steps and remarks of a kind."""
    for table, rows in groupby(facts, key=lambda fact: fact.table):
        if table:
            yield _table(table, tuple(rows))
            continue
        for fact in rows:
            if fact.value is None and not fact.formula:
                yield Note(fact.words, remark)
            elif fact.value is None:
                yield Step(fact.words, fact.formula, definitions=(fact.symbol,))
            else:
                note = "" if fact.share is None else _verdict(fact.share)
                yield Step(fact.words, fact.formula, tuple(map(_quantity, fact.numbers)), _quantity(fact), note=note)


def _table(caption: str, facts: tuple[Fact, ...]) -> Table:
    if not facts[0].symbol:
        return Table(caption, (_("quantity"), _("value")), tuple((fact.words, _quantity(fact)) for fact in facts))
    rows = tuple((fact.words, Formula(fact.symbol), _quantity(fact)) for fact in facts)
    return Table(caption, (_("quantity"), _("symbol"), _("value")), rows, formula=facts[0].formula)


def _quantity(fact: Fact) -> Quantity:
    return Quantity(fact.symbol, fact.value or 0.0, fact.unit)


# -- power, energy, heat ----------------------------------------------------------------------------------------------


def power(context: Context) -> Section | None:
    """Power over the time of a cycle, with the flywheel and without one, and the heat of the motor."""
    sizing, energy = context.sizing, context.sizing.energy
    if energy is None or not with_and_without(sizing):
        return None
    period = Quantity("tau", energy.period, "s")
    work = Quantity("W_d", energy.work, "J")
    parts: list[Part] = []
    if sizing.simulation is None or sizing.simulation.period is None:
        rows: tuple[tuple[Cell, ...], ...] = ((_("period of a cycle"), Formula("tau"), period),)
        parts.append(Table(_("Time of a cycle, the integral of dφ/ω"), (_("quantity"), _("symbol"), _("value")), rows))
    mean = Quantity("P_mean", energy.mean_power, "W")
    parts.append(Step(_("Mean power over time, with the flywheel"), "P_mean = W_d/tau", (work, period), mean))
    peak, alone = Quantity("P_max", energy.peak_power, "W"), Quantity("P_alone", energy.peak_power_alone, "W")
    parts.append(
        Step(
            _("Greatest power with the flywheel: torque times speed, where it is largest in size"),
            "P_max = greatest(M_star_d(phi)*omega(phi), phi)",
            (),
            peak,
            note=_("It brakes there.") if energy.peak_power < 0.0 else "",
        )
    )
    parts.append(
        Step(
            _("Greatest power of a motor without a flywheel, which follows the loads at constant speed"),
            "P_alone = greatest(-omega*total(M_star_k(phi), k), phi)",
            (),
            alone,
            note=_("It brakes there.") if energy.peak_power_alone < 0.0 else "",
        )
    )
    if energy.mean_power > 0.0 and energy.peak_power > 0.0 and energy.peak_to_mean is not None:
        title = _("Greatest over mean power with the flywheel")
        parts.append(Step(title, "q = P_max/P_mean", (peak, mean), Quantity("q", energy.peak_to_mean)))
    if context.scene.motor is not None:
        parts += _of_motor(context, mean)
    return Section(_("Power and heat of the drive"), tuple(parts))


def _of_motor(context: Context, mean: Quantity) -> Iterator[Part]:
    """The motor's power compared with its rating, and its heat."""
    own, energy = context.scene.motor, context.sizing.energy
    assert energy is not None
    assert own is not None
    rated = own.rated
    if rated is not None and not own.governed:
        yield Step(
            _("Share of the rated power"),
            "u = P_mean/P_n",
            (mean, Quantity("P_n", rated.power, "W")),
            Quantity("u", mean.value / rated.power),
        )
        yield Step(
            _("Root of the mean square of its torque over time, a measure of its heat"),
            "T_rms = sqrt(integral(T**2, t, 0, tau)/tau)",
            (),
            Quantity("T_rms", energy.rms_torque, "N m"),
        )
        yield Step(
            _("As a share of the rated torque"),
            "u_T = T_rms/T_n",
            (Quantity("T_rms", energy.rms_torque, "N m"), Quantity("T_n", rated.torque, "N m")),
            Quantity("u_T", energy.rms_torque / rated.torque),
        )
    yield from _parts(own.heat_facts(energy), "left out")
    if context.sizing.servo is not None:
        yield from _servo(context.sizing.servo)
        yield context.panel("servo")
    if context.sizing.duty is None:
        yield from _windings(context.sizing.temperature)


def _servo(load: ServoLoad) -> Iterator[Part]:
    """The rms point and the peak point of a servo drive beside its curves, and its ratio of inertias."""
    rms, limit = Quantity("T_rms", load.rms_torque, "N m"), Quantity("C", load.continuous_torque, "N m")
    speed = quantity(load.mean_speed, "rpm")
    words = _("rms torque over the continuous curve at the mean speed of {speed}", speed=speed)
    yield Step(words, "u_c = T_rms/C", (rms, limit), Quantity("u_c", load.continuous_share))
    words = _("Greatest share of the peak curve, at crank angle {angle} and {speed} of the motor",
              angle=quantity(load.peak_angle, "deg"), speed=quantity(load.peak_speed, "rpm"))  # fmt: skip
    note = _("The peak curve cuts the torque off: the drive does not hold its set speed.") if load.at_peak else ""
    yield Step(words, "u_p = greatest(abs(T)/P, t)", (), Quantity("u_p", load.peak_share), note=note)
    if load.inertia_ratio is not None:
        words = _("Inertia ratio: mean inertia of what the rotor moves, at its shaft, over that of the rotor")
        yield Step(words, "u_J = J_L/J_M", (), Quantity("u_J", load.inertia_ratio))


def _windings(rise: Temperature | None) -> Iterator[Part]:
    """Rise of the windings over their surroundings: at the end of each phase, and the greatest beside its limit."""
    if rise is None:
        return
    words = _("Rise of the windings with losses q over the rated ones, c the share of the cooling")
    yield Note(f"{words}: dθ₁/dt = ((1 − a) θₙ q − c θ₁)/T₁, dθ₂/dt = (a θₙ q − θ₂)/T₂.")
    if rise.phases:
        rows = tuple((name, Quantity("theta_k", rise, "K")) for name, rise in rise.phases)
        yield Table(_("Rise of the windings at the end of each phase"), (_("phase"), _("rise of the windings")), rows)
    title = _("Greatest rise, after {time} of the cycle or the duty", time=quantity(rise.time, "s", 4))
    limit = quantity(rise.limit, "K", 4)
    verdict = _("Their class allows {limit}.", limit=limit)
    if not rise.within:
        verdict = _("Their class allows {limit}: too hot.", limit=limit)
    yield Step(
        title, "theta_max = greatest(theta_1 + theta_2, t)", (), Quantity("theta_max", rise.greatest, "K"), note=verdict
    )
    for name, count in rise.starts.items():
        yield Note(_("At most {count} starts an hour into {phase}.", count=count, phase=name))


def _verdict(share: float | None) -> str:
    if share is None or isnan(share):
        return _("Its limit is unknown without a rated point.")
    value = quantity(share, "%", 4)
    if share > 1.0 + 1e-9:
        return _("That is {share} of the heat at the rated point: too hot for continuous running.", share=value)
    return _("That is {share} of the heat at the rated point.", share=value)


# -- limits -----------------------------------------------------------------------------------------------------------

_LIMITS = {  # formulas of the limits
    "irregularity": "epsilon = (omega_max - omega_min)/omega",
    "motor_torque": "u_max = greatest(abs(T), t)/T_n",
    "motor_rms": "u_T = sqrt(integral(T**2, t, 0, tau)/tau)/T_n",
    "motor_heat": "u_Q = integral(Q, t, 0, tau)/(tau*Q_n)",
    "current_pulsation": "u_i = (greatest(i, t) - least(i, t))/i_n",
}


def limits(context: Context) -> Section | None:
    """Table of the limits: required and reached values, the flywheel that each alone needs, and the binding one."""
    sizing = context.sizing
    if not sizing.limits:
        return None
    rows, emphasis = [], []
    names = limit_names()
    for k, (name, limit) in enumerate(sizing.limits.items()):
        unit = "" if name == "irregularity" else "%"
        alone = Quantity("", limit.alone, "kg m²")
        shares = Quantity("", limit.requirement, unit), Quantity("", limit.reached, unit)
        rows.append((names[name], Formula(_LIMITS[name]), *shares, alone))
        if name == sizing.binding:
            emphasis.append(k)
    head = (_("limit"), _("quantity limited"), _("asked"), _("reached"), _("flywheel for it alone"))
    on = place(sizing.flywheel.on, article=True)
    title = _("Limits of the flywheel on {shaft}, each along the steady motion with it", shaft=on)
    parts: list[Part] = [Table(title, head, tuple(rows), emphasis=frozenset(emphasis))]
    if sizing.binding is None:
        parts.append(Note(_("The machine keeps all limits without a flywheel: none binds.")))
    else:
        exact = sizing.flywheel.exact or 0.0
        value = quantity(exact, "kg m²")
        title = _(
            "{limit} binds: the smallest flywheel that keeps all is {exact}.", limit=names[sizing.binding], exact=value
        )
        parts.append(Note(title, "remark"))
        if context.otherwise:
            parts += _on_crank(context, exact)
    return Section(_("What binds"), tuple(parts))


def _on_crank(context: Context, exact: float) -> Iterator[Part]:
    """The flywheel that another limit than the irregularity decides, as one on the crank with the same energy."""
    title = _("The smallest flywheel that keeps every limit")
    how = _("by Newton's method for flywheel, energy level and balance together")
    if context.ratio == 1.0:
        yield Step(title, "u_k(J) = u_k0", (), Quantity("J", exact, "kg m²"), how=how)
        return
    own = Quantity("J_f", exact, "kg m²")
    yield Step(title, "u_k(J_f) = u_k0", (), own, how=how)
    same = Quantity("J", exact * context.ratio**2, "kg m²")
    yield Step(_("On the crank, with the same energy"), "J = J_f*i_f**2", (own, context.at_flywheel), same)


# -- a duty -----------------------------------------------------------------------------------------------------------


def duty(context: Context) -> Section | None:
    """Section on the duty of the machine with one flywheel, and the motor's load over all of it."""
    run = context.sizing.duty
    if run is None:
        return None
    rows = []
    for row in run.phases:
        figures = (Quantity("t_k", row.duration, "s"), *_phase(row))
        rows.append((row.name, *figures))
    head = (_("phase"), _("time"), _("speed"), _("irregularity"), _("mean power"), _("rms torque"), _("heat"))
    caption = _("Phases of the duty, each in its own steady regime with the flywheel for {phase}", phase=run.governing)
    parts: list[Part] = [Table(caption, head, tuple(rows))]
    cooled = Quantity("t_c", run.cooled, "s")
    if run.running != run.period:
        title = _("Time for cooling: c_k is 1 while the motor runs, at rest the share that counts")
        parts.append(Step(title, "t_c = total(c_k*t_k, k)", (), cooled))
    if run.rms_torque is not None:
        title = _("Root of the mean square of the drive's torque over the duty, starts included")
        result = Quantity("T_rms", run.rms_torque, "N m")
        parts.append(Step(title, "T_rms = sqrt(total(T_k**2*t_k, k)/t_c)", (), result))
    if run.heat is not None:
        title = _("Heat of the motor over the duty, starts included")
        note = _verdict(run.heat_share)
        parts.append(Step(title, "Q = total(Q_k*t_k, k)/t_c", (), Quantity("Q", run.heat, "W"), note=note))
    parts += _windings(context.sizing.temperature)
    if any(row.change_time is None and not row.rest for row in run.phases) and len(run.phases) > 1:
        left = _("The transition between the regimes of two phases is neglected where it counts for little.")
        parts.append(Note(left, "left out"))
    return Section(_("The duty"), tuple(parts))


def _phase(row: PhaseLoad) -> Iterator[Cell]:
    """Speed, irregularity, power, torque and heat of a phase."""
    for symbol, value, unit in (
        ("omega_k", row.speed, "rpm"),
        ("eps_k", row.irregularity, ""),
        ("P_k", row.mean_power, "W"),
        ("T_k", row.rms_torque, "N m"),
        ("Q_k", row.heat, "W"),
    ):
        yield "" if value is None else Quantity(symbol, value, unit)


# -- an engine's gas --------------------------------------------------------------------------------------------------


def engine(context: Context) -> Section | None:
    """Section on the work of the gas in an engine's cylinders, and the share left for the loads."""
    load = context.sizing.engine
    if load is None:
        return None
    work = Quantity("W_i", load.indicated_work, "J")
    parts: list[Part] = [
        Step(_("Indicated work of a cycle, of the gas in all cylinders"), "W_i = total(W_k, k)", (), work),
        Step(
            _("Indicated power, at the mean speed"),
            "P_i = W_i*omega/Phi",
            (work, context.speed, context.turn),
            Quantity("P_i", load.indicated_power, "W"),
        ),
    ]
    if load.swept_volume is not None and load.mean_effective_pressure is not None:
        volume = Quantity("V_h", load.swept_volume, "m³")
        rows: tuple[tuple[Cell, ...], ...] = ((_("volume swept in a cycle"), Formula("V_h"), volume),)
        parts.append(Table(_("Bore and stroke of the cylinders give"), (_("quantity"), _("symbol"), _("value")), rows))
        pressure = Quantity("p_i", load.mean_effective_pressure, "bar")
        parts.append(Step(_("Mean effective pressure"), "p_i = W_i/V_h", (work, volume), pressure))
    if load.brake_work is not None and load.mechanical_efficiency is not None:
        brake = Quantity("W_b", load.brake_work, "J")
        parts.append(Step(_("Work of the loads in a cycle"), "W_b = -total(W_k, k)", (), brake))
        efficiency = Quantity("eta_m", load.mechanical_efficiency)
        parts.append(Step(_("Mechanical efficiency"), "eta_m = W_b/W_i", (brake, work), efficiency))
    return Section(_("Work of the engine's gas"), tuple(parts))


# -- the line of shafts ------------------------------------------------------------------------------------------------


_ANGLES = 721  # for the greatest power of the loads


def train(context: Context) -> Section | None:
    """The power flow over a cycle: its picture, the shafts and their meshes, the losses, and their sum."""
    flow = context.sizing.power_flow
    if flow is None or not input_power(flow, entries(flow)) > TIE * flow.scale:
        return None
    parts: list[Part] = [
        Step(
            _("Over a cycle the input is equal to loads and losses; inertias and weights return the energy they store"),
            "total(integral(P_k, t, 0, tau), k) = 0",
            definitions=("P_k",),
        ),
        *_pictures(flow),
    ]
    if len(flow.shafts) > 1:
        parts += [_shafts(flow), *_meshes(flow)]
    parts += _balance(flow)
    return Section(_("Power flow of the drive train"), tuple(parts))


def _pictures(flow: PowerFlow) -> Iterator[Part]:
    """The Sankey diagrams of the mean and of the angle with the greatest load."""
    phi = np.linspace(0.0, flow.scene.cycle, _ANGLES)
    taken = [k for k, stream in enumerate(flow.streams) if stream.kind == "load"]
    at = float(phi[flow.along(phi)[taken].sum(axis=0).argmax()])
    titles: dict[float | None, str] = {None: _("Power flow from the motor to the tool, mean over the cycle")}
    titles[at] = _("Power flow at {phi}, at the greatest load", phi=quantity(at, "deg", 4))
    for angle, title in titles.items():

        def drawn(angle: float | None = angle) -> str:
            from flywheel.pictures import power_flow as pictures  # which takes long to import

            return pictures.panel(flow, at=angle)

        streams = [entry for entry in entries(flow, angle) if entry.stream.kind != "shaft" and entry.power]
        caption = "; ".join(f"{entry.label} {SI.read(entry.power, 'power', 4)}" for entry in streams)
        yield Figure(drawn, title, f"{caption}.")


def _shafts(flow: PowerFlow) -> Table:
    """Every shaft with its position in the train, its speed, and the torque of its mesh on its own side."""
    scene = flow.scene
    rows: list[tuple[Cell, ...]] = []
    for row in reversed(flow.shafts):
        torques = (row.torque_mean, row.torque_greatest, row.torque_rms)
        least = TIE * abs(row.torque_greatest or 0.0)
        cells = [
            "–" if torque is None else Quantity("", torque if abs(torque) > least else 0.0, "N m") for torque in torques
        ]
        turns = "–" if row.on is None else number(scene.shafts[row.shaft] / scene.shafts[row.on])
        near = "–" if row.on is None else place(row.on)
        rows.append((place(row.shaft), near, turns, Quantity("", row.speed, "rpm"), *cells))
    head = (_("shaft"), _("meshes with"), _("turns for one of that"), _("speed, rpm"))
    return Table(
        _("Shafts: speed (mean of extremes), and torque of their mesh on their own side"),
        (*head, _("mean torque, N m"), _("greatest, N m"), _("rms, N m")),
        tuple(rows),
        formula="tau_k = I_k*derivative(omega, t) + derivative(I_k, phi)*omega**2/2 - M_k + total(k_c*tau_c, c)",
    )


def _meshes(flow: PowerFlow) -> Iterator[Part]:
    """Power through every mesh that has losses, and its losses by slip and by friction."""
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
        _("Meshes: mean power that enters, efficiency in both directions, and slip"),
        (_("mesh"), _("power in, W"), _("efficiency"), _("slip")),
        tuple(rows),
        formula="P_out = eta_k*(1 - s_k)*P_in",
    )
    yield from steps


def _lossy(flow: PowerFlow) -> list[str]:
    """The shafts whose mesh loses power, nearer to the motor first."""
    return [row.shaft for row in reversed(flow.shafts) if flow.scene.efficiencies.get(row.shaft, 1.0) < 1.0]


def _lost(flow: PowerFlow, name: str, k: int, numbers: tuple[Quantity, Quantity, Quantity]) -> Iterator[Step]:
    """The losses of a mesh, each from the power that enters, if power flows one way throughout the cycle."""
    losses = {entry.stream.kind: entry for entry in entries(flow) if entry.stream.name == f"shafts.{name}"}
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
        if kind not in losses:
            continue
        lost = Quantity(symbol, losses[kind].stream.mean, "W")
        one_way = abs(lost.value - factor * enters.value) <= TIE * abs(enters.value)
        yield Step(
            _("Lost: {name}", name=losses[kind].label),
            f"{symbol} = {share}*P_{k}" if one_way else f"{symbol} = {share}*integral(P_in(t), t, 0, tau)/tau",
            used if one_way else (),
            lost,
            how="" if one_way else _("power enters from either side within the cycle: by quadrature"),
        )


def _balance(flow: PowerFlow) -> Iterator[Part]:
    """Input, losses and output as a table with its sum, and the share of the input that arrives."""
    whole = input_power(flow, entries(flow))
    share = (lambda value: Quantity("", value / whole, "%", 4)) if whole > 0.0 else (lambda value: "–")
    enters, leaves = Quantity("P_e", flow.input, "W"), Quantity("P_a", flow.output, "W")
    rows: list[tuple[Cell, ...]] = [(_("comes in"), Formula("P_e"), enters, share(flow.input))]
    symbols: list[Quantity] = []
    of_mesh: dict[tuple[str, str], str] = {}
    for k, shaft in enumerate(_lossy(flow), 1):
        of_mesh |= {("slip", f"shafts.{shaft}"): f"P_s{k}", ("mesh", f"shafts.{shaft}"): f"P_v{k}"}
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
        yield Step(_("Input: loads and losses"), "P_e = P_a + P_v", (leaves, lost), enters)
    if flow.efficiency is not None and flow.output > 0.0:
        title = _("Efficiency of the whole drive train")
        yield Step(title, "eta = P_a/P_e", (leaves, enters), Quantity("eta", flow.efficiency))
    if (summary := sentence(flow)) is not None:
        yield Note(f"{summary}.")


_SYMBOLS = {
    "clutch_heat": ("Q_c", "J"),
    "slip_time": ("t_s", "s"),
    "wheel_energy": ("W_f", "J"),
    "mean_power": ("P_mean", "W"),
    "speed_least": ("omega_min", "rad/s"),
}


def sections(result: SingleStroke, picture: Figure) -> Iterator[Section]:
    """Sections on a stroke: picture, clutch, brake, drive, and loads over limits."""
    yield _stroke(result, picture)
    yield _clutch(result)
    yield _brake(result)
    yield _drive(result)
    yield _loads(result)


def _of(result: SingleStroke, key: str, symbol: str, unit: str) -> Quantity:
    return Quantity(symbol, float(result.figures[key] or 0.0), unit)


def _stroke(result: SingleStroke, picture: Figure) -> Section:
    phases = result.phases
    inertia = Quantity("J_1", driving_inertia(result.strokes), "kg m²")
    start = Quantity("omega_0", phases.begin[0], "rad/s")
    least = Quantity("omega_min", result.speed_least / result.strokes.wheel, "rad/s")
    most = Quantity("omega_max", result.speed_greatest / result.strokes.wheel, "rad/s")
    rows: tuple[tuple[Cell, ...], ...] = (
        (_("inertia of the driving side, on the clutch's shaft"), Formula("J_1"), inertia),
        (_("speed of that shaft as the clutch engages"), Formula("omega_0"), start),
        (_("greatest speed"), Formula("omega_max"), most),
        (_("least speed"), Formula("omega_min"), least),
        (_("period"), Formula("tau"), _of(result, "period", "tau", "s")),
    )
    title = _(
        "The periodic stroke, stepped in time from event to event: speed and angle return to their values at its start"
    )
    table = Table(title, (_("quantity"), _("symbol"), _("value")), rows)
    eps = Step(
        _("Irregularity of the flywheel's shaft"),
        "epsilon = 2*(omega_max - omega_min)/(omega_max + omega_min)",
        (most, least),
        _of(result, "irregularity", "epsilon", ""),
    )
    energy = Step(
        _("Energy that the driving side has given at its least speed"),
        "W_f = J_1*(omega_0**2 - omega_min**2)/2",
        (inertia, start, least),
        _of(result, "wheel_energy", "W_f", "J"),
    )
    return Section(_("The stroke that returns"), (picture, table, eps, energy))


def _clutch(result: SingleStroke) -> Section:
    """Section on heat and time of the slip, compared with two free inertias; the torque of the locked clutch."""
    strokes = result.strokes
    one = Quantity("J_1", driving_inertia(strokes), "kg m²")
    two = Quantity("J_2", driven_inertia(strokes, result.phases) / strokes.ratio**2, "kg m²")
    start = Quantity("omega_0", result.phases.begin[0], "rad/s")
    alone = engage(one.value, start.value, two.value)
    parts: list[Part] = [
        Step(_("While the clutch slips, the driving side is alone with its torque"), "J_1*alpha_1 = M_1 - T"),
        Step(_("and so is the driven side, here on the clutch's shaft"), "J_2*alpha_2 = M_2 + T"),
        Step(
            _("Heat of the clutch in a period"),
            "Q_c = integral(T*(omega_1 - omega_2), t, 0, t_s)",
            (),
            _of(result, "clutch_heat", "Q_c", "J"),
            how=_("by quadrature over the motions of both sides"),
        ),
        Table(
            _("The driven side where the crank stands, on the clutch's shaft"),
            (_("quantity"), _("symbol"), _("value")),
            ((_("reduced inertia"), Formula("J_2"), two),),
        ),
        Step(
            _("By formula, where nothing else acts"),
            "Q_alone = J_1*J_2/(J_1 + J_2)*omega_0**2/2",
            (one, two, start),
            Quantity("Q_alone", alone.heat, "J"),
        ),
        Step(
            _("Greatest torque of the locked clutch: the torque of the driving side less that which accelerates it"),
            "T_max = greatest(abs(M_1 - J_1*alpha_1), t)",
            (),
            _of(result, "clutch_torque", "T_max", "N m"),
            how=_("an extremum of the motion's dense output"),
        ),
    ]
    again = result.figures["second_slip_angle"]
    if result.phases.slips and again is not None:
        rows = (
            (_("crank angle"), Formula("phi_2"), Quantity("phi_2", float(again), "rad")),
            (_("time"), Formula("t_2"), _of(result, "second_slip_time", "t_2", "s")),
            (_("heat"), Formula("Q_2"), _of(result, "second_slip_heat", "Q_2", "J")),
        )
        title = _("The clutch slips again under the work")
        parts.append(Table(title, (_("quantity"), _("symbol"), _("value")), rows, emphasis=frozenset({0})))
    return Section(_("The clutch"), tuple(parts))


def _brake(result: SingleStroke) -> Section:
    parts: list[Part] = [
        Step(
            _("Heat of the brake in a period, with that of its release"),
            "Q_b = integral(T_b*omega_b, t, 0, tau)",
            (),
            _of(result, "brake_heat", "Q_b", "J"),
            how=_("by quadrature"),
        ),
        Step(_("Torque at rest"), "T_b = abs(M_star)/i_b", (), _of(result, "holding_torque", "T_b", "N m")),
    ]
    plan = result.strokes.plan
    if plan.approach is not None:
        time = _of(result, "emergency_time", "T", "s")
        speed, depth = Quantity("K", plan.approach, "m/s"), Quantity("C", plan.intrusion, "m")
        distance = _of(result, "safety_distance", "S", "m")
        rows: tuple[tuple[Cell, ...], ...] = (
            (_("speed of a hand"), Formula("K"), speed),
            (_("response and longest stop"), Formula("T"), time),
            (_("distance that a hand enters undetected"), Formula("C"), depth),
        )
        parts.append(Table(_("Safety distance"), (_("quantity"), _("symbol"), _("value")), rows))
        title = _("Safety distance (ISO 13855); K and C are the user's")
        parts.append(Step(title, "S = K*T + C", (speed, time, depth), distance))
    return Section(_("The brake"), tuple(parts))


def _drive(result: SingleStroke) -> Section:
    work, period = Quantity("W_d", result.energy["motor"], "J"), _of(result, "period", "tau", "s")
    power = Step(_("Mean power of the drive"), "P_mean = W_d/tau", (work, period), _of(result, "mean_power", "P_mean", "W"))
    rms = Step(
        _("Root of the mean square of its torque"),
        "T_rms = sqrt(integral(T**2, t, 0, tau)/tau)",
        (),
        _of(result, "motor_torque_rms", "T_rms", "N m"),
        how=_("by quadrature"),
    )
    names = {
        "motor": _("work of the drive"),
        "loads": _("work of the loads, friction included"),
        "mesh_heat": _("heat of the meshes"),
        "clutch_heat": _("heat of the clutch"),
        "brake_heat": _("heat of the brake"),
        "residual": _("residual"),
    }
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (names[key], Quantity("W_d" if key == "motor" else "", value, "J")) for key, value in result.energy.items()
    )
    title = _("Energy balance of a period; every law is integrated independently of the stepping")
    point = servo_load(result.strokes, result.phases)
    servo = () if point is None else _servo(point)
    warmth = _windings(temperature(result.strokes, driving_sides(result.strokes, result.phases)))
    return Section(_("Power and energy"), (Table(title, (_("energy"), _("value")), rows), power, rms, *servo, *warmth))


def _loads(result: SingleStroke) -> Section:
    limits, loads = load_limits(result.strokes, result.phases, result.figures), list[tuple[Cell, ...]]()
    for name, share in result.shares.items():
        key, limit = limits[name]
        unit = BY_KEY[key].unit
        loads.append((share_name(name), _of(result, key, "", unit), Quantity("", limit, unit), Quantity("", share, "%")))
    beyond = frozenset(
        k for k, name in enumerate(result.shares) if exceeds(result.shares[name], result.error["shares"][name])
    )
    names = _("load"), _("value"), _("limit"), _("of its limit")
    parts: list[Part] = [Table(_("Loads and limits"), names, tuple(loads), emphasis=beyond)]
    parts += [Note(message(trip), "remark") for trip in trip_messages(result.trips)]
    parts += [Note(line, "remark") for line in rate_limit(result)]
    rows: list[tuple[Cell, ...]] = []
    for key, value in result.formulas.items():
        symbol, unit = _SYMBOLS[key]
        exact = float(result.figures[key] or 0.0)
        rows.append((BY_KEY[key].name, Formula(symbol), Quantity("", value, unit), Quantity("", exact, unit)))
    head = (_("quantity"), _("symbol"), _("by formula"), _("in the motion"))
    parts.append(Table(_("Formulas of presses compared with the motion"), head, tuple(rows)))
    return Section(_("Loads and limits"), tuple(parts))
