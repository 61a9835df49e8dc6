import io
import json
from typing import Any

import pytest
from dockpose.app.commands.output import to_json, write_line


@pytest.mark.parametrize(
    "line", [{"x": 1.5, "y": None, "name": "tank.png"}, {"name": "Hafen Büsum.png"}, {"name": "broken\udcff.png"}]
)
def test_a_line_is_plain_ascii_and_reads_back(line):
    file: Any = io.StringIO()
    write_line(file, line)
    assert file.getvalue().isascii()
    assert file.getvalue().count("\n") == 1
    assert json.loads(file.getvalue()) == line | {"name": line.get("name", "").replace("\udcff", "\\xff")}


@pytest.mark.parametrize("number", [0.1, 1e-7, 1e22, 123456.789, -0.0, 2**53])
def test_numbers_keep_all_their_digits(number):
    assert json.loads(to_json({"x": number}))["x"] == number


@pytest.mark.parametrize("name", ["a", "ä"])
@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_what_is_no_number_is_null(name, number):
    assert json.loads(to_json({"name": name, "x": number})) == {"name": name, "x": None}
