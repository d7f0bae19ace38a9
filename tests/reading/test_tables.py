"""Tables of numbers against angle, written in the scene or in a CSV file."""

import math
import os

import numpy as np
import pytest

from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import parse_scene
from flywheel.scene.scene import Load

TURN = 2 * math.pi
SCENE = """
[[load]]
on = "crank"
{keys}
table = {{{table}}}
[regime]
speed = 1
{regime}
[flywheel]
inertia = 1
"""


def load(table: str, keys: str = "", folder=None, regime: str = "") -> Load:
    (found,) = parse_scene(SCENE.format(table=table, keys=keys, regime=regime), folder=folder).loads
    return found


def degrees(table: str, keys: str = "", **kwargs) -> list[float]:
    return np.degrees(load(table + ", angle_unit = 'deg'", keys, **kwargs).law.angle).round(9).tolist()


def faults(table: str, keys: str = "", folder=None) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        load(table, keys, folder)
    return {fault.path.removeprefix("load[0]."): str(fault) for fault in caught.value.faults}


def test_units_apply_to_angles_and_values():
    found = load("angle = [0, 90, 90, 360], value = [1, 2, 3, 4], angle_unit = 'deg', value_unit = 'kNm'").law
    assert found.angle.tolist() == [0.0, math.pi / 2, math.pi / 2, TURN]
    assert found.value.tolist() == [1000.0, 2000.0, 3000.0, 4000.0]
    assert found.interpolation == "linear"


@pytest.mark.parametrize("kind", ["linear", "pchip", "step"])
def test_interpolation(kind):
    found = load(f"angle = [0, {TURN}], value = [1, 2], interpolation = '{kind}'").law
    assert found.interpolation == kind


@pytest.mark.parametrize(
    ("table", "path", "hint"),
    [
        ("", "table", "neither"),
        ("angle = [0, 1]", "table", "angle"),
        ("value = [0, 1]", "table", "value"),
        ("angle = [0, 1], value = [0, 1], column = 2", "table", "column"),
        ("angle = [0, 1], value = [0, 1], file = 'a.csv'", "table", "file"),
        ("angle = 3, value = [1]", "table.angle", "a list of numbers"),
        ("angle = [0, 1], value = [1, 'a']", "table.value[1]", "number"),
        ("angle = [0, true], value = [1, 1]", "table.angle[1]", "true"),
        ("angle = [0, inf], value = [1, 1]", "table.angle[1]", "finite"),
        ("angle = [0, 1, 2], value = [1, 1]", "table", "3 angles and 2 values"),
        ("angle = [0], value = [1]", "table", "at least 2"),
        ("angle = [], value = []", "table", "at least 2"),
        ("angle = [0, 2, 1], value = [1, 2, 3]", "table", "row 3"),
        ("angle = [0, 1, 1, 1, 2], value = [1, 2, 3, 4, 5]", "table", "three equal"),
        ("angle = [0, 0, 1], value = [1, 2, 3]", "table", "first row"),
        ("angle = [0, 1, 1], value = [1, 2, 3]", "table", "last row"),
        ("angle = [0, 1], value = [1, 2]", "table", "360 deg"),
        ("angle = [0, 7], value = [1, 2]", "table", "360 deg"),
        ("angle = [0, 360], value = [1, 2], angle_unit = 'mm'", "table.angle_unit", "angle"),
        ("angle = [0, 360], value = [1, 2], angle_unit = 3", "table.angle_unit", "unit"),
        ("angle = [0, 360], value = [1, 2], value_unit = 'kN'", "table.value_unit", "torque"),
        ("angle = [0, 360], value = [1, 2], interpolation = 'cubic'", "table.interpolation", "pchip"),
        ("angles = [0, 360], value = [1, 2]", "table.angles", '"angle"'),
        ("file = 'a.csv'", "table.file", "folder"),
        ("angle = [7, 13.283185307179586], value = [1, 2]", "table", "first angle"),
    ],
)
def test_faulty_tables(table, path, hint):
    assert hint in faults(table)[path]


@pytest.mark.parametrize("raw", ["3", "[]", "'gas.csv'"])
def test_a_table_is_a_table(raw):
    text = SCENE.replace("{{{table}}}", raw).format(keys="", regime="")
    with pytest.raises(SceneError, match=r"load\[0\]\.table .* expected a table"):
        parse_scene(text)


def test_nearly_a_period_becomes_one_exactly():
    assert load("angle = [0, 6.283185307], value = [1, 2]").law.angle[-1] == TURN
    found = load("angle = [-180, 180], value = [1, 2], angle_unit = 'deg'").law
    assert found.angle.tolist() == [-math.pi, math.pi]


def test_a_table_repeats_with_every():
    assert degrees("angle = [0, 90, 180], value = [1, 2, 3]", "every = '180 deg'") == [0.0, 90.0, 180.0]


@pytest.mark.parametrize(
    ("angles", "window"),
    [
        ("[30, 50]", "from = '30 deg'\nto = '50 deg'"),
        ("[20, 60]", "from = '30 deg'\nto = '50 deg'"),
        ("[-30, 30]", "from = '340 deg'\nto = '20 deg'"),
        ("[330, 390]", "from = '340 deg'\nto = '20 deg'"),
        ("[-30, 30]", "from = '330 deg'\nto = '30 deg'"),
        ("[0, 360]", "from = '330 deg'\nto = '30 deg'"),
        ("[-90, -30]", "from = '280 deg'\nto = '330 deg'"),
        ("[320, 360]", "from = '330 deg'\nto = 0"),
    ],
)
def test_a_table_may_cover_just_its_window(angles, window):
    assert len(degrees(f"angle = {angles}, value = [1, 2]", window)) == 2


@pytest.mark.parametrize(
    ("angles", "window"),
    [
        ("[31, 50]", "from = '30 deg'\nto = '50 deg'"),
        ("[30, 49]", "from = '30 deg'\nto = '50 deg'"),
        ("[0, 20]", "from = '340 deg'\nto = '20 deg'"),
        ("[0, 400]", "from = '340 deg'\nto = '20 deg'"),
        ("[30, 50]", "from = '50 deg'\nto = '30 deg'"),
    ],
)
def test_a_table_short_of_its_window_is_refused(angles, window):
    assert "window" in faults(f"angle = {angles}, value = [1, 2], angle_unit = 'deg'", window)["table"]


def test_ends_within_rounding_of_the_window_are_put_onto_it():
    found = load("angle = [0.5235987756, 0.8726646260], value = [1, 2]", "from = '30 deg'\nto = '50 deg'")
    assert found.law.angle.tolist() == [found.start, found.end]


# -- CSV ---------------------------------------------------------------------------------------------------------------


def csv(tmp_path, text, more="", keys="", encoding="utf-8"):
    (tmp_path / "t.csv").write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return load(f"file = 't.csv', angle_unit = 'deg'{more}", keys, tmp_path).law


def csv_faults(tmp_path, text, more=""):
    with pytest.raises(SceneError) as caught:
        csv(tmp_path, text, more)
    return {fault.path.removeprefix("load[0].table."): str(fault) for fault in caught.value.faults}


@pytest.mark.parametrize(
    "text",
    [
        "0,1\n180,2\n360,3\n",
        "0;1\n180;2\n360;3",
        "0\t1\r\n180\t2\r\n360\t3\r\n",
        "0 1\n180   2\n 360 3 ",
        "angle,moment\n0,1\n180,2\n360,3\n",
        "# measured\n\nangle; moment; speed\n0;1;9\n# in between\n180;2;9\n360;3;9\n",
        '"angle, deg","moment, N m"\n0,1\n180,2\n360,3\n',
        "+0.,1e0\n1.8e2,2\n360.0,.3e1",
        "\ufeff0,1\n180,2\n360,3\n",
    ],
)
def test_separators_headers_and_comments(tmp_path, text):
    found = csv(tmp_path, text)
    assert found.angle.tolist() == [0.0, math.pi, TURN]
    assert found.value.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("column", ["3", "'force'"])
def test_columns_by_number_and_by_name(tmp_path, column):
    found = csv(tmp_path, "angle,moment,force\n0,1,7\n360,2,8\n", f", column = {column}")
    assert found.value.tolist() == [7.0, 8.0]


def test_a_csv_and_the_scene_agree_to_the_last_bit(tmp_path):
    rows = [(i * 0.1, i * 0.3) for i in range(3601)]
    text = "\n".join(f"{angle!r},{value!r}" for angle, value in rows)
    listed = ", ".join(f"{name} = {[row[i] for row in rows]}" for i, name in enumerate(("angle", "value")))
    inline = load(listed + ", angle_unit = 'deg', value_unit = 'kNm'").law
    assert np.array_equal(csv(tmp_path, text, ", value_unit = 'kNm'").angle, inline.angle)
    assert np.array_equal(csv(tmp_path, text, ", value_unit = 'kNm'").value, inline.value)
    assert math.radians(90) in inline.angle


@pytest.mark.parametrize(
    ("text", "more", "path", "hint"),
    [
        ("0;1,5\n360;2,5\n", "", "file", "write 1.5, not 1,5"),
        ("0,0 1,5\n360,0 2,5\n", "", "file", "write 1.5, not 1,5"),
        ("0,1\n180\n360,3\n", "", "file", "line 2"),
        ("0,1\n180,2,3\n360,3\n", "", "file", "line 2"),
        ("0,1\n180,two\n360,3\n", "", "file", "line 2"),
        ("0,1\n180,nan\n360,3\n", "", "file", '"nan"'),
        ("0,1\n180,1_0\n360,3\n", "", "file", '"1_0"'),
        ("O,1\n360,3\n", "", "file", "line 1"),
        ("", "", "file", "no rows"),
        ("# nothing\n", "", "file", "no rows"),
        ("angle,moment\n", "", "file", "no rows"),
        ("0\n360\n", "", "column", "a single column"),
        ("0,1\n360,2\n", ", column = 1", "column", "from 2 to 2"),
        ("0,1\n360,2\n", ", column = 3", "column", "from 2 to 2"),
        ("0,1\n360,2\n", ", column = true", "column", "true"),
        ("0,1\n360,2\n", ", column = 'moment'", "column", "no header"),
        ("angle,moment\n0,1\n360,2\n", ", column = 'momemt'", "column", '"moment"'),
        ("angle,m,m\n0,1,2\n360,2,3\n", ", column = 'm'", "column", "one column"),
        ("angle,m\n0,1\n360,2\n", ", column = 'angle'", "column", "one column"),
        (b"0,1\n360,\xff\n", "", "file", "UTF-8"),
        ("0,1\n360,1\n".encode("utf-16"), "", "file", "UTF-16"),
        ("0,1\n360,1\n".encode("utf-16-le"), "", "file", "UTF-16"),
        ("0,1\n360,1e999\n", "", "value", "floating-point range"),
    ],
)
def test_faulty_files(tmp_path, text, more, path, hint):
    assert hint in csv_faults(tmp_path, text, more)[path]


def test_only_the_first_faulty_rows_are_spelt_out(tmp_path):
    (tmp_path / "t.csv").write_text("0,1\n" + "1,x\n" * 100)
    with pytest.raises(SceneError) as caught:
        load("file = 't.csv'", folder=tmp_path)
    assert len(caught.value.faults) == 6
    assert "95 more rows" in str(caught.value)


@pytest.mark.parametrize("name", ["../t.csv", "/etc/passwd", "/dev/zero", "sub/../../t.csv", "out.csv"])
def test_files_outside_the_folder_are_never_opened(tmp_path, name):
    (tmp_path / "t.csv").write_text("0,1\n360,2\n")
    inner = tmp_path / "inner"
    inner.mkdir()
    os.symlink(tmp_path / "t.csv", inner / "out.csv")
    assert "own folder" in faults(f"file = '{name}'", folder=inner)["table.file"]


def test_folders_devices_and_missing_files(tmp_path):
    (tmp_path / "gas.csv").write_text("0,1\n360,2\n")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "in.csv").write_text("0,1\n360,2\n")
    os.mkfifo(tmp_path / "pipe.csv")
    assert 'did you mean "gas.csv"' in faults("file = 'gaz.csv'", folder=tmp_path)["table.file"]
    for name in ("sub", "pipe.csv", ".", "", "a\\u0000b", "x" * 5000):
        assert "table.file" in faults(f'file = "{name}"', folder=tmp_path)
    assert load("file = 'sub/in.csv', angle_unit = 'deg'", folder=tmp_path).law.angle.size == 2


def test_a_file_of_more_than_32_mib_is_refused(tmp_path):
    with (tmp_path / "large.csv").open("wb") as stream:
        stream.truncate(32 * 2**20 + 1)
    assert "32 MiB" in faults("file = 'large.csv'", folder=tmp_path)["table.file"]
