"""How much work a call is, against a fixed piece of work in the same run: a slow machine is slow at both."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np


@cache
def pace() -> float:
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
    """What is inside is no more work than so many pieces, whether it raises or not; ten times its need is a fair bound."""
    start = time.process_time()
    try:
        yield
    finally:
        took = (time.process_time() - start) / pace()
        assert took < pieces, f"as much work as {took:.0f} pieces, {pieces:g} allowed"
