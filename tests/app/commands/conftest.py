"""What all tests of commands have in common."""

from contextlib import nullcontext

import pytest
from dockpose.app import cli


@pytest.fixture(autouse=True)
def _no_word_on_compiling(monkeypatch):
    """Whether loops are compiled depends on which tests ran before; tests/test_package.py has the message."""
    monkeypatch.setattr(cli, "on_compiling", lambda tell: nullcontext())
