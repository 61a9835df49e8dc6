"""SIGTERM to each command that runs for long; a part of it is in tests/app/commands/test_sigterm.py."""

import pytest

from tests.app.commands.test_sigterm import COMMANDS, ends_cleanly, inputs

__all__ = ["inputs"]  # a fixture
MOST_S = 2.0


@pytest.mark.parametrize("name", COMMANDS)
def test_sigterm_ends_it_cleanly_within_two_seconds(inputs, tmp_path, name):
    assert ends_cleanly(inputs, tmp_path, name) < MOST_S
