"""The stroke of a machine with clutch and brake: its figures with their formulas, those of presses, loads and limits."""

from __future__ import annotations

from collections.abc import Iterator

from flywheel.components.press_work import engage
from flywheel.language import text as _
from flywheel.motions.single_stroke import BY_KEY, SingleStroke, driven_inertia, driving_inertia, rate_limit, share_name
from flywheel.report.document import Cell, Figure, Formula, Note, Part, Section, Step, Table
from flywheel.report.formulas import Quantity

_SYMBOLS = {
    "clutch_heat": ("Q_c", "J"),
    "slip_time": ("t_s", "s"),
    "wheel_energy": ("W_f", "J"),
    "mean_power": ("P_mean", "W"),
    "speed_least": ("omega_min", "rad/s"),
}


def sections(found: SingleStroke, picture: Figure) -> Iterator[Section]:
    """Sections on the stroke with its picture, the clutch, the brake, the drive, and the loads over their limits."""
    yield _stroke(found, picture)
    yield _clutch(found)
    yield _brake(found)
    yield _drive(found)
    yield _loads(found)


def _of(found: SingleStroke, key: str, symbol: str, unit: str) -> Quantity:
    return Quantity(symbol, float(found.figures[key] or 0.0), unit)


def _stroke(found: SingleStroke, picture: Figure) -> Section:
    phases = found.phases
    inertia = Quantity("J_1", driving_inertia(found.strokes), "kg m²")
    start = Quantity("omega_0", phases.begin[0], "rad/s")
    least = Quantity("omega_min", found.speed_least / found.strokes.wheel, "rad/s")
    most = Quantity("omega_max", found.speed_greatest / found.strokes.wheel, "rad/s")
    rows: tuple[tuple[Cell, ...], ...] = (
        (_("all that turns before the clutch, on its shaft"), Formula("J_1"), inertia),
        (_("speed of that shaft as the clutch engages"), Formula("omega_0"), start),
        (_("greatest speed"), Formula("omega_max"), most),
        (_("least speed"), Formula("omega_min"), least),
        (_("period"), Formula("tau"), _of(found, "period", "tau", "s")),
    )
    told = _("The stroke after which speed and angle are what they were, stepped in time from event to event")
    table = Table(told, (_("quantity"), _("symbol"), _("value")), rows)
    eps = Step(
        _("Irregularity of the flywheel's shaft"),
        "epsilon = 2*(omega_max - omega_min)/(omega_max + omega_min)",
        (most, least),
        _of(found, "irregularity", "epsilon", ""),
    )
    energy = Step(
        _("Energy that the driving side has given at its least speed"),
        "W_f = J_1*(omega_0**2 - omega_min**2)/2",
        (inertia, start, least),
        _of(found, "wheel_energy", "W_f", "J"),
    )
    return Section(_("The stroke that returns"), (picture, table, eps, energy))


def _clutch(found: SingleStroke) -> Section:
    """Section on heat and time of the slip, compared with two free inertias; the torque of the locked clutch."""
    strokes = found.strokes
    one = Quantity("J_1", driving_inertia(strokes), "kg m²")
    two = Quantity("J_2", driven_inertia(strokes, found.phases) / strokes.ratio**2, "kg m²")
    start = Quantity("omega_0", found.phases.begin[0], "rad/s")
    alone = engage(one.value, start.value, two.value)
    parts: list[Part] = [
        Step(_("While the clutch slips, the driving side is alone with its torque"), "J_1*alpha_1 = M_1 - T"),
        Step(_("and so is the driven side, here on the clutch's shaft"), "J_2*alpha_2 = M_2 + T"),
        Step(
            _("Heat of the clutch in a period"),
            "Q_c = integral(T*(omega_1 - omega_2), t, 0, t_s)",
            (),
            _of(found, "clutch_heat", "Q_c", "J"),
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
            _("Greatest torque of the locked clutch: what the driving side has left"),
            "T_max = greatest(abs(M_1 - J_1*alpha_1), t)",
            (),
            _of(found, "clutch_torque", "T_max", "N m"),
            how=_("an extremum of the motion's dense output"),
        ),
    ]
    again = found.figures["second_slip_angle"]
    if found.phases.slips and again is not None:
        rows = (
            (_("crank angle"), Formula("phi_2"), Quantity("phi_2", float(again), "rad")),
            (_("time"), Formula("t_2"), _of(found, "second_slip_time", "t_2", "s")),
            (_("heat"), Formula("Q_2"), _of(found, "second_slip_heat", "Q_2", "J")),
        )
        told = _("The clutch slips again under the work")
        parts.append(Table(told, (_("quantity"), _("symbol"), _("value")), rows, emphasis=frozenset({0})))
    return Section(_("The clutch"), tuple(parts))


def _brake(found: SingleStroke) -> Section:
    parts: list[Part] = [
        Step(
            _("Heat of the brake in a period, the one as it lets go included"),
            "Q_b = integral(T_b*omega_b, t, 0, tau)",
            (),
            _of(found, "brake_heat", "Q_b", "J"),
            how=_("by quadrature"),
        ),
        Step(_("Torque at rest"), "T_b = abs(M_star)/i_b", (), _of(found, "holding_torque", "T_b", "N m")),
    ]
    plan = found.strokes.plan
    if plan.approach is not None:
        time = _of(found, "emergency_time", "T", "s")
        speed, depth = Quantity("K", plan.approach, "m/s"), Quantity("C", plan.intrusion, "m")
        distance = _of(found, "safety_distance", "S", "m")
        rows: tuple[tuple[Cell, ...], ...] = (
            (_("speed of a hand"), Formula("K"), speed),
            (_("response and longest stop"), Formula("T"), time),
            (_("way that a hand comes in unseen"), Formula("C"), depth),
        )
        parts.append(Table(_("A hand and the stop"), (_("quantity"), _("symbol"), _("value")), rows))
        told = _("Safety distance (ISO 13855); K and C are the user's")
        parts.append(Step(told, "S = K*T + C", (speed, time, depth), distance))
    return Section(_("The brake"), tuple(parts))


def _drive(found: SingleStroke) -> Section:
    work, period = Quantity("W_d", found.energy["motor"], "J"), _of(found, "period", "tau", "s")
    power = Step(_("Mean power of the drive"), "P_mean = W_d/tau", (work, period), _of(found, "mean_power", "P_mean", "W"))
    rms = Step(
        _("Root of the mean square of its torque"),
        "T_rms = sqrt(integral(T**2, t, 0, tau)/tau)",
        (),
        _of(found, "motor_torque_rms", "T_rms", "N m"),
        how=_("by quadrature"),
    )
    names = {
        "motor": _("work of the drive"),
        "loads": _("work of the loads, friction included"),
        "mesh_heat": _("heat of the meshes"),
        "clutch_heat": _("heat of the clutch"),
        "brake_heat": _("heat of the brake"),
        "residual": _("what is missing"),
    }
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (names[key], Quantity("W_d" if key == "motor" else "", value, "J")) for key, value in found.energy.items()
    )
    told = _("What goes in and comes out in a period: every law integrated apart from the stepping")
    return Section(_("Power and energy"), (Table(told, (_("energy"), _("value")), rows), power, rms))


def _loads(found: SingleStroke) -> Section:
    loads: tuple[tuple[Cell, ...], ...] = tuple(
        (share_name(name), Quantity("", share, "%")) for name, share in found.shares.items()
    )
    beyond = frozenset(k for k, share in enumerate(found.shares.values()) if share > 1.0)
    parts: list[Part] = [Table(_("Loads over their limits"), (_("load"), _("of its limit")), loads, emphasis=beyond)]
    parts += [Note(told, "remark") for told in rate_limit(found)]
    rows: list[tuple[Cell, ...]] = []
    for key, value in found.formulas.items():
        symbol, unit = _SYMBOLS[key]
        exact = float(found.figures[key] or 0.0)
        rows.append((BY_KEY[key].name, Formula(symbol), Quantity("", value, unit), Quantity("", exact, unit)))
    head = (_("quantity"), _("symbol"), _("by formula"), _("in the motion"))
    parts.append(Table(_("Formulas of presses compared with the motion"), head, tuple(rows)))
    return Section(_("What it bears"), tuple(parts))
