"""The examples in the library's docstrings run and give what they say."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import dockpose
import pytest

from tests.support.methods import registered


def _modules_with_examples() -> list[str]:
    names = []
    for part in pkgutil.iter_modules(dockpose.__path__, "dockpose."):
        if part.name == "dockpose.app":
            continue
        names.append(part.name)
        if part.ispkg:
            folder = importlib.import_module(part.name).__path__
            names += [info.name for info in pkgutil.walk_packages(folder, part.name + ".")]
    modules = {name: importlib.import_module(name) for name in names if not name.endswith("__main__")}
    finder = doctest.DocTestFinder()
    return [name for name, module in modules.items() if any(test.examples for test in finder.find(module))]


MODULES = _modules_with_examples()


@pytest.mark.parametrize("name", MODULES)
def test_examples(name: str):
    with registered():  # what an example registers is forgotten
        result = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0


def test_main_parts_have_examples():
    assert {
        "dockpose.camera.camera",
        "dockpose.dock",
        "dockpose.lights.ellipse",
        "dockpose.pose.circle",
        "dockpose.settings",
        "dockpose.simulate.render",
        "dockpose.sources.opening",
        "dockpose.thresholds.classic",
        "dockpose.tracking.tracker",
    } <= set(MODULES)
