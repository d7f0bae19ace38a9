"""The cycle of torques taken at a constant crank speed, and the speed at which it leaves no net work."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import figures, panels
from .figures import Cycle
from .machine import Frame, Machine
from .numbers import EPS, KIND, Real, finer
from .regimes import AHEAD, kinks, parts

_ROUNDS = 20


def constant_cycle(machine: Machine, speed: Any, unknown: Any) -> Cycle:
    """The cycle of torques at a constant speed, its balance solved; panels end where a mesh changes its direction."""
    base, switched = machine.breaks, np.zeros(0, dtype=KIND)
    for _ in range(_ROUNDS):
        mesh, _ = figures.resolved(machine, speed, np.unique(np.concatenate((base, switched))))
        frame = machine.frame(np.concatenate((mesh.phi, mesh.middle), axis=1), mesh.middle)
        omega = np.full(frame.here.value.shape, speed, dtype=KIND)
        moment, exchanged, sent = constant_moment(machine, frame, omega, unknown)
        if machine.balanced:
            for _ in range(60):
                net = panels.integrals(moment, mesh.half).sum()
                step = abs(unknown) * AHEAD + Real("1e-30") if unknown else Real("1e-9")
                ahead = panels.integrals(constant_moment(machine, frame, omega, unknown + step)[0], mesh.half).sum()
                before, unknown = unknown, unknown - net * step / (ahead - net)
                moment, exchanged, sent = constant_moment(machine, frame, omega, unknown)
                if abs(unknown - before) <= 2 * EPS * abs(unknown):
                    break
        angles = sorted(a for tau in sent for a in kinks(tau, mesh, base))
        turns = np.array([a for k, a in enumerate(angles) if k == 0 or a - angles[k - 1] > 1e-12], dtype=KIND)
        if turns.size == switched.size and np.abs(turns - switched).max(initial=0) < finer(17):
            break
        switched = turns
    sample = machine.sampled(frame, omega, omega[..., -1:])
    drive = sum(
        (panels.integrals((t.constant + unknown * t.share)[:, :-1], mesh.half).sum() for t in sample.terms if t.drive),
        Real(0),
    )
    trimmed = sample._replace(
        inertia={k: v[:, :-1] for k, v in sample.inertia.items()}, slope={k: v[:, :-1] for k, v in sample.slope.items()}
    )
    return figures.assembled(mesh, moment, trimmed, unknown, panels.integrals(exchanged, mesh.half).sum(), drive)


def constant_moment(machine: Machine, frame: Frame, omega: Any, unknown: Any) -> tuple[Any, Any, list[Any]]:
    """M* at constant speeds, the sum of all contributions' sizes, and what lossy meshes transmit; at the nodes."""
    sample = machine.sampled(frame, omega, omega[..., -1:])
    found = parts(machine, frame, omega, unknown)
    moment = np.sum([p.moment for p in found], axis=0)
    exchanged = np.sum([np.abs(t.constant + unknown * t.share) for t in sample.terms], axis=0)
    sent = []
    for p in found:
        if p.efficiency < 1:
            tau = p.slope * omega**2 / 2 - p.moment
            factor = np.where(tau[..., -1:] > 0, 1 / p.efficiency, p.efficiency) - 1
            moment, exchanged = moment - factor * tau, exchanged + np.abs(factor * tau)
            sent.append(tau[:, :-1])
    return moment[:, :-1], exchanged[:, :-1], sent


def constant_speed(machine: Machine, guess: Any) -> Any:
    """The speed near a guess at which a cycle at constant speed has no net work."""

    def net(speed: Any) -> Any:
        return constant_cycle(machine, speed, Real(0)).work.edges[-1]

    a, b = guess, guess * (1 + Real("1e-6"))
    fa, fb = net(a), net(b)
    for _ in range(30):
        if fa == fb:
            break
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        if abs(b - a) <= 2 * EPS * abs(b):
            break
        fb = net(b)
    return b
