"""Limits of work: of a call, against a fixed piece of work in the same run, and of the default run, by samples of cases."""

import gc
import math
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
import pytest


@cache
def piece() -> float:
    """Seconds of computing for the piece of work: calls, floats and short arrays, about 0.01 on an ordinary machine."""
    times, x = [], np.linspace(0.0, 1.0, 20)
    for _ in range(5):
        start = time.process_time()
        for k in range(2000):
            (np.sin(x) * x).sum() + math.exp(math.sin(k)) + len(str(k))
        times.append(time.process_time() - start)
    return sorted(times)[2]


@contextmanager
def at_most(pieces: float) -> Iterator[None]:
    """Limits the work inside to so many pieces, whether it raises or not; ten times its need is a fair bound.

    Without the collector of garbage: what other tests have left takes it longer than the call.
    """
    each, collects = piece(), gc.isenabled()
    gc.disable()
    start = time.process_time()
    try:
        yield
    finally:
        took = (time.process_time() - start) / each
        if collects:
            gc.enable()
        assert took < pieces, f"as much work as {took:.0f} pieces, {pieces:g} allowed"


def sample(cases: Iterable[Any], every: int) -> list[Any]:
    """The cases of a parametrization: the first and every so many more for the default run, the others slow."""
    return [case if k % every == 0 else _slow(case) for k, case in enumerate(cases)]


def _slow(case: Any) -> Any:
    values, name = (case.values, case.id) if hasattr(case, "marks") else (case if isinstance(case, tuple) else (case,), None)
    return pytest.param(*values, marks=[*getattr(case, "marks", ()), pytest.mark.slow], id=name)
