"""The steps of the drive: its torque against speed, its power and heat with the flywheel and without, an engine's gas."""

from __future__ import annotations

from collections.abc import Iterator

from flywheel.components.energy import Energy
from flywheel.components.motors import DC, Constant, Curve, Engine, Hydraulic, Induction, Line, Motor, Synchronous
from flywheel.language import text as _
from flywheel.report.document import Cell, Formula, Note, Part, Section, Step, Table
from flywheel.report.formulas import Quantity
from flywheel.report.regime import Known, quantity
from flywheel.sizing.duty import PhaseLoad
from flywheel.tables.flywheels import limit_names
from flywheel.tables.power import with_and_without

_MOST_POINTS = 30  # of a curve that a table shows


def motor(known: Known) -> Section | None:
    """The motor's torque against its speed, from its name plate."""
    found = known.scene.motor
    if found is None:
        return None
    parts: list[Part] = []
    if found.rated is not None and not isinstance(found, Engine):
        parts += _rated(found)
    match found:
        case Induction():
            parts += _induction(found)
        case DC():
            parts += _dc(found)
        case Line():
            parts.append(_line(found.at_rest, found.fall, ()))
        case Curve():
            rows = tuple(
                (Quantity("", speed, "rpm"), Quantity("", torque, "N m"))
                for speed, torque in zip(found.speeds, found.torques, strict=True)
            )
            parts.append(
                Table(
                    _("Its torque against its speed, by a table"), (_("speed, rpm"), _("torque, N m")), rows[:_MOST_POINTS]
                )
            )
        case Synchronous():
            parts += _synchronous(found)
        case Engine():
            parts += _engine_curve(found)
        case Hydraulic():
            parts += _hydraulic(found)
        case Constant():
            parts.append(Note(_("Its torque is the same at every speed.")))
    if (breakdown := found.breakdown) is not None and not isinstance(found, Induction | Synchronous):
        told = _(
            "Slower than {speed}, where it gives {torque}, its torque falls: it would stall.",
            speed=quantity(breakdown.speed, "rpm"),
            torque=quantity(breakdown.torque, "N m"),
        )
        parts.append(Note(told, "remark"))
    return Section(_("The motor: {kind}", kind=_kind(found)), tuple(parts))


def _kind(found: Motor) -> str:
    names = {
        "constant torque": _("constant torque"),
        "motor with a straight line": _("motor with a straight line"),
        "motor by a table": _("motor by a table"),
        "DC motor": _("DC motor"),
        "governed engine": _("governed engine"),
        "induction motor": _("induction motor"),
        "synchronous motor": _("synchronous motor"),
        "hydraulic motor": _("hydraulic motor"),
    }
    return names.get(found.title, found.title)


def _hydraulic(found: Hydraulic) -> Iterator[Part]:
    """Torque of a hydraulic motor from displacement, flow and pressure."""
    volume, flow = Quantity("V", found.displacement, "m^3"), Quantity("Q", found.flow, "m^3/s")
    pressure, share = Quantity("p_r", found.pressure, "Pa"), Quantity("eta_v", found.volumetric_efficiency)
    efficiency, idle = Quantity("eta_hm", found.mechanical_efficiency), Quantity("omega_0", found.no_load_speed, "rad/s")
    yield Step(_("Speed without load"), "omega_0 = 2*pi*Q/V", (flow, volume), idle)
    yield Step(
        _("Speed below which the relief valve is open"),
        "omega_r = eta_v*omega_0",
        (share, idle),
        Quantity("omega_r", found.rated.speed, "rad/s"),
    )
    yield Step(
        _("Torque there"),
        "T_r = eta_hm*p_r*V/(2*pi)",
        (efficiency, pressure, volume),
        Quantity("T_r", found.rated.torque, "N m"),
    )


def _rated(found: Motor) -> Iterator[Part]:
    """The rated point of the name plate, and its torque."""
    point = found.rated
    assert point is not None
    power, speed = Quantity("P_n", point.power, "W"), Quantity("omega_n", point.speed, "rad/s")
    rows: tuple[tuple[Cell, ...], ...] = (
        (_("rated power"), Formula("P_n"), power),
        (_("rated speed"), Formula("omega_n"), speed),
    )
    yield Table(_("Name plate"), (_("quantity"), _("symbol"), _("value")), rows)
    yield Step(_("Rated torque"), "T_n = P_n/omega_n", (power, speed), Quantity("T_n", point.torque, "N m"))


def _induction(found: Induction) -> Iterator[Part]:
    """Kloss's formula with the motor's numbers."""
    frequency, poles = Quantity("f", found.frequency, "1/s"), Quantity("p", float(found.poles))
    ratio = Quantity("lamda", found.breakdown_ratio)
    field = Quantity("omega_s", found.synchronous_speed, "rad/s")
    rated, slip = Quantity("omega_n", found.speed, "rad/s"), Quantity("s_n", found.rated_slip)
    rows: tuple[tuple[Cell, ...], ...] = (
        (_("frequency of the mains"), Formula("f"), frequency._replace(unit="")),
        (_("number of poles"), Formula("p"), poles),
        (_("breakdown torque over rated torque"), Formula("lamda"), ratio),
    )
    frequency = frequency._replace(unit="")
    yield Table(_("Mains (Hz) and catalogue"), (_("quantity"), _("symbol"), _("value")), rows)
    yield Step(_("Synchronous speed"), "omega_s = 4*pi*f/p", (frequency, poles), field)
    yield Step(_("Rated slip"), "s_n = (omega_s - omega_n)/omega_s", (field, rated), slip)
    yield Step(
        _("Breakdown torque"),
        "T_b = lamda*T_n",
        (ratio, Quantity("T_n", found.rated.torque, "N m")),
        Quantity("T_b", found.breakdown_torque, "N m"),
    )
    yield Step(
        _("Breakdown slip, such that the curve passes through the rated point"),
        "s_b = s_n*(lamda + sqrt(lamda**2 - 1))",
        (slip, ratio),
        Quantity("s_b", found.breakdown_slip),
    )
    yield Step(_("Slip at any speed"), "s = (omega_s - omega)/omega_s", definitions=("s",))
    yield Step(_("Torque (Kloss)"), "T(s) = 2*T_b/(s/s_b + s_b/s)", definitions=("T",))


def _synchronous(found: Synchronous) -> Iterator[Part]:
    """The torque of a synchronous motor by its load angle."""
    field, reluctance = Quantity("T_p", found.field_torque, "N m"), Quantity("T_r", found.reluctance_torque, "N m")
    pull_out_angle = Quantity("delta", found.pull_out_angle, "rad")
    yield Step(
        _("Greatest torque at which it keeps step, by its load angle"),
        "T_po = T_p*sin(delta) + T_r*sin(2*delta)",
        (field, reluctance, pull_out_angle),
        Quantity("T_po", found.pull_out_torque, "N m"),
    )
    yield Note(_("The load angle turns on with the slip: along the motion dδ/dt = p (ω_s − ω) is solved with it."))


def _dc(found: DC) -> Iterator[Part]:
    """The straight line of a DC motor."""
    voltage, resistance = Quantity("U", found.voltage, "V"), Quantity("R_a", found.resistance, "Ω")
    constant, friction = Quantity("k_m", found.constant, "N m/A"), Quantity("b", found.friction, "N m s")
    rows: list[tuple[Cell, ...]] = [
        (_("voltage at the armature"), Formula("U"), voltage),
        (_("resistance of the armature"), Formula("R_a"), resistance),
        (_("motor constant"), Formula("k_m"), constant),
        (_("friction"), Formula("b"), friction),
    ]
    if found.inductance:
        rows.append((_("inductance of the armature"), Formula("L_a"), Quantity("L_a", found.inductance, "H")))
    yield Table(_("Constants of the motor"), (_("quantity"), _("symbol"), _("value")), tuple(rows))
    yield Step(_("Current at any speed, when it is steady"), "i = (U - k_m*omega)/R_a", definitions=("i",))
    yield Step(
        _("Torque at rest"),
        "T_0 = k_m*U/R_a",
        (constant, voltage, resistance),
        Quantity("T_0", found.quasi_static.at_rest, "N m"),
    )
    yield Step(
        _("Fall of the torque with speed"),
        "c = k_m**2/R_a + b",
        (constant, resistance, friction),
        Quantity("c", found.quasi_static.fall, "N m s"),
    )
    yield Step(_("Torque at any speed"), "T(omega) = T_0 - c*omega", definitions=("T",))
    if found.inductance:
        yield Note(_("The current has an inertia of its own: along the motion L di/dt = U − R i − k ω is solved with it."))


def _line(at_rest: float, fall: float, numbers: tuple[Quantity, ...]) -> Part:
    rows: tuple[tuple[Cell, ...], ...] = (
        (_("torque at rest"), Formula("T_0"), Quantity("T_0", at_rest, "N m")),
        (_("fall of the torque with speed"), Formula("c"), Quantity("c", fall, "N m s")),
    )
    return Table(
        _("Its torque falls in a straight line with its speed"),
        (_("quantity"), _("symbol"), _("value")),
        rows,
        formula="T(omega) = T_0 - c*omega",
        numbers=numbers,
    )


def _engine_curve(found: Engine) -> Iterator[Part]:
    rows: tuple[tuple[Cell, ...], ...] = (
        (_("speed up to which it is at full load"), Quantity("", found.speed, "rad/s")),
        (_("torque at full load there"), Quantity("", found.rated.torque, "N m")),
        (_("droop of the governor, as a share of that speed"), Quantity("", found.droop)),
        (_("speed without load"), Quantity("", found.no_load_speed, "rad/s")),
    )
    yield Table(_("Engine and governor"), (_("quantity"), _("value")), rows)


# -- power, energy, heat ----------------------------------------------------------------------------------------------


def power(known: Known) -> Section | None:
    """Power over the time of a cycle, with the flywheel and without one, and what heats the motor."""
    sizing, energy = known.sizing, known.sizing.energy
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
        told = _("Greatest over mean power with the flywheel")
        parts.append(Step(told, "q = P_max/P_mean", (peak, mean), Quantity("q", energy.peak_to_mean)))
    if known.scene.motor is not None:
        parts += _of_motor(known, mean)
    return Section(_("Power and heat of the drive"), tuple(parts))


def _of_motor(known: Known, mean: Quantity) -> Iterator[Part]:
    """The motor's power beside its rating, and what heats it."""
    found, energy = known.scene.motor, known.sizing.energy
    assert energy is not None
    assert found is not None
    rated = found.rated
    if rated is not None and not isinstance(found, Engine):
        yield Step(
            _("Share of the rated power"),
            "u = P_mean/P_n",
            (mean, Quantity("P_n", rated.power, "W")),
            Quantity("u", mean.value / rated.power),
        )
        yield Step(
            _("Root of the mean square of its torque over time, which heats it"),
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
    if isinstance(found, Induction) and energy.rotor_heat is not None:
        yield Step(
            _("Heat of the rotor on the mean over time: torque times slip speed"),
            "Q_r = integral(T*(omega_s - omega_d), t, 0, tau)/tau",
            (),
            Quantity("Q_r", energy.rotor_heat, "W"),
            note=_verdict(energy.rotor_heat_share),
        )
        yield from _line_current(found, energy)
    elif isinstance(found, DC) and energy.copper_heat is not None and energy.current_rms is not None:
        current = Quantity("i_rms", energy.current_rms, "A")
        yield Step(
            _("Root of the mean square of the armature's current over time"),
            "i_rms = sqrt(integral(i**2, t, 0, tau)/tau)",
            (),
            current,
        )
        yield Step(
            _("Copper heat of the armature"),
            "Q_c = R_a*i_rms**2",
            (Quantity("R_a", found.resistance, "Ω"), current),
            Quantity("Q_c", energy.copper_heat, "W"),
            note=_verdict(energy.copper_heat_share),
        )
    elif isinstance(found, Synchronous):
        yield Note(_("A synchronous motor is judged by its load angle: what heats it depends on its windings."), "left out")
    elif not isinstance(found, Engine):
        yield Note(_("Torque against speed alone does not tell what heats this motor."), "left out")


def _line_current(found: Induction, energy: Energy) -> Iterator[Part]:
    """Line current and heat of an induction motor's stator, by what its name plate says."""
    share = energy.stator_heat_share
    if share is None:
        return
    yield Step(
        _("Heat of the stator's copper over that at the rated point, by the line current"),
        "u_s = integral((I/I_n)**2, t, 0, tau)/tau",
        (),
        Quantity("u_s", share),
        note=_verdict(share),
    )
    if found.rated_current is not None and energy.current_rms is not None:
        rated = Quantity("I_n", found.rated_current, "A")
        yield Step(
            _("Root of the mean square of the line current over time"),
            "I_rms = I_n*sqrt(u_s)",
            (rated, Quantity("u_s", share)),
            Quantity("I_rms", energy.current_rms, "A"),
        )


def _verdict(share: float | None) -> str:
    if share is None:
        return _("What it may be is not known without a rated point.")
    shown = quantity(share, "%", 4)
    if share > 1.0 + 1e-9:
        return _("That is {share} of the heat at the rated point: too hot for continuous running.", share=shown)
    return _("That is {share} of the heat at the rated point, which it is rated for.", share=shown)


# -- limits -----------------------------------------------------------------------------------------------------------

_LIMITS = {  # what each is, as a formula
    "irregularity": "epsilon = (omega_max - omega_min)/omega",
    "motor_torque": "u_max = greatest(abs(T), t)/T_n",
    "motor_rms": "u_T = sqrt(integral(T**2, t, 0, tau)/tau)/T_n",
    "motor_heat": "u_Q = integral(Q, t, 0, tau)/(tau*Q_n)",
    "current_pulsation": "u_i = (greatest(i, t) - least(i, t))/i_n",
}


def limits(known: Known) -> Section | None:
    """What was asked of the flywheel together, what is reached, what each alone would need, and which binds."""
    sizing = known.sizing
    if not sizing.limits:
        return None
    rows, emphasis = [], []
    names = limit_names()
    for k, (name, limit) in enumerate(sizing.limits.items()):
        unit = "" if name == "irregularity" else "%"
        alone = Quantity("", limit.alone, "kg m²")
        shares = Quantity("", limit.asked, unit), Quantity("", limit.reached, unit)
        rows.append((names[name], Formula(_LIMITS[name]), *shares, alone))
        if name == sizing.binding:
            emphasis.append(k)
    head = (_("limit"), _("what it is"), _("asked"), _("reached"), _("flywheel that it alone needs"))
    told = _("Limits of the flywheel on {shaft}, each along the steady motion with it", shaft=sizing.flywheel.on)
    parts: list[Part] = [Table(told, head, tuple(rows), emphasis=frozenset(emphasis))]
    if sizing.binding is None:
        parts.append(Note(_("The machine keeps all of them without a flywheel: none binds.")))
    else:
        exact = sizing.flywheel.exact or 0.0
        shown = quantity(exact, "kg m²")
        told = _("{limit} binds: the smallest flywheel that keeps all is {exact}.", limit=names[sizing.binding], exact=shown)
        parts.append(Note(told, "remark"))
        if known.otherwise:
            parts += _on_crank(known, exact)
    return Section(_("What binds"), tuple(parts))


def _on_crank(known: Known, exact: float) -> Iterator[Part]:
    """The flywheel that another limit than the irregularity decides, as one on the crank with the same energy."""
    told = _("The smallest flywheel that keeps every limit")
    how = _("by Newton's method: flywheel, energy level and balance are found together")
    if known.ratio == 1.0:
        yield Step(told, "u_k(J) = u_k0", (), Quantity("J", exact, "kg m²"), how=how)
        return
    own = Quantity("J_f", exact, "kg m²")
    yield Step(told, "u_k(J_f) = u_k0", (), own, how=how)
    same = Quantity("J", exact * known.ratio**2, "kg m²")
    yield Step(_("As one on the crank, with the same energy"), "J = J_f*i_f**2", (own, known.at_flywheel), same)


# -- a duty -----------------------------------------------------------------------------------------------------------


def duty(known: Known) -> Section | None:
    """What the machine does in turn, with one flywheel, and what its motor bears over all of it."""
    found = known.sizing.duty
    if found is None:
        return None
    rows = []
    for row in found.phases:
        figures = (Quantity("t_k", row.duration, "s"), *_phase(row))
        rows.append((row.name, *figures))
    head = (_("phase"), _("time"), _("speed"), _("irregularity"), _("mean power"), _("rms torque"), _("heat"))
    caption = _(
        "Phases of the duty, each in its own steady regime with the flywheel that {phase} asks for", phase=found.governing
    )
    parts: list[Part] = [Table(caption, head, tuple(rows))]
    cooled = Quantity("t_c", found.cooled, "s")
    if found.running != found.period:
        told = _("Time that cools: c_k is 1 while the motor runs, and at rest the share that counts")
        parts.append(Step(told, "t_c = total(c_k*t_k, k)", (), cooled))
    if found.rms_torque is not None:
        told = _("Root of the mean square of the drive's torque over the duty, starts included")
        result = Quantity("T_rms", found.rms_torque, "N m")
        parts.append(Step(told, "T_rms = sqrt(total(T_k**2*t_k, k)/t_c)", (), result))
    if found.heat is not None:
        told = _("Heat of the motor over the duty, starts included")
        note = _verdict(found.heat_share)
        parts.append(Step(told, "Q = total(Q_k*t_k, k)/t_c", (), Quantity("Q", found.heat, "W"), note=note))
    left = _("What passes between the regimes of two phases is left out.")
    return Section(_("The duty"), (*parts, Note(left, "left out")))


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


def engine(known: Known) -> Section | None:
    """What the gas of an engine's cylinders does, and what is left of it for the loads."""
    found = known.sizing.engine
    if found is None:
        return None
    work = Quantity("W_i", found.indicated_work, "J")
    parts: list[Part] = [
        Step(_("Indicated work of a cycle: that of the gas in all cylinders"), "W_i = total(W_k, k)", (), work),
        Step(
            _("Indicated power, at the mean speed"),
            "P_i = W_i*omega/Phi",
            (work, known.speed, known.turn),
            Quantity("P_i", found.indicated_power, "W"),
        ),
    ]
    if found.swept_volume is not None and found.mean_effective_pressure is not None:
        volume = Quantity("V_h", found.swept_volume, "m³")
        rows: tuple[tuple[Cell, ...], ...] = ((_("volume swept in a cycle"), Formula("V_h"), volume),)
        parts.append(Table(_("Bore and stroke of the cylinders give"), (_("quantity"), _("symbol"), _("value")), rows))
        pressure = Quantity("p_i", found.mean_effective_pressure, "bar")
        parts.append(Step(_("Mean effective pressure"), "p_i = W_i/V_h", (work, volume), pressure))
    if found.brake_work is not None and found.mechanical_efficiency is not None:
        brake = Quantity("W_b", found.brake_work, "J")
        parts.append(Step(_("Work that the loads take in a cycle"), "W_b = -total(W_k, k)", (), brake))
        efficiency = Quantity("eta_m", found.mechanical_efficiency)
        parts.append(Step(_("Mechanical efficiency"), "eta_m = W_b/W_i", (brake, work), efficiency))
    return Section(_("What the engine's gas does"), tuple(parts))
