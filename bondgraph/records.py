"""Records: tuples with named fields, declared and used as those of `typing.NamedTuple`, made in a sixth of its time.

A command imports a hundred and fifty of them and makes instances of a few: typing checks and compiles the annotation of
every field, and a constructor for every class. Here annotations stay text, and the constructor is compiled with the first
instance. To type checkers it is `typing.NamedTuple`.

>>> class Point(NamedTuple):
...     x: float
...     y: float = 0.0
>>> point = Point(1.0)
>>> point, point._replace(y=2.0)._asdict(), point == (1.0, 0.0)
(Point(x=1.0, y=0.0), {'x': 1.0, 'y': 2.0}, True)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typing import NamedTuple as NamedTuple
else:
    from collections import _tuplegetter as field_getter  # what the standard library's own records use

    class _Class(type):
        """The class of records that are being declared."""

        def __new__(meta, name: str, bases: tuple[type, ...], space: dict[str, Any]) -> type:
            fields = tuple(space.get("__annotations__", ()))
            defaults = {field: space[field] for field in fields if field in space}
            if fields[len(fields) - len(defaults) :] != tuple(defaults):
                raise TypeError(f"a field of {name} without a default follows one with a default")
            made = {field: field_getter(k, "") for k, field in enumerate(fields)}
            made |= {"_fields": fields, "_field_defaults": defaults, "__match_args__": fields, "__slots__": ()}
            made |= {key: value for key, value in space.items() if key not in defaults}
            made.setdefault("__doc__", f"{name}({', '.join(fields)})")
            record = type(name, (_Record,), made)
            record.__new__ = _first_constructor(record)
            return record

    def _first_constructor(record: type) -> Any:
        def __new__(cls: type, *values: Any, **named: Any) -> Any:
            record.__new__ = constructor = _constructor(record)
            return constructor(cls, *values, **named)

        return __new__

    def _constructor(record: type) -> Any:
        given = "".join(f", {field}" for field in record._fields)
        inside = "".join(f"{field}, " for field in record._fields)
        constructor = eval(f"lambda _cls{given}: _new(_cls, ({inside}))", {"_new": tuple.__new__})
        constructor.__defaults__ = tuple(record._field_defaults.values()) or None
        constructor.__name__, constructor.__qualname__ = "__new__", f"{record.__qualname__}.__new__"
        return constructor

    class _Record(tuple):
        """What all records can do."""

        __slots__ = ()

        @classmethod
        def _make(cls, values: Any) -> Any:
            found = tuple.__new__(cls, values)
            if len(found) != len(cls._fields):
                raise TypeError(f"expected {len(cls._fields)} values of {cls.__name__}, found {len(found)}")
            return found

        def _replace(self, /, **named: Any) -> Any:
            found = self._make(map(named.pop, self._fields, self))
            if named:
                raise ValueError(f"{type(self).__name__} has no field {', '.join(map(repr, named))}")
            return found

        __replace__ = _replace

        def _asdict(self) -> dict[str, Any]:
            return dict(zip(self._fields, self, strict=True))

        def __repr__(self) -> str:
            values = (f"{field}={value!r}" for field, value in zip(self._fields, self, strict=True))
            return f"{type(self).__name__}({', '.join(values)})"

        def __getnewargs__(self) -> tuple[Any, ...]:
            return tuple(self)

    NamedTuple = type.__new__(_Class, "NamedTuple", (), {"__doc__": "The base that a record is declared with."})
