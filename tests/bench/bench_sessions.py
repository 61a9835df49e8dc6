"""Killing a program 200 times while it takes frames, and opening a session of 2,000 rows."""

import time
from pathlib import Path

import yaml
from dockpose.app.experiment import Session, read_session

from tests.support.killing import kill_often
from tests.support.taking import FOUND, PICTURE, long_session

KILLS = 200
ROWS = 2000
MOST_READING_S = 0.3


def test_two_hundred_kills(tmp_path: Path) -> None:
    told = kill_often(tmp_path, KILLS, seed=7, longest_s=0.6)
    print(
        f"\n{told.kills} kills, {told.while_writing} of them while a file was being written, {told.confirmed} rows "
        f"confirmed\nconfirmed rows lost: asked 0, measured {told.lost}\n"
        f"files that do not open: asked 0, measured {told.unreadable}"
    )
    assert told.while_writing > 0
    assert (told.lost, told.unreadable) == (0, 0)


def test_two_thousand_rows_open_at_once(tmp_path: Path) -> None:
    long_session(tmp_path / "tank", ROWS)
    start = time.perf_counter()
    assert len(read_session(tmp_path / "tank").rows) == ROWS
    analysis = time.perf_counter() - start
    start = time.perf_counter()
    session = Session.open(tmp_path / "tank")
    opening = time.perf_counter() - start
    start = time.perf_counter()
    session.take(PICTURE, FOUND, "tank")
    taking = time.perf_counter() - start
    session.close()
    print(
        f"\n{ROWS} rows: reading at most {MOST_READING_S} s asked, {analysis:.3f} s measured; "
        f"opening {opening:.3f} s, taking one more {taking:.3f} s"
    )
    assert yaml.safe_load((tmp_path / "tank/session.yaml").read_text())["schema"] == 1
    assert analysis < MOST_READING_S
