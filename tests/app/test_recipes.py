"""The recipes of docs/code.md for a command and for a slider, followed to the letter."""

import importlib.util
import sys
import tomllib
from unittest.mock import MagicMock

import pytest
from dockpose.app import cli
from dockpose.app.errors import UserError
from dockpose.app.resources import read_toml
from dockpose.app.state import parameters
from dockpose.app.state.parameters import put
from dockpose.app.state.scene import DEFAULT_SCENE, scene_of, with_scene
from dockpose.app.state.undo import History
from dockpose.app.state.view import open_source
from dockpose.app.web.panels.source import SimulatorPanel, _with_scene_file, scene_bytes

COMMAND = '''
"""``dockpose hello``: greet somebody."""


def run(arguments):
    print(f"Hello, {arguments.name}!")
    return 0
'''


@pytest.fixture
def command(tmp_path, monkeypatch):
    """One new file, a line in ``cli.py``, and two in ``static/options.toml``."""
    path = tmp_path / "hello.py"
    path.write_text(COMMAND)
    spec = importlib.util.spec_from_file_location("hello", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setitem(sys.modules, "dockpose.app.commands.hello", module)
    monkeypatch.setitem(cli.COMMANDS, "hello", "hello:run")
    options = read_toml("options.toml")
    monkeypatch.setitem(options["commands"], "hello", {"help": "greet somebody", "options": ["hello"]})
    monkeypatch.setitem(options, "hello", {"name": {"help": "whom"}})


def test_a_command_is_run_listed_and_refuses(command, capsys):
    assert cli.main(["hello", "dock"]) == 0
    assert capsys.readouterr().out == "Hello, dock!\n"
    assert cli.main(["helo", "dock"]) == 2
    assert "did you mean hello?" in capsys.readouterr().err
    for words, status in ((["--help"], 0), (["hello"], 2)):
        with pytest.raises(SystemExit) as ended:
            cli.main(words)
        assert ended.value.code == status
    assert "greet somebody" in capsys.readouterr().out


SLIDER = """
label = "Blur (px)"
hint = "Of the lens."
path = "scene.sensor.blur_px"
limits = [0.1, 5, 0.1]
"""


@pytest.fixture
def slider(monkeypatch):
    """A row of ``static/sliders.toml``."""
    row = parameters.parameter("blur", tomllib.loads(SLIDER))
    for table in (parameters.SCENE_DISTURBANCES, parameters.PARAMETERS):
        monkeypatch.setitem(table, "blur", row)
    return row


def test_a_slider_is_on_its_panel_saved_and_undone(slider):
    app = MagicMock()
    SimulatorPanel(app)
    assert slider.label in [call.args[0] for call in app.server.gui.add_slider.call_args_list]

    history, before = History(), with_scene(open_source(None, None, None), DEFAULT_SCENE)
    after = put(before, "blur", 99)
    history.note(before, after)
    assert slider.get(after) == 5  # brought into its range
    with pytest.raises(UserError, match="Blur"):
        put(before, "blur", "much")
    assert scene_of(_with_scene_file(before, scene_bytes(scene_of(after)), "scene.yaml")).sensor.blur_px == 5
    assert slider.get(history.undo(after)) == slider.get(before)
