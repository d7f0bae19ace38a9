"""The steps of the steady regime: balance, areas, approximate and exact flywheel, speeds, and stability of the motion.

Each function gives a section of the report, or None if it does not apply to the scene. Numbers are those of the
sizing, or of its cycle at an angle of the sizing; a symbol that a step uses was shown before.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from flywheel.language import text as _
from flywheel.numerics import cells
from flywheel.regime import turning_moment, wittenbauer
from flywheel.regime.turning_moment import Cycle
from flywheel.report import formulas
from flywheel.report.document import Cell, Context, Formula, Note, Part, Section, Step, Table, number, quantity
from flywheel.report.formulas import MOST_DIGITS, Quantity
from flywheel.sizing.findings import REPORT, rows_of
from flywheel.sizing.results import Sizing
from flywheel.tables.power import entries
from flywheel.tables.scene import part_name
from flywheel.tables.sizing import settling_cycles

_MESH_LOSSES = ("slip", "mesh")  # kinds of streams that are no shares of the moment, but follow what a mesh carries
_MOST_AREAS = 40  # that a table shows
ROUNDING = 1e-10
"""Share of a figure: a smaller remainder is written as 0."""


# -- what is asked ----------------------------------------------------------------------------------------------------


def requirements(context: Context) -> Section:
    """The speed, the cycle and the irregularity as symbols, with their direct consequences."""
    scene, sizing = context.scene, context.sizing
    rows: list[tuple[Cell, ...]] = []
    parts: list[Part] = []
    if scene.areas is None:
        rows.append((_("angle of a cycle, on the crank"), Formula("Phi"), context.turn))
    if scene.areas is not None:
        rows.append((_("work for each unit of a measured area, J"), Formula("mu_A"), Quantity("mu_A", scene.areas.scale)))
    if scene.speed is not None:
        rows.append((_("required speed of the crank"), Formula("n"), Quantity("n", scene.speed, "rpm")))
    if scene.irregularity is not None:
        rows.append((_("irregularity allowed"), Formula("epsilon"), context.epsilon))
    if scene.inertia is not None:
        rows.append(
            (_("flywheel given, on {shaft}", shaft=scene.flywheel_on), Formula("J"), Quantity("J", scene.inertia, "kg m²"))
        )
    if context.ratio != 1.0:
        title = _("turns of the flywheel's shaft {shaft} for one of the crank", shaft=scene.flywheel_on)
        rows.append((title, Formula("i_f"), context.at_flywheel))
    if scene.drive is not None and scene.shafts[scene.drive.on] != 1.0:
        title = _("turns of the drive's shaft {shaft} for one of the crank", shaft=scene.drive.on)
        rows.append((title, Formula("i_d"), Quantity("i_d", scene.shafts[scene.drive.on])))
    head = (_("quantity"), _("symbol"), _("value"))
    parts.append(Table(_("Requirements"), head, tuple(rows)))
    if scene.speed is not None and (sizing.cyclic is None or scene.unknown is not None):
        parts.append(
            Step(
                _("Mean speed of the crank, the mean of the greatest and the least"),
                "omega = 2*pi*n/60",
                (Quantity("n", scene.speed * 30 / math.pi, ""),),
                context.speed,
            )
        )
    elif sizing.cyclic is not None:
        parts.append(
            Step(
                _("Mean speed of the machine's own motion: the mean of its greatest and least speed"),
                "omega = (omega_max + omega_min)/2",
                (),
                context.speed,
                how=_("from the periodic motion below, in which the work of a cycle is zero"),
            )
        )
    return Section(_("What is asked"), tuple(parts))


# -- balance of the cycle ---------------------------------------------------------------------------------------------


def balance(context: Context) -> Section | None:
    """The work of every load over the cycle, and the unknown that makes the sum zero."""
    sizing, scene, cycle = context.sizing, context.scene, context.cycle
    if cycle is None:
        return None
    parts: list[Part] = [
        Step(
            _("In the steady regime the kinetic energy is the same after every cycle: the net work of a cycle is zero"),
            "total(W_k, k) = total(integral(M_star_k(phi), phi, 0, Phi), k) = 0",
            definitions=("W_k",),
        )
    ]
    others = {name: work for name, work in context.works.items() if name != "drive"}
    named = {name: Quantity(f"W_{k}", work, "J") for k, (name, work) in enumerate(others.items(), 1)}
    rows: list[tuple[Cell, ...]] = [(part_name(scene, name), Formula(work.symbol), work) for name, work in named.items()]
    lost = _mesh_losses(sizing, len(named))
    rows += [(_("lost: {name}", name=name), Formula(work.symbol), work) for name, work in lost]
    if rows:
        title = _("Work of all loads but the drive over a cycle, the integral of their share of the moment")
        parts.append(Table(title, (_("load"), _("symbol"), _("work, J")), tuple(rows)))
    drive, solved = scene.drive, sizing.balance
    if solved is not None and solved.name == "drive" and drive is not None:
        parts += _drive_balance(context, [*named.values(), *(work for _name, work in lost)], lossy=bool(lost))
    else:
        if solved is not None:
            parts += _parameter_balance(context)
        if drive is not None and sizing.drive_work is not None:
            title = _("Work of the drive over a cycle along the motion")
            work = Quantity("W_d", sizing.drive_work, "J")
            how = _("by quadrature over the cycle, piece by piece between the angles where a law switches")
            parts.append(Step(title, "W_d = integral(M_star_d(phi), phi, 0, Phi)", (), work, how=how))
    title = _("The work exchanged in a cycle is {exchanged}; ", exchanged=quantity(cycle.exchanged, "J"))
    if abs(cycle.net) <= ROUNDING * cycle.exchanged:
        title += _("the net work is 0 within rounding.")
    else:
        title += _("the remaining net work is {net}.", net=quantity(cycle.net, "J", 2))
    parts.append(Note(title))
    if sizing.power is not None and sizing.drive_work is not None:
        parts.append(
            Step(
                _("Power of the drive at the mean of the extreme speeds: its work over the angle of a cycle, times it"),
                "P_d = W_d*omega/Phi",
                (Quantity("W_d", sizing.drive_work, "J"), context.speed, context.turn),
                context.of("power"),
                note=_("It is negative: the drive brakes.") if sizing.power < 0.0 else "",
            )
        )
    return Section(_("Balance of the cycle"), tuple(parts))


def _mesh_losses(sizing: Sizing, count: int) -> list[tuple[str, Quantity]]:
    """The works (J, negative) of friction and slip in meshes and of friction in joints in a cycle, by their place.

    Their symbols continue from those of `count` loads.
    """
    flow = sizing.power_flow
    if flow is None:
        return []
    lost = [entry for entry in entries(flow) if entry.stream.kind in _MESH_LOSSES and entry.power]
    return [(entry.label, Quantity(f"W_{k}", -entry.stream.work, "J")) for k, entry in enumerate(lost, count + 1)]


def _drive_balance(context: Context, works: list[Quantity], *, lossy: bool) -> Iterator[Part]:
    """The constant torque of the drive; `lossy` if losses among the works depend on it."""
    scene, solved, drive = context.scene, context.sizing.balance, context.scene.drive
    assert solved is not None
    assert drive is not None
    ratio = scene.shafts[drive.on]
    geared = ratio != 1.0
    numbers = [*works, *([Quantity("i_d", ratio)] if geared else []), context.turn]
    sum_of = " + ".join(work.symbol for work in works) or "0"
    below = "(i_d*Phi)" if geared else "Phi"
    torque = Quantity("M_d", solved.value, "N m")
    what = _("The constant torque of the drive, on shaft {shaft}, makes the sum zero", shaft=drive.on)
    if lossy or not works:
        yield Step(
            what,
            "M_d*i_d*Phi = -total(W_k, k)" if geared else "M_d*Phi = -total(W_k, k)",
            (),
            torque,
            how=_("computed together with the losses, which depend on the torque"),
        )
    else:
        yield Step(what, f"M_d = -({sum_of})/{below}", tuple(numbers), torque)
    if context.sizing.drive_work is not None:
        yield Step(
            _("Work of the drive in a cycle"),
            "W_d = M_d*i_d*Phi" if geared else "W_d = M_d*Phi",
            (torque, *numbers[len(works) :]),
            Quantity("W_d", context.sizing.drive_work, "J"),
        )


def _parameter_balance(context: Context) -> Iterator[Part]:
    """An unknown parameter, in which the net work is linear."""
    sizing, solved, cycle = context.sizing, context.sizing.balance, context.cycle
    assert solved is not None
    assert cycle is not None
    assert sizing.machine is not None
    name, unit = formulas.index(solved.name) or "u", sizing.balance_unit or ""
    symbol = name if name.isidentifier() and name not in ("pi", "phi", "omega") else "u"
    value = Quantity(symbol, solved.value, unit)
    reduced = sizing.machine.reduce(cycle.mesh.phi, cycle.mesh.anchor)
    slope = float(cells.integral(reduced.per_unknown + np.zeros_like(cycle.mesh.phi), cycle.mesh.half).sum())
    if sizing.cyclic is None:
        rest, per = Quantity("N_0", -solved.value * slope, "J"), Quantity("N_1", slope, f"J/({unit})" if unit else "J")
        per = per._replace(unit="")
        yield Table(
            _("The net work of a cycle is linear in the unknown {name}: N = N₀ + N₁ {name}", name=solved.name),
            (_("part"), _("symbol"), _("value")),
            (
                (_("net work independent of it, J"), Formula("N_0"), rest._replace(unit="J")),
                (_("net work for each unit (SI) of it"), Formula("N_1"), per),
            ),
        )
        yield Step(_("The unknown makes the net work zero"), f"{symbol} = -N_0/N_1", (rest, per), value)
    else:
        yield Step(
            _("The unknown makes the net work of the motion zero"),
            "total(W_k, k) = 0",
            (),
            value,
            how=_("computed with the motion, on whose speed other torques depend"),
        )


# -- areas ------------------------------------------------------------------------------------------------------------


def areas(context: Context) -> Section | None:
    """Crossings, areas, accumulated areas with the greatest and the least, and the fluctuation of energy."""
    sizing, constant = context.sizing, context.constant
    if not sizing.areas:
        return None
    parts: list[Part] = []
    if sizing.cyclic is not None:
        if context.scene.unknown is not None:
            title = _("Areas take the torques at the required speed, constant, with the balance for it")
        else:
            title = _("Areas take the torques at the constant speed at which the net work of a cycle is zero")
        parts.append(Step(title, "integral(M_star(phi, omega_c), phi, 0, Phi) = 0", (), context.area_speed))
    if constant is not None and context.scene.areas is None:
        parts += [
            Step(
                _("The work of the reduced moment from the beginning of the cycle on"),
                "W(phi) = integral(M_star(psi), psi, 0, phi)",
                definitions=("W",),
            ),
            _crossings(context, constant),
        ]
    parts.append(context.panel("moment"))
    parts += _area_table(context)
    parts.append(context.panel("work"))
    marks = _extreme_sums(sizing)
    greatest, least, fluctuation = (context.of(key) for key in ("accumulated_max", "accumulated_min", "energy_fluctuation"))
    table = (
        (_("greatest accumulated work, {name}", name=marks[0]), Formula("W_max"), greatest),
        (_("least accumulated work, {name}", name=marks[1]), Formula("W_min"), least),
    )
    parts.append(Table(_("The extremes of the accumulated work"), (_("quantity"), _("symbol"), _("value")), table))
    parts.append(
        Step(
            _("The fluctuation of energy"),
            "DeltaW = W_max - W_min",
            (greatest, least),
            fluctuation,
        )
    )
    if sizing.coefficient_of_energy is not None and sizing.drive_work and sizing.cyclic is None:
        parts.append(
            Step(
                _("The same as a share of the drive's work, the coefficient of energy"),
                "k_e = DeltaW/W_d",
                (fluctuation, Quantity("W_d", sizing.drive_work, "J")),
                context.of("coefficient_of_energy"),
            )
        )
    rest = tuple((one.name, Formula(one.symbol), context.of(one.key)) for one, _value in rows_of(REPORT, sizing))
    if rest:
        parts.append(Table(_("Further figures"), (_("quantity"), _("symbol"), _("value")), rest))
    return Section(_("Crossings, areas and accumulated areas"), tuple(parts))


def _extreme_sums(sizing: Sizing) -> tuple[str, str]:
    """Symbols of the greatest and the least sums: S0, S1..."""
    sums = [0.0, *(area.accumulated for area in sizing.areas)]

    def nearest(extreme: float) -> str:
        return f"S{min(range(len(sums)), key=lambda k: abs(sums[k] - extreme))}"

    return nearest(sizing.accumulated_max), nearest(sizing.accumulated_min)


def _crossings(context: Context, cycle: Cycle) -> Part:
    """Crossings of the moment: its zeros, and jumps through zero where a load switches."""
    rows: list[tuple[Cell, ...]] = []
    for k, area in enumerate(context.sizing.areas[:-1][:_MOST_AREAS], 1):
        phi = area.end
        assert phi is not None
        # the moment just before and just after an angle
        edges = cycle.mesh.edges
        edge = int(np.abs(edges - phi).argmin())
        if abs(edges[edge] - phi) > 1e-12 * edges[-1] or edge in (0, edges.size - 1):
            cell, t = cells.located(cycle.mesh, np.array([phi]))
            before = after = float(cells.value(cycle.series[0, cell], t)[0])
        else:
            before = float(cells.value(cycle.series[0, edge - 1 : edge], np.array([1.0]))[0])
            after = float(cells.value(cycle.series[0, edge : edge + 1], np.array([-1.0]))[0])
        size = float(np.abs(cycle.series[0]).sum(axis=-1).max())
        if abs(after - before) > 1e-6 * size:
            how = _("jumps from {before} to {after}", before=quantity(before, "N m", 5), after=quantity(after, "N m", 5))
        else:
            how = _("rises through zero") if area.work < 0 else _("falls through zero")
        rows.append((Formula(f"phi_{k}"), Quantity(f"phi_{k}", phi, "°"), Quantity("", phi, "rad"), how))
    if not rows:
        return Note(_("The reduced moment does not change its sign within the cycle."))
    error = context.sizing.error.angles
    caption = _("Crossings: angles where the reduced moment changes its sign")
    if error is not None:
        caption += "; " + _("found to {error}", error=quantity(error, "rad", 2))
    return Table(caption, ("", _("angle, °"), _("angle, rad"), _("the moment")), tuple(rows))


def _area_table(context: Context) -> list[Part]:
    """Areas and their accumulated sums, with enough digits for the shown sums to agree."""
    sizing = context.sizing
    areas_of_curve = sizing.areas
    digits = next((d for d in range(formulas.DIGITS, MOST_DIGITS) if _adds_up(sizing, d)), MOST_DIGITS)
    sums = [0.0, *(area.accumulated for area in areas_of_curve)]
    scale = max(map(abs, [*sums, *(area.work for area in areas_of_curve), 1e-300]))
    sums = [0.0 if abs(value) <= 1e-12 * scale else value for value in sums]
    greatest, least = _extreme_sums(sizing)
    rows: list[tuple[Cell, ...]] = []
    emphasis = set()
    for k, value in enumerate(sums):
        area = areas_of_curve[k - 1] if k else None
        mark = _("greatest") if f"S{k}" == greatest else _("least") if f"S{k}" == least else ""
        if mark:
            emphasis.add(k)
        row: list[Cell] = [f"A{k}" if k else ""]
        if context.scene.areas is None:
            ends = (None, None) if area is None else (area.start, area.end)
            row += ["" if end is None else Quantity("", end, "°") for end in ends]
        elif area is not None:
            row.append(Quantity("", context.scene.areas.values[k - 1]))
        else:
            row.append("")
        row.append("" if area is None else Quantity(f"A_{k}", area.work, "J", digits))
        rows.append((*row, f"S{k}", Quantity(f"S_{k}", value, "J"), mark))
    head = [_("area")]
    head += [_("from, °"), _("to, °")] if context.scene.areas is None else [_("measured")]
    head += [_("work, J"), _("sum"), _("accumulated, J"), ""]
    subset = rows if len(rows) <= _MOST_AREAS else [rows[k] for k in range(len(rows)) if k < _MOST_AREAS or k in emphasis]
    marked = frozenset(k for k, row in enumerate(subset) if row[-1])
    parts: list[Part] = []
    if context.scene.areas is not None:
        scaled = _("The work of an area is its measure times the scale of the diagram")
        parts.append(Step(scaled, "A_k = a_k*mu_A", definitions=("a_k",)))
    parts += [
        Step(
            _("The area between two crossings is the work of the moment there; accumulated, their sum up to its end"),
            "S_k = S_before + A_k",
            definitions=("S_k", "A_k"),
        ),
        Table(
            _("Areas and accumulated areas, the greatest and the least marked"), tuple(head), tuple(subset), emphasis=marked
        ),
    ]
    if len(subset) < len(rows):
        parts.append(Note(_("{n} further areas are not shown.", n=len(rows) - len(subset)), "left out"))
    return parts


def _adds_up(sizing: Sizing, digits: int) -> bool:
    """Tests whether the areas, shown with these digits, add up to the sums as shown."""
    total, scale = 0.0, max(abs(area.work) for area in sizing.areas)
    for area in sizing.areas[:-1]:
        total += Quantity("", area.work, "J", digits).value_written
        if abs(area.accumulated) <= 1e-12 * scale:  # rounding: shown as 0
            continue
        if Quantity("", total).written != Quantity("", area.accumulated).written:
            return False
    return True


# -- approximate flywheels --------------------------------------------------------------------------------------------


def approximate(context: Context) -> Section | None:
    """The flywheel by the accumulated areas."""
    sizing, wheel, eps = context.sizing, context.sizing.flywheel, context.eps
    if eps is None or wheel.approximate_total is None or wheel.approximate is None:
        return None
    square = context.ratio**2
    total, left = wheel.approximate_total * square, wheel.approximate * square
    parts: list[Part] = [
        Step(
            _(
                "With a constant inertia the energy stored between the two extremes is ½ J (ω_max² − ω_min²) = J ε ω²; so "
                "the total inertia on the crank is"
            ),
            f"J_total = DeltaW/(epsilon*{context.area_speed.symbol}**2)",
            (context.of("energy_fluctuation"), context.epsilon, context.area_speed),
            Quantity("J_total", total, "kg m²"),
        )
    ]
    if sizing.scene.areas is not None:
        parts.append(Note(_("A diagram of areas does not contain the machine's own inertia: this is the total required.")))
    elif sizing.reduced_inertia is not None:
        parts += _less_least(context, "J_total", total, "J_areas", left)
    parts += on_own_shaft(context, "J_areas" if sizing.scene.areas is None else "J_total", left, wheel.approximate)
    return Section(_("Approximate flywheel, by the accumulated areas"), tuple(parts))


def _less_least(context: Context, of: str, total: float, symbol: str, left: float) -> Iterator[Part]:
    """The flywheel's share of a total: less the least I*, or none."""
    assert context.sizing.reduced_inertia is not None
    least = context.of("reduced_inertia.min")
    whole, remainder = Quantity(of, total, "kg m²"), Quantity(symbol, left, "kg m²")
    if left > 0.0:
        title = _("Less the machine's own least reduced inertia, which is part of it, the flywheel is")
        yield Step(title, f"{symbol} = {of} - I_min", (whole, least), remainder)
    else:
        title = _("The machine's own least reduced inertia is at least as large: by this figure no flywheel is needed")
        yield Step(title, f"{symbol} = max({of} - I_min, 0)", (whole, least), remainder)


def on_own_shaft(context: Context, symbol: str, on_crank: float, own: float) -> Iterator[Part]:
    """A flywheel on a shaft of another speed, with the same energy."""
    if context.ratio != 1.0:
        yield Step(
            _("On the flywheel's own shaft {shaft}, with the same energy", shaft=context.scene.flywheel_on),
            f"{symbol}_f = {symbol}/i_f**2",
            (Quantity(symbol, on_crank, "kg m²"), context.at_flywheel),
            Quantity(f"{symbol}_f", own, "kg m²"),
        )


def inertia_extremes(context: Context) -> Iterator[Part]:
    """The least, mean and greatest I*, and a picture of the contribution of every body."""
    extremes = context.sizing.reduced_inertia
    if extremes is None:
        return
    names = {"min": _("least"), "mean": _("mean over the angle"), "max": _("greatest")}
    figures = {name: context.of(f"reduced_inertia.{key}") for key, name in names.items()}
    rows = tuple((name, Formula(one.symbol), one) for name, one in figures.items())
    caption = _("The reduced inertia over the cycle, without the flywheel: extremes where its slope is zero")
    yield Table(caption, (_("value"), _("symbol"), _("inertia")), rows)
    if extremes.max > 0.0:
        yield context.panel("inertia")


def inertia_torque(context: Context) -> Section | None:
    """The short way of English textbooks: the turning moment less the inertia torque at constant speed."""
    wheel, eps, cycle = context.sizing.flywheel, context.eps, context.constant
    if eps is None or cycle is None or wheel.inertia_torque is None or wheel.inertia_torque_flywheel is None:
        return None
    if wheel.needed is False and wheel.exact == 0.0 and wheel.inertia_torque == 0.0:
        return None
    extremes = turning_moment.combined(cycle, np.array([[1.0, -0.5 * context.area_speed.value**2]]))[0]
    high, low = (context.at(float(phi[0]), cycle) for phi in (extremes.angle_greatest, extremes.angle_least))
    square, omega = context.ratio**2, context.area_speed.symbol
    total, left = wheel.inertia_torque * square, wheel.inertia_torque_flywheel * square
    parts: list[Part] = [
        Step(
            _(
                "At a constant speed the bodies take the torque ½ ω² dI*/dφ from the moment and give it back; the work of "
                "what is left, with I* counted from zero, is"
            ),
            f"T(phi) = W(phi) - {omega}**2*I_star(phi)/2",
            definitions=("T",),
        )
    ]
    values = []
    for name, (phi, work_there, inertia_there), words in (("a", high, _("greatest")), ("b", low, _("least"))):
        work, inertia = Quantity(f"W_{name}", work_there, "J"), Quantity(f"I_{name}", inertia_there, "kg m²")
        value = Quantity(f"T_{name}", work_there - 0.5 * context.area_speed.value**2 * inertia_there, "J")
        where = _("Where it is {extreme}: the angle, the work up to it, the reduced inertia there", extreme=words)
        parts.append(_point_table(Quantity(f"phi_{name}", phi, "°"), work, inertia, where))
        parts.append(
            Step(
                _("Its {extreme} value", extreme=words),
                f"T_{name} = W_{name} - {omega}**2*I_{name}/2",
                (work, context.area_speed, inertia),
                value,
            )
        )
        values.append(value)
    parts.append(
        Step(
            _("The total inertia, the machine's own included"),
            f"J_torque = (T_a - T_b)/(epsilon*{omega}**2)",
            (*values, context.epsilon, context.area_speed),
            Quantity("J_torque", total, "kg m²"),
        )
    )
    parts += _less_least(context, "J_torque", total, "J_short", left)
    parts += on_own_shaft(context, "J_short", left, wheel.inertia_torque_flywheel)
    return Section(_("The short way of English textbooks, with the inertia torque"), tuple(parts))


def _point_table(angle: Quantity, work: Quantity, inertia: Quantity, title: str) -> Table:
    """W and I* at a computed angle."""
    return Table(title, (_("angle, °"), _("W, J"), _("I*, kg m²")), ((angle, work, inertia),))


# -- Wittenbauer ------------------------------------------------------------------------------------------------------


def exact(context: Context) -> Section | None:
    """Wittenbauer's construction with its tangents, and the exact flywheel."""
    sizing, eps, cycle, wheel = context.sizing, context.eps, context.cycle, context.sizing.flywheel
    if eps is None or cycle is None or wheel.exact is None:
        return None
    figures = wittenbauer.figures_of(cycle, sizing.speed, eps)
    extremes = figures.extremes
    fast, slow = context.at(float(extremes.angle_greatest[1])), context.at(float(extremes.angle_least[2]))
    own = figures.total - cycle.inertia_at_start
    on_crank = wheel.exact * context.ratio**2
    if context.otherwise:
        return None
    if on_crank > 0.0 and abs(own - on_crank) > 1e-6 * on_crank:
        return Section(
            _("Exact flywheel"), (_by_motion(context, on_crank), *on_own_shaft(context, "J", on_crank, wheel.exact))
        )
    high, low = sizing.speed * (1 + eps / 2), sizing.speed * (1 - eps / 2)
    omega_max, omega_min = Quantity("omega_max", high, "rad/s"), Quantity("omega_min", low, "rad/s")
    parts: list[Part] = []
    if sizing.cyclic is not None:
        parts.append(
            Note(
                _(
                    "Torques that depend on speed are those along the motion itself, which Newton's method gives "
                    "together with the flywheel. W is the work of the moment along it."
                )
            )
        )
    parts += [
        Step(
            _("At every angle the kinetic energy is that at the beginning and the work done since"),
            "(J + I_star(phi))*omega(phi)**2/2 = E_0 + W(phi)",
            definitions=("E_0",),
        ),
        Note(
            _(
                "Drawn with I* to the right and W upwards, the cycle is a closed curve (Wittenbauer's). Seen from the point "
                "P(−J, −E₀), the line to a point of the curve has the slope (E₀ + W)/(J + I*) = ½ ω²: the speed there. "
                "The two tangents from P have the slopes of the greatest and of the least speed. These are known, so they "
                "can be drawn first, and P is where they meet."
            )
        ),
        Step(_("Greatest speed allowed"), "omega_max = omega*(1 + epsilon/2)", (context.speed, context.epsilon), omega_max),
        Step(_("Least speed allowed"), "omega_min = omega*(1 - epsilon/2)", (context.speed, context.epsilon), omega_min),
    ]
    slopes, cuts = [], []
    for (phi, work_there, inertia_there), limit, name, far, words in (
        (fast, omega_max, "u", "M", _("upper tangent, which touches where W − tan ψ · I* is greatest")),
        (slow, omega_min, "l", "N", _("lower tangent, which touches where W − tan ψ · I* is least")),
    ):
        tangent = Quantity(f"t_{name}", 0.5 * limit.value**2, "J/(kg m²)")._replace(unit="")
        slopes.append(tangent)
        parts.append(
            Step(
                _("Slope of the {tangent} (J for each kg m²)", tangent=words),
                f"t_{name} = {limit.symbol}**2/2",
                (limit,),
                tangent,
            )
        )
        work, inertia = Quantity(f"W_{far}", work_there, "J"), Quantity(f"I_{far}", inertia_there, "kg m²")
        where = _("The point where it touches: the angle, the work up to it, the reduced inertia there")
        parts.append(_point_table(Quantity(f"phi_{far}", phi, "°"), work, inertia, where))
        cut = Quantity(f"h_{far}", work_there - tangent.value * inertia_there, "J")
        cuts.append(cut)
        parts.append(
            Step(
                _("Where it cuts the axis of energy, I* = 0: the height of {point}", point=far),
                f"h_{far} = W_{far} - t_{name}*I_{far}",
                (work, tangent, inertia),
                cut,
            )
        )
    distance = Quantity("MN", cuts[0].value - cuts[1].value, "J")
    parts.append(Step(_("The distance of the two cuts"), "MN = h_M - h_N", tuple(cuts), distance))
    words = _("P lies where the tangents meet, J to the left of the axis; their slopes differ by ε ω²")
    needed = on_crank > 0.0
    parts.append(
        Step(
            words if needed else words + _(": the machine's own inertia suffices, and no flywheel is needed"),
            "J = MN/(epsilon*omega**2)" if needed else "J = max(MN/(epsilon*omega**2), 0)",
            (distance, context.epsilon, context.speed),
            Quantity("J", on_crank, "kg m²"),
        )
    )
    if needed:
        parts.append(
            Step(
                _("Energy at the beginning of the cycle: P lies E₀ below the origin"),
                "E_0 = t_u*J - h_M",
                (slopes[0], Quantity("J", on_crank, "kg m²"), cuts[0]),
                Quantity("E_0", slopes[0].value * on_crank - cuts[0].value, "J"),
            )
        )
    parts += _angles_drawn(context)
    reduced = sizing.reduced_inertia
    if reduced is not None and reduced.max - reduced.min <= 1e-9 * reduced.max:
        words = _("I* is constant, {inertia} kg m²: the loop is an upright line.", inertia=number(reduced.max))
        parts.append(Note(words))
    else:
        parts.append(context.panel("wittenbauer"))
    parts += on_own_shaft(context, "J", on_crank, wheel.exact)
    return Section(_("Exact flywheel: Wittenbauer's construction"), tuple(parts))


def _by_motion(context: Context, on_crank: float) -> Step:
    return Step(
        _("The exact flywheel is the one with which the periodic motion has the required irregularity"),
        "(omega_max - omega_min)/omega = epsilon",
        (),
        Quantity("J", on_crank, "kg m²"),
        how=_("by Newton's method for flywheel, energy level and balance together"),
    )


def _angles_drawn(context: Context) -> Iterator[Part]:
    """The angles of the tangents where energy is drawn as 2 W/omega², in kg m² as I* is."""
    assert context.eps is not None
    yield Note(
        _(
            "For a drawing by hand use F = 2 W/ω², in kg m² like I* and to the same scale. The angles of the tangents "
            "are then"
        )
    )
    for name, sign, words in (("psi_max", "+", _("upper tangent")), ("psi_min", "-", _("lower tangent"))):
        share = context.eps / 2 if sign == "+" else -context.eps / 2
        angle = Quantity(name, math.atan((1 + share) ** 2), "°")
        yield Step(
            _("Angle of the {tangent}", tangent=words), f"{name} = atan((1 {sign} epsilon/2)**2)", (context.epsilon,), angle
        )


# -- speeds -----------------------------------------------------------------------------------------------------------


def speeds(context: Context) -> Section | None:
    """Greatest and least speed with the exact or the given flywheel, from the energy at their angles."""
    sizing, run, cycle = context.sizing, context.sizing.run, context.cycle
    if run is None or cycle is None:
        return None
    cycle = run.cycle or cycle
    mean = run.speed or sizing.speed
    start = Quantity("E_0", 0.5 * (run.inertia + cycle.inertia_at_start) * mean**2 + run.offset, "J")
    flywheel = Quantity("J" if sizing.scene.inertia is None or context.ratio == 1.0 else "J_c", run.inertia, "kg m²")
    parts: list[Part] = []
    if flywheel.symbol == "J_c":
        title = _("The given flywheel as one on the crank, with the same energy")
        wheel = Quantity("J", sizing.scene.inertia or 0.0, "kg m²")
        parts.append(Step(title, "J_c = J*i_f**2", (wheel, context.at_flywheel), flywheel))
    if sizing.scene.irregularity is None or context.otherwise or sizing.flywheel.needed is False:
        parts.append(
            Step(
                _(
                    "At every angle the kinetic energy is that at the start and the work done since; E₀ is such that the "
                    "mean of the greatest and the least speed is the one above"
                ),
                f"({flywheel.symbol} + I_star(phi))*omega(phi)**2/2 = E_0 + W(phi)",
                (),
                start,
                how=_("by Newton's method"),
            )
        )
    if sizing.flywheel.needed is False and sizing.scene.inertia is None:
        parts.append(Note(_("The machine runs without a flywheel: J = 0.")))
        flywheel = flywheel._replace(value=0.0)
    lines = []
    for name, angle, speed, title in (
        ("max", run.angle_speed_max, run.speed_max, _("The greatest speed")),
        ("min", run.angle_speed_min, run.speed_min, _("The least speed")),
    ):
        _angle, *values = context.at(angle, cycle)
        work, inertia = Quantity(f"W_{name}_omega", values[0], "J"), Quantity(f"I_{name}_omega", values[1], "kg m²")
        where = (
            _("Where the speed is greatest: the angle, the work up to it, the reduced inertia there")
            if name == "max"
            else _("Where the speed is least: the angle, the work up to it, the reduced inertia there")
        )
        parts.append(_point_table(Quantity(f"phi_{name}_omega", angle, "°"), work, inertia, where))
        result = Quantity(f"omega_{name}", speed, "rad/s")
        parts.append(
            Step(
                title,
                f"omega_{name} = sqrt(2*(E_0 + {work.symbol})/({flywheel.symbol} + {inertia.symbol}))",
                (start, work, flywheel, inertia),
                result,
                note=_("That is {speed}.", speed=quantity(speed, "rpm")),
            )
        )
        lines.append(result)
    parts.append(
        Step(
            _("The irregularity"),
            "epsilon_r = 2*(omega_max - omega_min)/(omega_max + omega_min)",
            tuple(lines),
            Quantity("epsilon_r", run.irregularity),
        )
    )
    confirmed = sizing.simulation
    if confirmed is not None and confirmed.period is not None and confirmed.speed_time_mean is not None:
        rows = ((_("period of a cycle"), Formula("tau"), Quantity("tau", confirmed.period, "s")),)
        parts.append(Table(_("Time of a cycle, the integral of dφ/ω"), (_("quantity"), _("symbol"), _("value")), rows))
        parts.append(
            Step(
                _("Mean speed over time"),
                "omega_time = Phi/tau",
                (context.turn, Quantity("tau", confirmed.period, "s")),
                Quantity("omega_time", confirmed.speed_time_mean, "rad/s"),
            )
        )
    parts.append(context.panel("speed"))
    return Section(_("Speeds over the cycle"), tuple(parts))


# -- torques that depend on speed -------------------------------------------------------------------------------------


def holding(context: Context) -> Section | None:
    """Section on the stability of a motion whose torques depend on speed: the multiplier of a cycle."""
    cyclic = context.sizing.cyclic
    if cyclic is None:
        return None
    multiplier = context.of("multiplier")
    parts: list[Part] = [
        Step(
            _("Fraction of a small change of energy left after a cycle, the cycle multiplier; E is the kinetic energy"),
            "lamda = exp(integral(derivative(M_star, E), phi, 0, Phi))",
            (),
            multiplier,
            how=_("along the periodic motion, after {n} steps of Newton's method", n=cyclic.steps),
        )
    ]
    if 0.0 < cyclic.multiplier < 1.0 - 1e-12 and cyclic.damping > 1e-9:
        cycles = settling_cycles(cyclic)
        if cycles > 0.0 and cyclic.multiplier < 0.99:
            parts.append(
                Step(
                    _("The regime is stable: cycles until a hundredth of a change is left"),
                    "k = log(0.01)/log(lamda)",
                    (multiplier,),
                    Quantity("k", cycles, "", 4),
                )
            )
        else:
            parts.append(
                Note(_("The regime is stable: after {n} cycles a hundredth of a change is left.", n=number(cycles, 3)))
            )
    elif cyclic.damping < -1e-12:
        parts.append(Note(_("The regime does not settle: a change grows from cycle to cycle."), "remark"))
    else:
        parts.append(Note(_("No torque corrects a change of speed: the regime does not settle by itself."), "remark"))
    return Section(_("Stability of the motion"), tuple(parts))
