"""Commands that are killed: a few times each here, and 200 times all of them in tests/bench/bench_kills.py."""

import pytest


@pytest.mark.slow
def test_a_killed_command_leaves_files_that_can_be_read(tmp_path):
    from tests.support.killed_commands import COMMANDS, Killer  # takes seconds, also where no test of this file runs

    killer = Killer(tmp_path / "kills", seed=3)
    command = next(one for one in COMMANDS if one.name == "estimate --annotate .mkv")
    told = killer.kill(command, 4)
    assert told.faults == []
    assert told.kills == 4
