"""The Dockerfile's commands, one after the other, in a folder instead of a container: two minutes, as root on Linux."""
# Its folders lie below another one, no file may be written, and the program runs as nobody.

import functools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from tests.support.container import environment, of

ROOT = Path(__file__).resolve().parents[2]
NOBODY = 65534
PLACES = ("/opt/dockpose", "/source", "/data", "/tmp")


@pytest.fixture
def container():
    folder = Path(tempfile.mkdtemp(dir="/tmp"))
    folder.chmod(0o755)
    yield folder
    subprocess.run(["chmod", "-R", "u+w", str(folder)], check=False)
    shutil.rmtree(folder)


def without_rights(user):
    """What runs a command as a user without any capability, so that the modes of files bind it."""
    ids = (f"--reuid={user}", f"--regid={user}", "--clear-groups")
    return ["setpriv", *ids, "--bounding-set=-all", "--inh-caps=-all", "--ambient-caps=-all"]


@functools.cache
def user():
    """Nobody; or root, without its rights, where this Python lies in a folder that nobody else may enter."""
    asked = [*without_rights(NOBODY), "sh", "-c", f"{os.path.realpath(sys.executable)} -c ''"]
    return NOBODY if subprocess.run(asked, capture_output=True, check=False).returncode == 0 else 0


def inside(folder, text):
    """The text with the container's folders below another one."""
    for place in PLACES:
        text = text.replace(place, f"\0{place.lstrip('/')}")
    return text.replace("\0", f"{folder}/")


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can become nobody")
def test_the_commands_one_after_the_other(container):
    build(container)
    start(container)


def build(container):
    """Do what the first stage does."""
    for name in ("source", "tmp", "data", "opt"):
        (container / name).mkdir()
    names = [line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")]
    skip = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for name in names:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, container / "source" / name, ignore=skip)
        else:
            shutil.copy(ROOT / name, container / "source" / name)
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "NUMBA"))}
    building = clean | {"PATH": f"{Path(sys.executable).parent}:{clean['PATH']}"}
    for step in of("RUN", 0):
        variables = {name: inside(container, value) for name, value in environment(0).items()}
        done = subprocess.run(
            ["sh", "-c", inside(container, step.text)],
            env=building | (variables if "dockpose estimate" in step.text else {}),
            cwd=container,
            capture_output=True,
            text=True,
            timeout=900,
            check=False,
        )
        assert done.returncode == 0, done.stderr
    size = sum(path.lstat().st_size for path in (container / "opt").rglob("*") if not path.is_dir()) / 1e6
    print(f"{size:.0f} MB above the base image")


def start(container):
    """Do what the second stage does, and start the page as it would."""
    subprocess.run(["chmod", "-R", "a-w,a+rX", str(container / "opt")], check=True)
    for name in ("tmp", "data"):
        os.chown(container / name, user(), user())

    variables = {name: inside(container, value) for name, value in environment(1).items() if name != "PATH"}
    variables["PATH"] = f"{container}/opt/dockpose/bin:/usr/bin:/bin"
    variables["TMPDIR"] = str(container / "tmp")
    as_nobody = without_rights(user())

    def words(name):
        (instruction,) = of(name, 1)
        return [inside(container, word) for word in instruction.words]

    def run(*command):
        return subprocess.run(
            [*as_nobody, *command], env=variables, cwd=container / "data", capture_output=True, text=True, timeout=300,
            check=False,
        )  # fmt: skip

    with (container / "told").open("w") as told_to:
        page = subprocess.Popen(
            [*as_nobody, *words("ENTRYPOINT"), *words("CMD")], env=variables, cwd=container / "data", stderr=told_to
        )
    try:
        begin, healthy, told = time.perf_counter(), False, ""
        while not (healthy and "the page is at http://" in told) and time.perf_counter() - begin < 180:
            assert page.poll() is None, told
            healthy = healthy or run(*words("HEALTHCHECK")).returncode == 0
            told = (container / "told").read_text()
        print(f"healthy after {time.perf_counter() - begin:.1f} s")
        assert healthy
    finally:
        page.send_signal(signal.SIGTERM)
        page.wait(timeout=30)
    assert page.returncode == 143
    assert "the page is at http://" in told
    told = (container / "told").read_text()
    assert "refused" not in told  # the check's requests
    assert "compiling" not in told  # the loops were compiled when it was built
    assert run(*words("HEALTHCHECK")).returncode != 0

    doctor = run(*words("ENTRYPOINT"), "doctor")
    print(doctor.stdout)
    assert doctor.returncode == 0, doctor.stdout
    assert list((container / "tmp" / "compiled").rglob("*.nbi"))  # the loops are kept
    assert run("sh", "-c", f"echo > {container}/opt/dockpose/bin/dockpose").returncode != 0
