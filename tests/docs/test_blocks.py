"""What stands in the pages' blocks works: commands and programs run, files are read."""

import re
import shlex
import tomllib

import pytest
import yaml
from dockpose.app import cli

from tests.docs.pages import PAGES, ROOT, blocks, blocks_in, code_spans, commands
from tests.support.methods import registered

COMMANDS = commands()
# Commands that are read by the parser and not run here, and why. The first that matches counts.
NOT_RUN = {
    r"(git|cd|python3|pip|\.) ": "installs the program; make newcomer does",
    r"ssh ": "needs another machine",
    r"docker ": "needs Docker; tests/test_docker.py and tests/bench/bench_docker.py take its steps without it",
    r"make ": "makes environments, or takes minutes; the target is there",
    r"dockpose( serve .*| --.*)?$": "serves until it is stopped; tests/app/commands/test_serve.py does",
    r"(dockpose ros|ros2) ": "needs a running ROS; tests/app/commands/test_ros.py has modules that stand for it",
    r"dockpose estimate (rts?p:|0 )": "needs a camera or a stream; tests/pipeline/sources has them over the loopback",
    r".* --jobs 4": "starts processes, which takes ten seconds; tests/app/processing/test_parallel.py does",
    r"dockpose simulate --out approach": "renders a hundred pictures, half a minute",
    r"dockpose (reproduce|study) ": "takes minutes; tests/app/commands/test_paper.py has parts of it",
    r"dockpose calibrate ": "looks for boards for a minute; tests/app/commands/test_calibration.py does",
    r"dockpose learn-dock ": "needs sixty frames from all sides; tests/app/commands/test_calibration.py does",
}
OURS = [(name, words) for name, words in COMMANDS if words.startswith("dockpose")]


def why_not_run(words: str) -> str | None:
    return next((why for pattern, why in NOT_RUN.items() if re.match(pattern, words)), None)


def options(command: str) -> set[str]:
    """All options of a command; of all commands where it is empty."""
    (found,) = (one.choices for one in cli._parser(*cli.COMMANDS)._actions if isinstance(one.choices, dict))
    chosen = [found[command]] if command else found.values()
    return {"--version", "--help"} | {option for one in chosen for option in one._option_string_actions}


@pytest.mark.parametrize(("name", "words"), OURS, ids=lambda value: value)
def test_commands_are_understood(name, words):
    cli._parser(*cli.COMMANDS).parse_args(cli._with_command(shlex.split(words)[1:]))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "words"), COMMANDS, ids=lambda value: value)
def test_commands_run(name, words, request, monkeypatch, capsys):
    reason = why_not_run(words)
    if reason is not None:
        pytest.skip(reason)
    monkeypatch.chdir(request.getfixturevalue("tank"))
    program, *arguments = shlex.split(words)
    assert program == "dockpose"
    assert cli.main(arguments) == 0, capsys.readouterr().err


def test_most_of_what_estimates_runs():
    run = [words for _, words in COMMANDS if why_not_run(words) is None]
    assert {words.split()[1] for words in run} >= {"estimate", "compare", "export", "simulate", "budget"}
    assert len(run) >= 12


def test_each_reason_is_needed():
    for pattern in NOT_RUN:
        assert any(re.match(pattern, words) for _, words in COMMANDS), pattern


def test_tests_that_do_it_instead_are_there():
    for why in NOT_RUN.values():
        assert all((ROOT / path).exists() for path in re.findall(r"tests/[\w/.]*\w", why)), why


@pytest.mark.parametrize("words", [words for _, words in COMMANDS if words.startswith("make ")])
def test_targets_of_make_are_there(words):
    targets = words.split()[1:]
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert all(re.search(rf"^{target}:", text, re.MULTILINE) for target in targets)


@pytest.mark.parametrize(
    "block",
    [pytest.param(block, id=block.name) for block in blocks_in("python")],
)
def test_programs_run(block, tank, monkeypatch, capsys):
    monkeypatch.chdir(tank)
    with registered():
        exec(compile(block.text, block.name, "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("block", blocks_in("yaml"), ids=lambda block: block.name)
def test_files_are_read(block):
    assert isinstance(yaml.safe_load(block.text), dict)


@pytest.mark.parametrize("block", blocks_in("toml"), ids=lambda block: block.name)
def test_tables_are_read(block):
    assert tomllib.loads(block.text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_block_goes_untried(page):
    assert {block.language for block in blocks(page)} <= {"sh", "python", "yaml", "toml", "text", "nginx"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_and_options_in_the_text_exist(page):
    for span in code_spans(page):
        for words in re.findall(r"\bdockpose ([a-z][a-z-]+)\b", span):
            assert words in cli.COMMANDS, span
        command = re.match(r"(?:dockpose )?([a-z-]+) .*--", span)
        of = command[1] if command and command[1] in cli.COMMANDS else ""
        if re.match(r"(dockpose|--|[a-z-]+ --)", span) and not span.startswith(("pip", "make", "py ")):
            assert set(re.findall(r"(?<!\S)--[a-z][a-z-]*", span)) <= options(of), span


def test_the_answer_in_the_readme_is_the_programs(capsys):
    answer = next(block.text for block in blocks(ROOT / "README.md") if block.language == "text").splitlines()[0]
    assert cli.main(["estimate", "tilted"]) == 0
    assert capsys.readouterr().out.strip().endswith(answer.removeprefix("…"))


def test_one_command_leads_to_the_page_and_one_to_the_tests():
    door = next(block for block in blocks(ROOT / "README.md") if block.language == "sh")
    assert [line.split("#")[0].strip() for line in door.text.splitlines()] == ["make run", "make test"]
    assert door.line < 45
