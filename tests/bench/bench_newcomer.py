"""The README to the letter, by somebody who has Python, make and a checkout: no Chromium, and nothing compiled."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.docs.pages import ROOT, blocks
from tests.support.visitors import Visitor

README = list(blocks(ROOT / "README.md"))
SHELL = [block.text for block in README if block.language == "sh"]
DOOR, BY_PIP, *REST = SHELL
ANSWERS = [line for block in README if block.language == "text" for line in block.text.splitlines()]
FIRST_ANSWER_S = 15  # after pip, on two quiet cores
# What a machine may have that a newcomer's has not; apt-get would bring a browser.
WITHOUT = re.compile(r"chromium|chrome|apt-get|node|npm|dockpose|pytest")


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty home, with a folder of the programs that a newcomer has, and a checkout."""
    folder = tmp_path_factory.mktemp("newcomer")
    programs = folder / "bin"
    programs.mkdir()
    for place in ("/usr/bin", "/bin"):
        for path in Path(place).iterdir():
            if not WITHOUT.search(path.name) and not (programs / path.name).exists():
                (programs / path.name).symlink_to(path)
    (programs / "python3").unlink(missing_ok=True)
    (programs / "python3").symlink_to(Path(sys.base_prefix, "bin", f"python3.{sys.version_info.minor}"))
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(folder / "dockpose")], check=True)
    (folder / "empty").mkdir()
    return folder


def environment(home: Path) -> dict[str, str]:
    """What a newcomer's shell has; how pip reaches its packages on this machine is kept."""
    kept = {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "SSL_", "LANG"))}
    return kept | {"HOME": str(home), "PATH": str(home / "bin"), "TMPDIR": str(home), "TERM": "dumb"}


def as_pattern(line: str) -> str:
    """A line of the README as a pattern, whose "…" stands for anything."""
    return ".*".join(map(re.escape, line.split("…")))


def run(script: str, home: Path, folder: Path) -> str:
    """Run a script in bash, which stops at the first command that fails; returns what it printed."""
    began_s = time.monotonic()
    command = ["bash", "-euo", "pipefail", "-c", script]
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment(home),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=1800,
        check=False,
    )
    print(f"{time.monotonic() - began_s:7.1f} s  {script.strip().splitlines()[0]} ...", flush=True)
    assert done.returncode == 0, done.stdout[-3000:]
    return done.stdout


def test_make_run_opens_the_page_on_a_dock_that_is_found(home: Path) -> None:
    began_s, said = time.monotonic(), ""
    with subprocess.Popen(
        ["make", "run"],
        cwd=home / "dockpose",
        env=environment(home),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as page:
        try:
            for line in page.stdout or ():
                said += line
                if "the page is at" in line:
                    break
            print(f"\n{time.monotonic() - began_s:7.1f} s  make run, until the page is there")
            for line in ANSWERS:
                assert re.search(as_pattern(line), said), f"{line} is not in:\n{said}"
            address = re.findall(r"http://\S+", said)[-1]
            heard: list[str] = []
            with Visitor(address, hears=lambda message: heard.append(str(message))) as visitor:
                assert visitor.until(lambda _: any("Dock found" in one for one in heard))
        finally:
            os.killpg(page.pid, signal.SIGTERM)  # a job in a shell's background would not heed an interrupt


def test_make_test_passes(home: Path) -> None:
    said = run("make test", home, home / "dockpose")
    print(said.strip().splitlines()[-1])
    assert re.search(r"\d+ passed.* in ", said)
    assert "No Chromium could be found or installed: the browser tests will be skipped" in said


def test_pip_leads_to_the_first_answer(home: Path) -> None:
    folder = home / "dockpose"
    shutil.rmtree(folder / ".venv", ignore_errors=True)
    *install, estimate = BY_PIP.strip().splitlines()
    run("\n".join(install), home, folder)
    began_s = time.monotonic()
    said = run(f". .venv/bin/activate\n{estimate}", home, folder)
    print(f"{time.monotonic() - began_s:7.1f} s  from pip to the first answer (asked on quiet cores: {FIRST_ANSWER_S})")
    assert re.search(as_pattern(ANSWERS[0]), said)


@pytest.mark.parametrize("script", REST, ids=lambda script: script.splitlines()[0])
def test_commands_run_in_an_empty_folder(home: Path, script: str) -> None:
    run(f". {home}/dockpose/.venv/bin/activate\n{script}", home, home / "empty")


@pytest.mark.parametrize("program", [block.text for block in README if block.language == "python"])
def test_programs_run_in_an_empty_folder(home: Path, program: str) -> None:
    assert run(f". {home}/dockpose/.venv/bin/activate\npython -c '{program}'", home, home / "empty").strip()
