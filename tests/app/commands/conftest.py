"""What all tests of commands have in common."""

import json
from contextlib import nullcontext

import pytest
from dockpose import compiled
from dockpose.app.cli import main


@pytest.fixture(autouse=True)
def _no_word_on_compiling(monkeypatch):
    """Whether loops are compiled depends on which tests ran before; tests/test_package.py has the message."""
    monkeypatch.setattr(compiled, "on_compiling", lambda tell: nullcontext())


@pytest.fixture
def json_lines(capfd):
    """Run a command, and return the JSON lines that it writes to standard output."""

    def run(*words, status=0):
        assert main([*words, "--json", "-"]) == status
        return [json.loads(line) for line in capfd.readouterr().out.splitlines()]

    return run


@pytest.fixture
def refusal(capfd):
    """Run a command that cannot be done, and return the one sentence that it says."""

    def run(*words, status=2):
        assert main([*words]) == status
        told = capfd.readouterr()
        assert told.out == ""
        (sentence,) = told.err.splitlines()
        return sentence

    return run
