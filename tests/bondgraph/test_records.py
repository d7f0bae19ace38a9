"""Records are what `typing.NamedTuple` makes of the same declaration."""

from __future__ import annotations

import copy
import pickle
import typing

import pytest

from bondgraph.records import NamedTuple


class Ours(NamedTuple):
    """A record."""

    x: float
    name: str = "a"
    rest: tuple[int, ...] = ()

    @property
    def twice(self) -> float:
        """2 x."""
        return 2.0 * self.x


class Theirs(typing.NamedTuple):
    """A record."""

    x: float
    name: str = "a"
    rest: tuple[int, ...] = ()

    @property
    def twice(self) -> float:
        """2 x."""
        return 2.0 * self.x


def test_a_record_is_a_tuple_with_names() -> None:
    ours, theirs = Ours(1.0, rest=(2,)), Theirs(1.0, rest=(2,))
    assert ours == theirs
    assert hash(ours) == hash(theirs)
    assert repr(ours) == repr(theirs).replace("Theirs", "Ours")
    assert ours._asdict() == theirs._asdict()
    assert ours.twice == 2.0
    assert ours._replace(x=3.0) == theirs._replace(x=3.0)
    assert Ours._make([1.0, "b", ()]) == Theirs._make([1.0, "b", ()])
    for name in ("_fields", "_field_defaults", "__match_args__", "__doc__", "__module__"):
        assert getattr(Ours, name) == getattr(Theirs, name)
    for again in (pickle.loads(pickle.dumps(ours)), copy.copy(ours), copy.deepcopy(ours)):
        assert type(again) is Ours
        assert again == ours


def test_a_record_refuses_what_it_has_no_field_for() -> None:
    with pytest.raises(TypeError):
        Ours()  # type: ignore[call-arg]
    with pytest.raises(TypeError):
        Ours(1.0, "a", (), 4)  # type: ignore[call-arg]
    with pytest.raises(TypeError):
        Ours(1.0, other=2)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="other"):
        Ours(1.0)._replace(other=2)  # type: ignore[call-arg]
    with pytest.raises(AttributeError):
        Ours(1.0).x = 2.0  # type: ignore[misc]
    with pytest.raises(TypeError, match="default"):
        type(NamedTuple)("Wrong", (), {"__annotations__": {"x": "int", "y": "int"}, "x": 1})
