"""The steps of the wheel of metal: masses and inertias part by part, rim speed, stresses; and the wheel on every shaft."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from flywheel.components.wheel_stresses import DISC, ring_constant, ring_factors
from flywheel.components.wheels import Wheel
from flywheel.language import text as _
from flywheel.numerics.cells import TIE
from flywheel.report.document import Cell, Context, Formula, Note, Part, Section, Step, Table, quantity
from flywheel.report.formulas import Quantity
from flywheel.tables.summary import material_name, stress_place


def wheel(context: Context) -> Section | None:
    """The wheel as built: its dimensions, and from them its mass, inertia and stresses."""
    built = context.sizing.built
    if built is None:
        return None
    own = built.wheel
    parts: list[Part] = [_material(own), _dimensions(own), *_parts(own), *_inertia(context, own)]
    parts += _stresses(context, own, built.torque)
    if built.irregularity is not None:
        parts.append(
            Step(
                _("Irregularity of the machine with the wheel as built"),
                "(omega_max - omega_min)/omega = epsilon_b",
                (),
                Quantity("epsilon_b", built.irregularity),
                how=_("by the same steps as above, with the wheel's inertia"),
            )
        )
    parts += [Note(warning, "remark") for warning in own.warnings]
    return Section(_("The wheel"), tuple(parts))


def _head() -> tuple[str, str, str]:
    return _("quantity"), _("symbol"), _("value")


def _material(own: Wheel) -> Table:
    material = own.material
    rows: list[tuple[Cell, ...]] = [(_("density"), Formula("rho"), Quantity("rho", material.density, "kg/m³"))]
    rows.append((_("Poisson's ratio"), Formula("nu"), Quantity("nu", material.poisson)))
    if material.strength is not None:
        rows.append((_("strength"), Formula("R_m"), Quantity("R_m", material.strength, "MPa")))
    if material.allowable is not None:
        rows.append((_("allowable stress"), Formula("sigma_a"), Quantity("sigma_a", material.allowable, "MPa")))
    return Table(_("Material: {name}", name=material_name(material.name)), _head(), tuple(rows))


def _dimensions(own: Wheel) -> Table:
    """Table of the dimensions used below, in metres."""
    body = own.body
    rows: list[tuple[Cell, ...]] = [(_("outer radius"), Formula("R"), Quantity("R", body.outer, "m"))]
    if body.shape != DISC or body.inner > 0.0:
        rows.append((_("inner radius"), Formula("r"), Quantity("r", body.inner, "m")))
    if body.shape != DISC:
        rows.append((_("mean radius"), Formula("R_0"), Quantity("R_0", body.mean, "m")))
        rows.append((_("radial thickness of the rim"), Formula("h"), Quantity("h", body.thickness, "m")))
    rows.append((_("width along the axis"), Formula("b"), Quantity("b", body.width, "m")))
    if body.arms is not None and body.hub is not None:
        rows += [
            (_("number of arms"), Formula("z"), Quantity("z", float(body.arms.number))),
            (_("width of an arm, in the plane of rotation"), Formula("a_1"), Quantity("a_1", body.arms.width, "m")),
            (_("thickness of an arm, across"), Formula("a_2"), Quantity("a_2", body.arms.thickness, "m")),
            (_("radius of the hub"), Formula("r_h"), Quantity("r_h", body.hub.diameter / 2, "m")),
            (_("radius of the bore"), Formula("r_b"), Quantity("r_b", body.hub.bore / 2, "m")),
            (_("length of the hub"), Formula("l_h"), Quantity("l_h", body.hub.length, "m")),
        ]
    shapes = {"disc": _("disc"), "rim": _("rim"), "arms": _("rim on arms")}
    return Table(_("Dimensions of the wheel, a {shape}", shape=shapes[body.shape]), _head(), tuple(rows))


def _parts(chosen: Wheel) -> Iterator[Part]:
    """Mass and inertia of rim or disc, arms and hub."""
    body, density = chosen.body, Quantity("rho", chosen.material.density, "kg/m³")
    outer, inner = Quantity("R", body.outer, "m"), Quantity("r", body.inner, "m")
    mean, width, thick = Quantity("R_0", body.mean, "m"), Quantity("b", body.width, "m"), Quantity("h", body.thickness, "m")
    named = {part.name: part for part in chosen.parts}
    main = named.get("disc") or named["rim"]
    mass, own = Quantity("m", main.mass or 0.0, "kg"), Quantity("I_1", main.inertia, "kg m²")
    if body.shape == DISC and body.inner <= 0.0:
        yield Step(_("Mass of the disc"), "m = pi*rho*b*R**2", (density, width, outer), mass)
        yield Step(_("Its inertia"), "I_1 = m*R**2/2", (mass, outer), own)
    elif body.shape == DISC:
        yield Step(_("Mass of the disc"), "m = pi*rho*b*(R**2 - r**2)", (density, width, outer, inner), mass)
        yield Step(_("Its inertia"), "I_1 = m*(R**2 + r**2)/2", (mass, outer, inner), own)
    else:
        yield Step(_("Mass of the rim"), "m = 2*pi*rho*R_0*h*b", (density, mean, thick, width), mass)
        if body.thin:
            yield Step(_("Its inertia, all of it at the mean radius"), "I_1 = m*R_0**2", (mass, mean), own)
        else:
            yield Step(_("Its inertia"), "I_1 = m*(R**2 + r**2)/2", (mass, outer, inner), own)
    if body.arms is not None and body.hub is not None:
        yield from _arms_and_hub(chosen, density, inner)


def _arms_and_hub(chosen: Wheel, density: Quantity, inner: Quantity) -> Iterator[Part]:
    body = chosen.body
    assert body.arms is not None
    assert body.hub is not None
    named = {part.name: part for part in chosen.parts}
    number, across = Quantity("z", float(body.arms.number)), Quantity("a_1", body.arms.width, "m")
    thick, hub = Quantity("a_2", body.arms.thickness, "m"), Quantity("r_h", body.hub.diameter / 2, "m")
    bore, length = Quantity("r_b", body.hub.bore / 2, "m"), Quantity("l_h", body.hub.length, "m")
    section = Quantity("S_1", body.arms.area, "m²")
    mass, own = Quantity("m_arms", named["arms"].mass or 0.0, "kg"), Quantity("I_2", named["arms"].inertia, "kg m²")
    around, of_hub = Quantity("m_hub", named["hub"].mass or 0.0, "kg"), Quantity("I_3", named["hub"].inertia, "kg m²")
    yield Step(_("Section of an arm, an ellipse"), "S_1 = pi*a_1*a_2/4", (across, thick), section)
    title = _("Mass of the arms, from the hub to the rim")
    yield Step(title, "m_arms = z*rho*S_1*(r - r_h)", (number, density, section, inner, hub), mass)
    yield Step(
        _("Their inertia"),
        "I_2 = z*rho*S_1*(r**3 - r_h**3)/3 + m_arms*a_1**2/16",
        (number, density, section, inner, hub, mass, across),
        own,
    )
    yield Step(_("Mass of the hub"), "m_hub = pi*rho*l_h*(r_h**2 - r_b**2)", (density, length, hub, bore), around)
    yield Step(_("Its inertia"), "I_3 = m_hub*(r_h**2 + r_b**2)/2", (around, hub, bore), of_hub)


def _inertia(context: Context, own: Wheel) -> Iterator[Part]:
    """The wheel's inertia compared with the required one."""
    body = own.body
    whole = Quantity("I_w", own.inertia, "kg m²")
    first = Quantity("I_1", own.parts[0].inertia, "kg m²")
    if body.share < 1.0:
        share = Quantity("c_r", body.share)
        title = _("The rim has a share of the inertia of the whole wheel; hub and arms have the rest")
        yield Table(title, _head(), ((_("share of the rim"), Formula("c_r"), share),))
        yield Step(_("Inertia of the wheel"), "I_w = I_1/c_r", (first, share), whole)
    elif len(own.parts) > 1:
        numbers = tuple(Quantity(f"I_{k}", part.inertia, "kg m²") for k, part in enumerate(own.parts, 1))
        yield Step(_("Inertia of the wheel"), "I_w = " + " + ".join(n.symbol for n in numbers), numbers, whole)
    else:
        yield Step(_("Inertia of the wheel"), "I_w = I_1", (first,), whole)
    inertia = context.sizing.inertia
    if inertia:
        value = quantity(inertia, "kg m²")
        if own.inertia > inertia * (1 + TIE):
            yield Note(_("Its inertia is {asked}, rounded up to the next size.", asked=value))
        else:
            yield Note(_("It was made for {asked}.", asked=value))
    yield Step(_("The same in handbooks' terms, GD²"), "G_D = 4*I_w", (whole,), Quantity("G_D", 4 * own.inertia, "kg m²"))


def _stresses(context: Context, own: Wheel, torque: float | None) -> Iterator[Part]:
    """Rim speed, and the stresses by place."""
    body, allowable = own.body, own.material.allowable
    speed, density = Quantity("omega_w", own.speed, "rad/s"), Quantity("rho", own.material.density, "kg/m³")
    at_mean = abs(own.speed - context.sizing.speed * context.ratio) <= 1e-9 * own.speed
    title = _("Speed of the wheel's shaft, the mean one") if at_mean else _("Speed of the wheel's shaft, the greatest")
    yield Table(title, _head(), ((title, Formula("omega_w"), speed),))
    name, running = ("R_0", body.mean) if body.thin else ("R", body.outer)
    rim = Quantity("v", own.rim_speed, "m/s")
    yield Step(_("Speed of the rim"), f"v = omega_w*{name}", (speed, Quantity(name, running, "m")), rim)
    greatest = Quantity("sigma", own.greatest_stress, "MPa")
    outer, inner, poisson = (
        Quantity("R", body.outer, "m"),
        Quantity("r", body.inner, "m"),
        Quantity("nu", own.material.poisson),
    )
    if body.arms is not None:
        yield from _on_arms(own, torque, speed, density)
        greatest = Quantity("sigma", own.greatest_stress, "MPa")
        yield Table(
            _("The greatest of them, {place}", place=stress_place(own.place)),
            _head(),
            ((_("stress"), Formula("sigma"), greatest),),
        )
    elif body.thin:
        yield Step(_("Hoop stress of the thin rim"), "sigma = rho*v**2", (density, rim), greatest)
    elif body.inner <= 0.0:
        numbers = (poisson, density, speed, outer)
        yield Step(_("Greatest stress, in the centre"), "sigma = (3 + nu)/8*rho*(omega_w*R)**2", numbers, greatest)
    else:
        yield Step(
            _("Greatest stress, {place}", place=stress_place(own.place)),
            "sigma = rho*omega_w**2/4*((3 + nu)*R**2 + (1 - nu)*r**2)",
            (density, speed, poisson, outer, inner),
            greatest,
        )
    reference = own.material.reference
    if own.safety is not None and reference is not None:
        symbol = "R_m" if own.material.strength is not None else "sigma_a"
        yield Step(
            _("Safety factor"),
            f"S = {symbol}/sigma",
            (Quantity(symbol, reference, "MPa"), greatest),
            Quantity("S", own.safety),
        )
    if allowable is not None and own.greatest_stress > allowable * (1 + TIE):
        yield Note(_("The stress is above the allowable one."), "remark")


def _on_arms(own: Wheel, torque: float | None, speed: Quantity, density: Quantity) -> Iterator[Part]:
    """Stresses of a rim on arms (Timoshenko): the arms restrain the rim as it expands."""
    body = own.body
    arms, hub = body.arms, body.hub
    assert arms is not None
    assert hub is not None
    mean, thick, width = Quantity("R_0", body.mean, "m"), Quantity("h", body.thickness, "m"), Quantity("b", body.width, "m")
    section, number = Quantity("S_1", arms.area, "m²"), Quantity("z", float(arms.number))
    first, second = ring_factors(arms.number)
    f1, f2 = Quantity("f_1", first), Quantity("f_2", second)
    velocity = Quantity("v_0", own.speed * body.mean, "m/s")
    alpha = Quantity("alpha", pi / arms.number, "rad")
    ratio = Quantity("q_A", body.section / arms.area)
    constant = Quantity("C", ring_constant(arms.number, body.mean, body.thickness, body.section / arms.area))
    yield Step(_("Half the angle between two arms"), "alpha = pi/z", (number,), alpha)
    title = _("Factors of a ring on arms")
    yield Step(title, "f_1 = (sin(2*alpha)/4 + alpha/2)/(2*sin(alpha)**2)", (alpha,), f1)
    yield Step(title, "f_2 = f_1 - 1/(2*alpha)", (f1, alpha), f2)
    yield Step(_("Section of the rim over that of an arm"), "q_A = h*b/S_1", (thick, width, section), ratio)
    yield Step(
        _("Pull of the arms on the rim"), "C = 12*f_2*R_0**2/h**2 + f_1 + q_A", (f2, mean, thick, f1, ratio), constant
    )
    yield Step(_("Speed of the rim's mean radius"), "v_0 = omega_w*R_0", (speed, mean), velocity)
    stress = own.stresses
    common = (density, velocity, constant, alpha, mean, thick)
    yield Step(
        _("Stress in the rim at the arms"),
        "sigma_1 = rho*v_0**2*(1 - cos(alpha)/(3*C*sin(alpha)) + 2*R_0/(C*h)*abs(1/alpha - cos(alpha)/sin(alpha)))",
        common,
        Quantity("sigma_1", stress["rim at the arms"], "MPa"),
    )
    yield Step(
        _("Stress in the rim between the arms"),
        "sigma_2 = rho*v_0**2*(1 - 1/(3*C*sin(alpha)) + 2*R_0/(C*h)*abs(1/alpha - 1/sin(alpha)))",
        common,
        Quantity("sigma_2", stress["rim between the arms"], "MPa"),
    )
    at_rim = Quantity("sigma_3", stress["arms at the rim"], "MPa")
    numbers = (density, velocity, ratio, constant)
    yield Step(_("Stress in the arms at the rim, by its pull"), "sigma_3 = 2/3*rho*v_0**2*q_A/C", numbers, at_rim)
    inner, root = Quantity("r", body.inner, "m"), Quantity("r_h", hub.diameter / 2, "m")
    bent = torque is not None and torque > 0.0
    more: tuple[Quantity, ...]
    formula, more = "sigma_4 = sigma_3 + rho*omega_w**2*(r**2 - r_h**2)/2", (at_rim, density, speed, inner, root)
    if bent:
        moment, modulus = Quantity("T_w", torque or 0.0, "N m"), Quantity("Z", arms.modulus, "m³")
        yield Table(
            _("Torque between hub and rim that bends the arms: given, or the inertia times the greatest acceleration"),
            _head(),
            ((_("torque"), Formula("T_w"), moment),),
        )
        across, thickness = Quantity("a_1", arms.width, "m"), Quantity("a_2", arms.thickness, "m")
        yield Step(_("Section modulus of an arm"), "Z = pi*a_1**2*a_2/32", (across, thickness), modulus)
        formula, more = f"{formula} + T_w*(R_0 - r_h)/(R_0*z*Z)", (*more, moment, mean, number, modulus)
    title = (
        _("Stress in the arms at the hub: that pull, their own, and bending") if bent else _("Stress in the arms at the hub")
    )
    yield Step(title, formula, more, Quantity("sigma_4", stress["arms at the hub"], "MPa"))


def every_shaft(context: Context) -> Section | None:
    """The same flywheel on every shaft, if there are several."""
    sizing = context.sizing
    if len(sizing.shafts) < 2 or sizing.flywheel.needed is False:
        return None
    rows = tuple(
        (row.shaft, Quantity("", row.speed, "rpm"), Quantity("", row.inertia, "kg m²"), Quantity("", row.gd2, "kg m²"))
        for row in sizing.shafts
    )
    parts: list[Part] = [
        Table(
            _("The flywheel that stores the same energy, on every shaft: J by the square of the ratio of speeds"),
            (_("shaft"), _("speed, rpm"), _("inertia, kg m²"), _("GD², kg m²")),
            rows,
        )
    ]
    if sizing.built is not None:
        parts.append(Note(_("Inertias are those of the wheel as built.")))
    return Section(_("The same flywheel on every shaft"), tuple(parts))
