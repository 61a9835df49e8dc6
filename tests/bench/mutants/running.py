"""The quick tests on the code as it is and on mutants, each time in a fork of a process that has loaded libraries."""

import importlib
import os
import pickle
import pkgutil
import signal
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import coverage  # pyright: ignore[reportMissingImports]
import numba
import pytest
from hypothesis import Phase, settings

from tests.bench.mutants.changes import PACKAGES, Mutated

# All quick tests but those of the page and of folders, servers and files, which see no more of the estimate.
_TESTS = (
    "tests/pipeline",
    *(f"tests/app/{name}" for name in ["commands", "drawing", "export", "inputs", "processing", "state"]),
)
_SMALL = "tests/pipeline/test_estimate_turned.py"  # whole pictures so small that loops as plain Python do
# Processor time: a test that takes longer is left out; loops that are plain Python take a hundred times as long.
_LONGEST_S = {"code": 8.0, "loops": 3.0}
_COMPILING_S = 60.0  # besides, where a loop may have to be compiled
_LOADED = "-Wignore:Module already imported"  # by the process before it forked
_OPTIONS = ("-q", "-m", "not slow and not extra", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=no", _LOADED)
_PROFILE = "mutants"


class Clean(NamedTuple):
    """How the tests run on the code as it is."""

    took_s: dict[str, float]  # processor time of each that passes
    left_out: set[str]  # that fail or take too long
    contexts: dict[str, dict[int, set[str]]]  # tests, or files of tests, that run a line

    @classmethod
    def read(cls, kind: str) -> "Clean":
        """What ``run_clean`` has kept."""
        return cls(*pickle.loads(Path(f"{kind}.pickle").read_bytes()))

    def __str__(self) -> str:
        return f"{len(self.took_s)} tests in {sum(self.took_s.values()):.0f} s; left out: {len(self.left_out)}"

    def tests_of(self, file: str, lines: set[int]) -> set[str]:
        """Tests that run one of these lines, and those of the file that tests this one."""
        by_line = self.contexts.get(file, {})
        found = {context for line in lines for context in by_line.get(line, ())}
        own = f"/test_{Path(file).name}"
        return {test for test in self.took_s if {test, test.split("::")[0]} & found or own in test}


def load_libraries() -> None:
    """Load all that the package needs, and forget the package itself and the tests."""
    numba.config.DISABLE_JIT = True  # type: ignore[attr-defined]
    import dockpose

    for module in pkgutil.walk_packages(dockpose.__path__, "dockpose."):
        if not module.name.startswith("dockpose.app"):
            importlib.import_module(module.name)
    for name in [name for name in sys.modules if name.split(".")[0] == "dockpose"]:
        del sys.modules[name]
    settings.register_profile(_PROFILE, deadline=None, phases=[Phase.explicit, Phase.generate], derandomize=True)


def run_clean(kind: str, packages: Iterable[str]) -> None:
    """Run the tests, of loops those of packages, and keep how long each takes, compiled, and which lines it runs."""
    _settle(kind)
    longest_s, compiling_s = _LONGEST_S[kind], _COMPILING_S if kind == "code" else 0.0
    follow = coverage.Coverage(
        data_file=None, config_file=False, include=[f"{Path.cwd()}/pipeline/{name}/*" for name in PACKAGES]
    )
    limits = _Limits({}, longest_s + compiling_s, follow)
    follow.start()
    tests = _TESTS if kind == "code" else [*(f"tests/pipeline/{name}" for name in packages), _SMALL]
    pytest.main([*tests, *_OPTIONS, f"--hypothesis-profile={_PROFILE}"], plugins=[limits])
    follow.stop()
    if slow := [test for test, took_s in limits.took_s.items() if took_s > longest_s]:
        again = _Limits({}, longest_s)
        pytest.main([*slow, *_OPTIONS, f"--hypothesis-profile={_PROFILE}"], plugins=[again])
        limits.took_s |= again.took_s
        limits.failed |= again.failed
    data = follow.get_data()
    contexts = {
        Path(file).relative_to(Path.cwd().resolve()).as_posix(): {
            line: set(tests) for line, tests in data.contexts_by_lineno(file).items()
        }
        for file in data.measured_files()
    }
    passed = {test: took_s for test, took_s in limits.took_s.items() if test not in limits.failed}
    Path(f"{kind}.pickle").write_bytes(pickle.dumps((passed, limits.failed, contexts)))


def run_on(kind: str, file: str, text: str, tests: dict[str, float]) -> None:
    """Run tests, until one fails, with another text for one file; exits as pytest does."""
    _settle(kind)
    sys.meta_path.insert(0, Mutated(Path.cwd() / file, text))
    more_s = 10 + _COMPILING_S * (kind == "code")
    limits = _Limits({test: more_s + 4 * took_s for test, took_s in tests.items()}, _LONGEST_S[kind])
    if not tests:
        return
    sys.exit(pytest.main([*tests, "-x", *_OPTIONS, f"--hypothesis-profile={_PROFILE}"], plugins=[limits]))


def _settle(kind: str) -> None:
    numba.config.DISABLE_JIT = kind == "loops"  # type: ignore[attr-defined]
    os.environ["NUMBA_DISABLE_JIT"] = str(int(kind == "loops"))
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)


class _Limits:
    """Ends a test that takes too long, and notes how long each took, and whether it did not pass."""

    def __init__(self, limits_s: dict[str, float], limit_s: float, follow: coverage.Coverage | None = None) -> None:
        self.took_s, self.failed = dict[str, float](), set[str]()
        self._limits_s, self._limit_s, self._follow = limits_s, limit_s, follow
        signal.signal(signal.SIGPROF, self._ring)

    def _ring(self, *_: Any) -> None:
        raise TimeoutError

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Any:
        """What fixtures run is run for all tests of the file."""
        return (yield from self._within_limit(item, item.nodeid.split("::")[0]))

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Any:
        """What the test itself runs."""
        return (yield from self._within_limit(item, item.nodeid))

    def _within_limit(self, item: pytest.Item, context: str) -> Any:
        if self._follow is not None:
            self._follow.switch_context(context)
        start_s = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, self._limits_s.get(item.nodeid, self._limit_s))
        try:
            return (yield)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            self.took_s[item.nodeid] = self.took_s.get(item.nodeid, 0.0) + time.process_time() - start_s

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note what did not pass."""
        if report.outcome != "passed":
            self.failed.add(report.nodeid)
