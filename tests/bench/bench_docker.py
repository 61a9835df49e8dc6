"""The Dockerfile's commands, one after the other, in a folder instead of a container: two minutes, as root on Linux.

Its folders lie below another one, files belong to root and none may be written, and the program runs as nobody.
"""

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


def inside(folder, text):
    """The text with the container's folders below another one."""
    for place in PLACES:
        text = text.replace(place, f"\0{place.lstrip('/')}")
    return text.replace("\0", f"{folder}/")


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can become nobody")
def test_the_commands_one_after_the_other(container):
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
    subprocess.run(["chmod", "-R", "a-w,a+rX", str(container / "opt")], check=True)
    for name in ("tmp", "data"):
        os.chown(container / name, NOBODY, NOBODY)

    variables = {name: inside(container, value) for name, value in environment(1).items() if name != "PATH"}
    variables["PATH"] = f"{container}/opt/dockpose/bin:/usr/bin:/bin"
    variables["TMPDIR"] = str(container / "tmp")
    as_nobody = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]

    def words(name):
        (instruction,) = of(name, 1)
        return [inside(container, word) for word in instruction.words]

    def run(*command):
        return subprocess.run(
            [*as_nobody, *command], env=variables, cwd=container / "data", capture_output=True, text=True, timeout=300,
            check=False,
        )  # fmt: skip

    page = subprocess.Popen(
        [*as_nobody, *words("ENTRYPOINT"), *words("CMD")],
        env=variables,
        cwd=container / "data",
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        start, healthy = time.perf_counter(), False
        while not healthy and page.poll() is None and time.perf_counter() - start < 60:
            healthy = run(*words("HEALTHCHECK")).returncode == 0
        print(f"healthy after {time.perf_counter() - start:.1f} s")
        assert healthy
    finally:
        page.send_signal(signal.SIGTERM)
        _, told = page.communicate(timeout=30)
    assert page.returncode == 143
    assert "the page is at http://" in told
    assert "compiling" not in told  # the loops were compiled when it was built
    assert run(*words("HEALTHCHECK")).returncode != 0

    doctor = run(*words("ENTRYPOINT"), "doctor")
    print(doctor.stdout)
    assert doctor.returncode == 0, doctor.stdout
    assert f"are kept in {container}/tmp/compiled" in doctor.stdout
    assert run("sh", "-c", f"echo > {container}/opt/dockpose/bin/dockpose").returncode != 0
