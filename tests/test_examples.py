"""The examples run as they stand, are short, and say what they should."""

import json
import runpy
from pathlib import Path

import pytest
from dockpose import Estimate

from tests.support.methods import registered

EXAMPLES = Path(__file__).resolve().parents[1] / "docs" / "examples"
# What is to be read in what each prints.
PRINTS = {
    "one_picture": "1.100 m ahead, 0.060 m to the right, -0.040 m down",
    "video_with_tracking": "1.1 s: 1.00 m ahead, 100% sure",
    "scene_with_truth": "turbidity 0.8: off by 0.",
    "compare_thresholds": "bright_share 8 lights on the ring",
    "calibrate": "fx 600.",
}
WRITES = {"one_picture": "one_picture.png", "video_with_tracking": "approach.avi", "calibrate": "camera.yaml"}


def test_there_are_these_examples():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(PRINTS)


@pytest.mark.slow
@pytest.mark.parametrize("name", PRINTS)
def test_an_example_runs_from_any_folder(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with registered():
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    assert PRINTS[name] in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ([WRITES[name]] if name in WRITES else [])


@pytest.mark.parametrize("name", PRINTS)
def test_an_example_is_short_and_uses_public_names_alone(name):
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 25
    imports = [line.split() for line in text.splitlines() if line.startswith("from dockpose")]
    assert imports
    for _, module, _, *names in imports:
        public = __import__(module, fromlist=["__all__"]).__all__
        assert {one.rstrip(",") for one in names} <= set(public), module


@pytest.mark.extra
def test_the_notebook_runs_from_top_to_bottom(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    notebook = json.loads((EXAMPLES / "first_pose.ipynb").read_text(encoding="utf-8"))
    assert (notebook["nbformat"], notebook["metadata"]["kernelspec"]["name"]) == (4, "python3")
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert not any(cell.get("outputs") for cell in notebook["cells"])
    shown, names = [], {}
    with registered():
        for cell in cells:
            *_, last = cell.splitlines()
            try:
                value = compile(last, "cell", "eval")
                exec(cell[: cell.rindex(last)], names)
                shown.append(eval(value, names))  # a notebook shows a cell's last expression
            except SyntaxError:
                exec(cell, names)
    drawn = [one for one in shown if isinstance(one, Estimate)]
    assert [one.status for one in drawn] == ["ok", "ok"]
    assert all(one._repr_png_().startswith(b"\x89PNG") for one in drawn)
    assert "off by 0." in capsys.readouterr().out
