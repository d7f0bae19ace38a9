"""One mutant for every whole number."""

import random
import tomllib
from collections.abc import Callable
from typing import Any, NamedTuple

from tests.fuzzing import tables
from tests.fuzzing.corpus import corpus, with_tables
from tests.fuzzing.expressions import expressions
from tests.fuzzing.structure import nesting, numbers, quantities, structure
from tests.fuzzing.texts import BYTES
from tests.fuzzing.toml_writer import written


class Mutant(NamedTuple):
    """A scene that somebody spoilt: its bytes, the files beside it, and where it came from."""

    seed: int
    kind: str
    base: str
    content: bytes
    files: dict[str, bytes]


_TREES: dict[str, Callable[[random.Random, dict[str, Any]], None]] = {
    "structure": structure,
    "nesting": nesting,
    "quantities": quantities,
    "numbers": numbers,
    "expressions": expressions,
    "names of files": tables.names,
}
KINDS = (*_TREES, "bytes", "tables", "pairs")
_WEIGHTS = (16, 3, 9, 20, 20, 5, 12, 5, 10)


def mutant(seed: int) -> Mutant:
    """The mutant of a seed: the same one as long as the scenes it is made from are."""
    rng = random.Random(seed)
    kind = rng.choices(KINDS, _WEIGHTS)[0]
    of_files = kind == "tables" or (kind == "names of files" and rng.random() < 0.7)
    base = rng.choice(with_tables() if of_files else corpus())
    steps = [kind] if kind != "pairs" else rng.choices((*_TREES, "bytes"), k=2)
    found = Mutant(seed, kind, base.name, base.text.encode(), dict(base.files))
    for step in sorted(steps, key=lambda step: step == "bytes"):
        found = _mutated(rng, found, step)
    return found


def _mutated(rng: random.Random, found: Mutant, step: str) -> Mutant:
    """One more change."""
    if step == "bytes":
        return found._replace(content=rng.choice(BYTES)(rng, found.content))
    if step == "tables":
        name = rng.choice(sorted(found.files))
        change = tables.content if rng.random() < 0.7 else rng.choice(BYTES)
        return found._replace(files=found.files | {name: change(rng, found.files[name])})
    try:
        tree = tomllib.loads(found.content.decode())
    except (ValueError, RecursionError):  # the first of a pair has left nothing to be changed
        return found
    _TREES[step](rng, tree)
    return found._replace(content=written(tree).encode("utf-8", "surrogatepass"))
