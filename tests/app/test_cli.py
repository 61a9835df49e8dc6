import subprocess
import sys

import pytest
from dockpose.app import cli
from dockpose.app.cli import main


@pytest.mark.parametrize(("word", "near"), [("estmate", "estimate"), ("compair", "compare"), ("simulat", "simulate")])
def test_a_mistyped_command_is_named_with_the_nearest(word, near, capsys):
    assert main([word, "x.png"]) == 2
    told = capsys.readouterr().err
    assert f"there is no command '{word}'" in told
    assert f"did you mean {near}?" in told
    assert len(told.splitlines()) == 1


def test_a_word_near_no_command_is_told_which_there_are(capsys):
    assert main(["qqq"]) == 2
    assert ", ".join(cli.COMMANDS) in capsys.readouterr().err


@pytest.mark.parametrize(
    "word",
    ["picture.png", "runs/tank", "0", "rtsp://10.0.0.5/tank", "tank7", "plain", "sample_images", "tank", "--port"],
)
def test_what_has_the_look_of_a_source_is_served(word, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tank").mkdir()
    assert cli._with_command([word]) == ["serve", word]


def test_no_words_serve_and_commands_are_left():
    assert cli._with_command([]) == ["serve"]
    for words in (["estimate", "x.png"], ["--help"], ["--version"]):
        assert cli._with_command(words) == words


def test_a_word_too_many_is_named(capsys):
    with pytest.raises(SystemExit):
        main(["budget", "tank", "--camera", "c.yaml", "--dock-diameter", "0.3", "--lights", "10"])
    wanted = "dockpose budget: 'tank' is one word too many (dockpose budget --help lists the options)\n"
    assert capsys.readouterr().err == wanted


@pytest.mark.parametrize("words", [["--method", "1" * 5000], ["1" * 5000], ["--" + "x" * 5000]])
def test_what_is_wrong_with_long_words_is_told_in_a_short_line(words, capsys):
    with pytest.raises(SystemExit):
        main(["budget", *words])
    told = capsys.readouterr().err
    assert told.startswith("dockpose budget: ")
    assert told.endswith("(dockpose budget --help lists the options)\n")
    assert len(told) < 1100  # a message has 900 characters at most
    assert told.count("\n") == 1


def loaded_by(words, names, then=""):
    """Which of these modules a command loads, and what may follow, in a process of its own."""
    code = f"""
import contextlib, sys
from dockpose.app.cli import main
with contextlib.suppress(SystemExit):
    main({words!r})
{then}
print([name for name in {names!r} if name in sys.modules])"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    return done.stdout.splitlines()[-1]


SLOW = ["scipy.linalg", "scipy.special", "scipy.spatial", "scipy.optimize", "scipy.fft", "matplotlib"]


@pytest.mark.slow
@pytest.mark.parametrize("words", [["--help"], ["--version"]])
def test_help_and_version_load_no_library(words):
    assert loaded_by(words, ["numpy", "numba", "cv2", "scipy", "rich", "msgspec", "dockpose.thresholds"]) == "[]"


@pytest.mark.slow
def test_the_estimate_of_a_picture_loads_none_of_what_takes_long():
    assert loaded_by(["estimate", "tilted"], [*SLOW, "viser", "rich", "av", "jinja2", "dockpose.simulate"]) == "[]"


@pytest.mark.slow
def test_the_page_shows_its_first_result_without_what_takes_long():
    page = "from dockpose.app.web.app import App\nwith App() as app: assert app.wait_until_idle(120)"
    assert loaded_by(["serve", "--help"], SLOW, page) == "[]"


def test_that_it_compiles_is_said_once(capsys):
    cli._say_once_that_it_compiles.cache_clear()
    for _ in range(3):
        cli._say_once_that_it_compiles()
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("dockpose: compiling the loops over pixels, once")
