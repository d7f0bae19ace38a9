"""Many mutants, tried in processes of their own, so that one that dies or hangs takes nothing with it."""

import multiprocessing
import time
from collections.abc import Iterator
from typing import NamedTuple

from tests.fuzzing.guards import limit_memory
from tests.fuzzing.judge import Verdict, judged
from tests.fuzzing.mutants import Mutant, mutant
from tests.fuzzing.regressions import FILES, SCENES

_AT_ONCE = 500  # mutants that one process is given
_MOST_WORK = 900.0  # seconds without a word after which a process is taken for hung
_COMMANDS = (
    "size",
    "size --json --no-simulate",
    "reduce --points 7",
    "graph",
    "reactions",
    "size --rtol 1e-6 --no-simulate",
)


class Tried(NamedTuple):
    """A mutant's seed, kind and base, the way it was tried, and its verdict."""

    seed: int
    kind: str
    base: str
    way: str
    verdict: Verdict


def way_of(seed: int) -> str:
    """How a mutant is tried: one in 15 in time, one in 15 by a command, all others by load, size and reduce."""
    return "time" if seed % 15 == 7 else _COMMANDS[seed // 15 % len(_COMMANDS)] if seed % 15 == 11 else "library"


def tried(seed: int) -> Tried:
    """One mutant, tried."""
    found = mutant(seed)
    way = way_of(seed)
    verdict = judged(found, simulate=way == "time", command="" if way in ("time", "library") else way)
    return Tried(seed, found.kind, found.base, way, verdict)


def again(name: str) -> Verdict:
    """A scene that once failed, tried by the library."""
    files = {file: content for file, content in FILES.items() if file in SCENES[name]}
    return judged(Mutant(0, "kept", name, SCENES[name].encode(), files))


def _worker(seeds: list[int], results: "multiprocessing.Queue[Tried | int]") -> None:
    limit_memory(6000)
    for seed in seeds:
        results.put(seed)
        results.put(tried(seed))


def all_tried(seeds: list[int], jobs: int) -> Iterator[Tried]:
    """Every mutant tried, by so many processes; one that dies or hangs is a failure of the mutant it was at."""
    context = multiprocessing.get_context("spawn")
    waiting = [seeds[i : i + _AT_ONCE] for i in range(0, len(seeds), _AT_ONCE)][::-1]
    running: list[_Process] = []
    while waiting or running:
        while waiting and len(running) < jobs:
            running.append(_Process(context, waiting.pop()))
        for process in list(running):
            yield from process.said()
            if process.over:
                running.remove(process)
                if process.at is not None:
                    yield process.failure()
                elif process.left:
                    raise RuntimeError(f"a process ended with {process.process.exitcode} before its first mutant")
                if process.left:
                    waiting.append(process.left)
        time.sleep(0.02)


class _Process:
    """A process, the mutants it has still to try, and the one it is at."""

    def __init__(self, context: multiprocessing.context.SpawnContext, seeds: list[int]) -> None:
        self.results = context.Queue()
        self.process = context.Process(target=_worker, args=(seeds, self.results), daemon=True)
        self.process.start()
        self.left, self.at, self.heard = list(seeds), None, time.monotonic()

    def said(self) -> Iterator[Tried]:
        alive = self.process.is_alive()
        while not self.results.empty():
            found = self.results.get()
            self.heard = time.monotonic()
            if isinstance(found, int):
                self.at = found
                self.left.remove(found)
            else:
                self.at = None
                yield found
        if alive and time.monotonic() - self.heard > _MOST_WORK:
            self.process.kill()
            self.process.join()

    @property
    def over(self) -> bool:
        return not self.process.is_alive() and self.results.empty()

    def failure(self) -> Tried:
        assert self.at is not None
        found = mutant(self.at)
        detail = f"the process ended with {self.process.exitcode}, or hung"
        return Tried(self.at, found.kind, found.base, way_of(self.at), Verdict("failed", detail, 0.0, 0.0))
