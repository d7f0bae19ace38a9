"""Laws of position as a scene writes them: an expression, or a table that a periodic spline can follow."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flywheel.advice import show
from flywheel.formulas.expressions import Expression
from flywheel.reading.fields import Faults
from flywheel.reading.laws import read_position
from flywheel.reading.places import Setting, whole
from flywheel.reading.schema import MOST_TURNS
from flywheel.reading.tables import read_table
from flywheel.scene import Output, Table

_SMOOTH_ROWS = 4
_CLOSES = 1e-9  # share of a law's range by which its ends may differ


def read_law(raw: object, key: str, path: str, setting: Setting) -> Expression | Table | None:
    """The law of an output: an expression, or a table that a periodic spline can follow."""
    if isinstance(raw, Mapping) and set(raw) == {"table"}:
        raw, path = raw["table"], f"{path}.table"
    if not isinstance(raw, Mapping):
        return read_position(raw, path, setting)
    if raw.get("interpolation", "spline") != "spline":
        found = show(raw["interpolation"])
        setting.faults.add(f"{path}.interpolation", found, "none", "a law's table is a spline: else inertia would jump")
        return None
    raw = {name: value for name, value in raw.items() if name != "interpolation"}
    table = read_table(raw, "length" if key == "x" else "angle", path, setting.folder, setting.faults)
    if table is None:
        return None
    if np.any(np.diff(table.angle) == 0):
        setting.faults.add(path, "a jump (two equal angles)", "none: a mechanism's position does not jump")
        return None
    return _closed(table._replace(interpolation="spline"), key, path, setting.faults)


def _closed(table: Table, key: str, path: str, faults: Faults) -> Table | None:
    """The table with both ends of a periodic position put exactly onto each other."""
    value, rows = table.value.copy(), table.angle.size
    if rows < _SMOOTH_ROWS:
        faults.add(path, f"{rows} rows", f"at least {_SMOOTH_ROWS} for a spline")
        return None
    if key == "theta":
        return table
    gap = abs(value[-1] - value[0])
    if gap > _CLOSES * np.ptp(value):
        faults.add(path, f"{value[0]:.10g} m at the first row and {value[-1]:.10g} m at the last", "the same position")
        return None
    value[-1] = value[0]
    return table._replace(value=value)


def repeats(output: Output, period: float) -> int | None:
    """How often a table's span fits into the period."""
    return whole(period / float(output.law.angle[-1] - output.law.angle[0])) if isinstance(output.law, Table) else 1


def fitted(output: Output, period: float, path: str, faults: Faults) -> Output:
    """An output that repeats after the period: a shorter table is laid end to end until it fills it."""
    law, times = output.law, repeats(output, period)
    if not isinstance(law, Table):
        return output
    if times is not None and times <= MOST_TURNS:
        filled = _filled(law, period, times)
        if np.all(np.diff(filled.angle) > 0):
            return output._replace(law=filled)
    found = f"a table of {np.degrees(law.angle[-1] - law.angle[0]):.10g} deg"
    wanted = f"a span that fits a whole number of times into {np.degrees(period):.10g} deg"
    faults.add(f"{path}.{output.name}", found, wanted)
    return output


def _filled(table: Table, period: float, times: int) -> Table:
    """A table repeated until it spans the period exactly; what it gains, it gains each time."""
    gain = table.value[-1] - table.value[0]
    turns = np.arange(times)[:, None]
    angle = np.append((table.angle[:-1] + turns * (period / times)).ravel(), table.angle[0] + period)
    value = np.append((table.value[:-1] + turns * gain).ravel(), table.value[0] + times * gain)
    return table._replace(angle=angle, value=value)
