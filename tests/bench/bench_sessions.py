"""Killing a program 200 times while it takes frames."""

from pathlib import Path

from tests.support.killing import kill_often

KILLS = 200


def test_two_hundred_kills(tmp_path: Path) -> None:
    told = kill_often(tmp_path, KILLS, seed=7, longest_s=0.6)
    print(
        f"\n{told.kills} kills, {told.while_writing} of them while a file was being written, {told.confirmed} rows "
        f"confirmed\nconfirmed rows lost: asked 0, measured {told.lost}\n"
        f"files that do not open: asked 0, measured {told.unreadable}"
    )
    assert told.while_writing > 0
    assert (told.lost, told.unreadable) == (0, 0)
