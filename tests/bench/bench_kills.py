"""Killing each command that writes 200 times, at any moment and before each change of a file; what stays is read."""

import os
from pathlib import Path

import cv2
import pytest

from tests.support.killed_commands import COMMANDS, Command, Killer
from tests.support.streams import MjpegServer

KILLS = int(os.environ.get("KILLS", "200"))


@pytest.fixture(scope="module")
def killer(tmp_path_factory: pytest.TempPathFactory):
    folder: Path = tmp_path_factory.mktemp("kills")
    found = Killer(folder, seed=17)
    reader, pictures = cv2.VideoCapture(str(folder / "inputs" / "film.mkv")), []
    while (got := reader.read())[0]:
        pictures.append(got[1])
    server = MjpegServer(pictures, rate_hz=25)
    found.stream = server.address
    print(f"\n{'command':26} {'kills':>5} {'ended before':>12} {'left .part':>10} {'faults':>6}")
    yield found
    server.close()


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_what_a_killed_command_leaves(killer: Killer, command: Command) -> None:
    told = killer.kill(command, KILLS)
    print(f"\n{command.name:26} {told.kills:5} {told.ended:12} {told.while_writing:10} {len(told.faults):6}", end="")
    assert told.faults == []
