"""What errors are measured against: the figure by two routes that share nothing but I*, M* and the laws.

Loads of position alone: the closed form on Chebyshev cells, verified by Gauss' rule in extended precision, which is then the
reference. Torques that depend on speed: the periodic motion by collocation, verified by stepping it in time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flywheel.by_motion import with_flywheel
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.piecewise import ROUNDING
from flywheel.results import Sizing
from flywheel.sizing import size
from flywheel.steady import NoMotionError
from flywheel.tradeoffs import extended
from flywheel.tradeoffs.question import Question, answer, question

_TIGHTEST = 1e-14
_IN_TIME = 1e-12
_SHARE = 0.01  # of a flywheel, by which it is changed to see what that does
_EVEN = 1e-13  # an irregularity that is none
_LEAST = 16 * ROUNDING  # doubt of two routes that happen to agree


class Reference(NamedTuple):
    """A figure (kg m² or 1), how far it may be off (relative), and how it was found and verified."""

    value: float
    doubt: float
    route: str
    verified: str
    messages: tuple[str, ...] = ()


_ALONE = "the closed form on Chebyshev cells", "by its own estimate alone: the other route has no finite value"


def verified(machine: Machine) -> tuple[Question, Reference]:
    """The question of a machine's scene and its true answer.

    Raises:
        SceneError: if the machine cannot run as its scene says.

    """
    tight = size(machine, _TIGHTEST, accuracy="normal")
    asked = question(machine, tight)
    if not asked.sized and answer(tight) <= _EVEN:
        found = "a motion that nothing but rounding varies"
        raise SceneError([Fault("flywheel.inertia", found, "an irregularity to compare methods by", "use flywheel size")])
    reference = _in_time(asked, tight) if machine.sets_its_speed else _extended(asked, tight)
    told = tuple(message for message in tight.messages if not message.startswith("rtol"))
    return asked, reference._replace(messages=told)


def _promised(asked: Question, tight: Sizing) -> float:
    """The error that the sizing at the tightest tolerance states of itself."""
    return max((tight.error.exact if asked.sized else tight.error.simulation) or 0.0, _LEAST)


def _extended(asked: Question, tight: Sizing) -> Reference:
    scene, found = asked.machine.scene, answer(tight)
    if asked.sized:
        value, doubt = (part / asked.crank for part in extended.flywheel_inertia(asked.machine))
        if value + doubt < 0.0:  # the machine's own inertia suffices for certain
            doubt = 0.0
        value = max(value, 0.0)
    else:
        value, doubt = extended.irregularity(asked.machine, (scene.inertia or 0.0) * asked.crank)
    promised = _promised(asked, tight)
    if not np.isfinite([value, doubt]).all():
        return Reference(found, promised, *_ALONE)
    apart = asked.error(found, value)
    own = max(asked.error(value + doubt, value), ROUNDING)
    route = "Gauss' rule on halved panels, in extended precision"
    told = f"the closed form on Chebyshev cells is {apart:.1e} apart, within its estimate of {promised:.1e}"
    if apart > promised + own:  # one of the two is wrong: what is not known is not claimed
        own, told = apart, f"the closed form on Chebyshev cells is {apart:.1e} apart: more than both estimates allow"
    return Reference(value, own, route, told)


def _in_time(asked: Question, tight: Sizing) -> Reference:
    value, promised = answer(tight), _promised(asked, tight)
    stepped = size(asked.machine, _IN_TIME, accuracy="audit")
    route = "periodic collocation at the tightest tolerance"
    if stepped.simulation is None or stepped.run is None or stepped.simulation.route != "time":
        return Reference(value, promised, route, "by its own estimate alone: the motion cannot be stepped in time")
    expected = stepped.run.irregularity
    apart = abs(stepped.simulation.irregularity / expected - 1.0) if expected else 0.0
    told = f"stepped in time, one cycle has an irregularity {apart:.1e} apart"
    damping = 1.0 if stepped.cyclic is None else min(abs(stepped.cyclic.damping), 1.0)
    slope = _slope(stepped, value * asked.crank) if asked.sized and value else 1.0
    # one cycle begun where collocation says cannot see that its level is off: where little holds it, that weighs more
    shift = (apart + abs(stepped.simulation.closure or 0.0) + _LEAST) / max(damping * slope, 1e-300)
    return Reference(value, max(min(shift, promised), asked.error(answer(stepped), value), _LEAST), route, told)


def _slope(sizing: Sizing, inertia: float) -> float:
    """By how much the irregularity changes with the flywheel (kg m² on the crank), both relative."""
    lighter, heavier = ((1.0 - _SHARE) * inertia, (1.0 + _SHARE) * inertia)
    try:
        ends = [with_flywheel(sizing, part).run.irregularity for part in (lighter, heavier)]
    except NoMotionError:
        return 0.0
    return abs(ends[1] / ends[0] - 1.0) / (2.0 * _SHARE) if ends[0] else 0.0
