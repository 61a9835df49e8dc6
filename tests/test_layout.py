"""That the code stays laid out as the folders' docstrings say: imports point one way, and nothing grows too large."""

import ast
import re
import tomllib

import pytest

from tests.support import layout
from tests.support.layout import HOUSES, ROOT

MOST_LINES = 340
# Of each package. Lowered by whoever takes lines away; a change that needs more takes others out in the same commit.
MOST_IN_ALL = {"app": 17_606, "pipeline": 26_545}

# Imports against the order that are still to be cut.
STILL_WRONG: set[tuple[str, str]] = set()
# Test files that are named after what several files do together.
OF_SEVERAL = {
    "app/commands/test_bags.py",
    "app/commands/test_check_truth.py",
    "app/commands/test_camera_faults.py",
    "app/commands/test_faults.py",
    "app/commands/test_lights_at.py",
    "app/commands/test_protected.py",
    "app/commands/test_packaged_methods.py",
    "app/commands/test_sigterm.py",
    "app/experiment/test_session_faults.py",
    "app/export/test_formats.py",
    "app/export/test_mavlink_for.py",
    "app/test_read_again.py",
    "app/test_recipes.py",
    "pipeline/sources/test_sources.py",
    "pipeline/test_docstrings.py",
    "pipeline/test_doctests.py",
    "pipeline/test_estimate_lights.py",
    "pipeline/test_estimate_told.py",
    "pipeline/test_estimate_turned.py",
    "pipeline/test_estimate_variety.py",
    "pipeline/test_typing.py",
    "pipeline/thresholds/test_thresholds.py",
}


@pytest.mark.slow
def test_imports_between_folders_point_one_way():
    assert set(layout.wrong_imports()) - STILL_WRONG == set()


@pytest.mark.parametrize("house", HOUSES)
def test_no_files_import_each_other_in_a_circle(house):
    assert layout.circles(house) == []


def test_a_circle_is_seen_by_way_of_others(monkeypatch):
    imported = {"a": ["dockpose.b"], "b": ["dockpose.c.thing"], "c": ["dockpose.a"], "d": ["dockpose.a"]}
    monkeypatch.setattr(layout, "files", lambda house: [layout.ROOT / "pipeline" / f"{name}.py" for name in imported])
    monkeypatch.setattr(layout, "imports_of", lambda path: imported[path.stem])
    assert layout.circles("pipeline") == [{"dockpose.a", "dockpose.b", "dockpose.c"}]


def test_the_library_knows_nothing_of_the_app_and_prints_nothing():
    for path in layout.files("pipeline"):
        text = path.read_text(encoding="utf-8")
        assert "dockpose.app" not in text, path
        assert "viser" not in text, path
        calls = (node.func for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call))
        assert not any(isinstance(call, ast.Name) and call.id == "print" for call in calls), path


def test_one_file_touches_what_is_private_in_viser():
    touching = [path.name for path in layout.files("app") if layout.touches_private_viser(path.read_text("utf-8"))]
    assert touching == ["viser_private.py"]


def test_one_script_and_one_style_sheet_know_the_names_of_visers_page():
    paths = [path for kind in ("js", "css") for path in (ROOT / "static").glob(f"*.{kind}")]
    naming = {path.name for path in paths if layout.names_of_visers_page(path.read_text("utf-8"))}
    assert naming == {"viser.js", "viser.css"}


@pytest.mark.parametrize("house", HOUSES)
def test_each_folder_says_what_lives_there(house):
    assert [str(folder) for folder in layout.folders(house) if not layout.has_docstring(folder)] == []


@pytest.mark.parametrize("house", HOUSES)
def test_files_are_short(house):
    assert {str(path): layout.lines(path) for path in layout.files(house) if layout.lines(path) > MOST_LINES} == {}


@pytest.mark.parametrize("house", HOUSES)
def test_packages_do_not_grow(house):
    assert sum(map(layout.lines, layout.files(house))) <= MOST_IN_ALL[house]


def test_each_test_file_stands_where_its_subject_stands():
    assert set(layout.tests_without_subject()) - OF_SEVERAL == set()


@pytest.mark.slow
@pytest.mark.parametrize("house", HOUSES)
def test_names_that_are_not_public_have_no_sections(house):
    """Their type hints and names say it; of the public ones test_docstrings.py asks for them."""
    assert layout.with_sections(house) == {}


def test_all_packages_are_installed():
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    folders_of_data = {"dockpose.app.static", "dockpose.sample_images"}
    assert set(tool["packages"]) - folders_of_data == set(layout.packages())
    assert folders_of_data <= set(tool["packages"])


def test_each_dependency_is_imported_somewhere():
    modules = {"opencv-python-headless": "cv2", "scikit-image": "skimage", "pyyaml": "yaml", "pillow": "PIL"}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    needs = [*project["dependencies"], *extras["ros"], *extras["mavlink"]]
    text = "\n".join(path.read_text(encoding="utf-8") for house in HOUSES for path in layout.files(house))
    for need in needs:
        name = re.split(r"[\[<>=!~ ]", need)[0]
        module = modules.get(name, name.replace("-", "_"))
        assert re.search(rf"^\s*(import|from) {module}\b", text, re.MULTILINE), name
