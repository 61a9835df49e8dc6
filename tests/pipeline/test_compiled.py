"""Compiling goes on where its result cannot be kept, and what is kept is never older than the sources."""

import ast
import importlib
import inspect
import os
import pkgutil
import shutil
import subprocess
import sys
from types import ModuleType

import dockpose
import pytest
from dockpose import compiled as compiling
from numba.core import config
from numba.core.dispatcher import Dispatcher

PROGRAM = """
import resource, signal
import numpy as np
from dockpose.pixels.bright import bright_pixels
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))  # as on a full disk: no file gets further
print(len(bright_pixels(np.full((2, 2), 9, np.uint8), 5)))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no limit on files here")
def test_a_full_disk_does_not_end_the_run(tmp_path):
    pytest.importorskip("resource")
    environment = {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert (done.returncode, done.stdout.strip()) == (0, "4"), done.stderr[-500:]


@pytest.mark.slow
def test_an_edited_helper_changes_what_calls_it_from_another_file(tmp_path):
    folder = tmp_path / "loops" / "steps"
    folder.mkdir(parents=True)
    shutil.copy(compiling.__file__, folder / "compiled.py")
    helper = folder / "helper.py"
    text = "from loops.steps.compiled import compiled\n\n@compiled\ndef step(x):\n    return x + 1\n"
    helper.write_text(text)
    (folder / "caller.py").write_text(text.replace("def step", "def twice").replace("x + 1", "step(step(x))"))
    (folder / "caller.py").write_text("from loops.steps.helper import step\n" + (folder / "caller.py").read_text())
    program = "from loops.steps.caller import twice; print(twice(1), sum(twice.stats.cache_hits.values()))"

    def run():
        done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
        return done.stdout.split()

    assert run() == ["3", "0"]
    assert run() == ["3", "1"]
    helper.write_text(text.replace("x + 1", "x + 10"))
    assert run() == ["21", "0"]


@pytest.mark.slow
def test_what_was_compiled_for_a_type_that_is_no_more_is_compiled_again(tmp_path):
    folder = tmp_path / "loops"
    folder.mkdir()
    shutil.copy(compiling.__file__, folder / "compiled.py")
    text = "from typing import NamedTuple\nfrom loops.compiled import compiled\n\n"
    text += "class Pair(NamedTuple):\n    x: float\n\n@compiled\ndef of(pair):\n    return pair.x\n\n"
    text += "print(of(Pair(1.0)), sum(of.stats.cache_hits.values()))\n"
    for source, said in ((text, "1.0 0"), (text, "1.0 1"), (text.replace("Pair", "Other"), "1.0 0")):
        (folder / "pairs.py").write_text(source)
        command = [sys.executable, "-c", "import loops.pairs"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert done.stdout.strip() == said, done.stderr[-500:]


@pytest.mark.slow
def test_what_one_version_of_numba_compiled_is_there_after_another_ran(tmp_path):
    program = (
        "import numba, sys; numba.__version__ = sys.argv[1] or numba.__version__\n"
        "from dockpose.pixels.flood import root_of; import numpy as np\n"
        "root_of(np.zeros(1, np.int32), 0); print(sum(root_of.stats.cache_hits.values()))"
    )

    def hits(version):
        command = [sys.executable, "-c", program, version]
        env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
        return subprocess.run(command, capture_output=True, text=True, check=True, env=env).stdout.strip()

    assert [hits(version) for version in ("", "0.0.1", "", "0.0.1")] == ["0", "0", "1", "1"]


def test_a_loop_is_told_of_when_it_is_compiled_and_not_when_it_is_called_again(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    told = []
    loop = compiling.compiled(lambda x: x + 1)
    with compiling.on_compiling(lambda: told.append(1)):
        assert loop(1) == 2
        compilations = len(told)
        assert compilations > 0
        assert loop(2) == 3
    assert len(told) == compilations


def test_a_compiled_function_uses_nothing_of_a_file_without_compiled_functions():
    names = [one.name for one in pkgutil.walk_packages(dockpose.__path__, "dockpose.")]
    modules = [importlib.import_module(name) for name in names if "__main__" not in name]
    with_compiled = {module.__name__ for module in modules if any(_compiled_here(module))}
    assert len(with_compiled) > 10
    for module in modules:
        imports = [one for one in ast.walk(ast.parse(inspect.getsource(module))) if isinstance(one, ast.ImportFrom)]
        ours = [one for one in imports if (one.module or "").startswith("dockpose.")]
        origin = {alias.name: one.module for one in ours for alias in one.names}
        for function in _compiled_here(module):
            used = {origin[name] for name in function.py_func.__code__.co_names if name in origin}
            assert used <= with_compiled, (module.__name__, function.py_func.__name__)


def _compiled_here(module: ModuleType) -> list[Dispatcher]:
    found = [one for one in vars(module).values() if isinstance(one, Dispatcher)]
    return [one for one in found if one.py_func.__module__ == module.__name__]
