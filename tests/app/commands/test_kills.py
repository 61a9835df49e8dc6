"""Commands that are killed: a few times each here, and 200 times all of them in tests/bench/bench_kills.py."""

import pytest

from tests.support.killed_commands import COMMANDS, Killer


@pytest.fixture(scope="module")
def killer(tmp_path_factory):
    return Killer(tmp_path_factory.mktemp("kills"), seed=3)


@pytest.mark.slow
def test_a_killed_command_leaves_files_that_can_be_read(killer):
    command = next(one for one in COMMANDS if one.name == "estimate --annotate .mkv")
    told = killer.kill(command, 4)
    assert told.faults == []
    assert told.kills == 4
