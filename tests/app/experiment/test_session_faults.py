import errno
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import pytest
from dockpose import files
from dockpose.app.experiment import Session, SessionError, read_session

from tests.support.killing import kill_often
from tests.support.taking import FOUND, PICTURE, faults

needs_forkserver = pytest.mark.skipif(
    "forkserver" not in multiprocessing.get_all_start_methods(), reason="this system cannot fork"
)


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class HalfFile:
    """A file of which a write that is refused leaves half on the disk."""

    def __init__(self, path, mode, step):
        self._file = open(path, mode, buffering=0)  # noqa: SIM115
        self._step = step

    def write(self, data):
        try:
            self._step()
        except OSError:
            self._file.write(data[: len(data) // 2])
            raise
        return self._file.write(data)

    def __getattr__(self, name):
        return getattr(self._file, name)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._file.close()


class FullDisk:
    """Counts what is asked of the disk, and refuses one step of it, or all from one step on."""

    def __init__(self, monkeypatch, refused=0, *, for_good=False):
        self.steps, self._refused, self._for_good = 0, refused, for_good
        real_fsync, real_replace = os.fsync, os.replace
        monkeypatch.setattr(os, "fsync", lambda descriptor: (self.step(), real_fsync(descriptor)))
        monkeypatch.setattr(os, "replace", lambda old, new: (self.step(), real_replace(old, new)))
        monkeypatch.setattr(files, "open", self._open, raising=False)

    def step(self):
        self.steps += 1
        if self.steps == self._refused or (self._for_good and 0 < self._refused <= self.steps):
            raise OSError(errno.ENOSPC, "No space left on device")

    def _open(self, path, mode):
        self.step()
        return HalfFile(path, mode, self.step)


def steps_of(monkeypatch, action):
    with monkeypatch.context() as patch:
        disk = FullDisk(patch)
        action()
        return disk.steps


def test_a_disk_that_is_full_at_any_step_of_taking_leaves_all_as_before(tmp_path, monkeypatch):
    with Session.create(tmp_path / "tank") as session:
        steps = steps_of(monkeypatch, lambda: session.take(PICTURE, FOUND, 'tank, "left"\n', notes="kill"))
        assert steps == 3 * 4 + 2  # open, write, sync, rename of three files, and two folders
        for refused in range(1, steps + 1):
            before, rows = contents(session.folder), session.rows
            with monkeypatch.context() as patch:
                FullDisk(patch, refused)
                with pytest.raises(SessionError, match=r"frame .* cannot be saved: the disk is full"):
                    session.take(PICTURE, FOUND, "b")
            assert contents(session.folder) == before
            assert session.rows == rows
            session.take(PICTURE, FOUND, "c", notes="kill")  # after space was made it goes on
        assert [row.source for row in read_session(session.folder).rows[1:]] == ["c"] * steps
        assert faults(session.folder, set(range(1, steps + 2))) == ([], [])


def test_a_disk_that_stays_full_leaves_no_row_without_its_frame(tmp_path, monkeypatch):
    with Session.create(tmp_path / "tank") as session:
        for refused in range(1, 15):
            before = contents(session.folder)
            with monkeypatch.context() as patch:
                FullDisk(patch, refused, for_good=True)
                with pytest.raises(SessionError, match="full"):
                    session.take(PICTURE, FOUND, "b", notes="kill")
            assert contents(session.folder) == before or refused == 14
            assert read_session(session.folder).rows == session.rows
            assert faults(session.folder, {row.number for row in session.rows}) == ([], [])
            session.take(PICTURE, FOUND, "c", notes="kill")
    assert faults(session.folder, {row.number for row in session.rows}) == ([], [])


def test_a_disk_that_is_full_at_any_step_of_an_edit_leaves_all_as_before(tmp_path, monkeypatch):
    with Session.create(tmp_path / "tank") as session:
        session.take(PICTURE, FOUND, "a")
        steps = steps_of(monkeypatch, lambda: session.edit(1, notes="first"))
        for refused in range(1, steps + 1):
            before, rows = contents(session.folder), session.rows
            with monkeypatch.context() as patch:
                FullDisk(patch, refused)
                with pytest.raises(SessionError, match="row 1 cannot be changed: the disk is full"):
                    session.edit(1, notes=f"try {refused}")
            assert contents(session.folder) == before
            assert session.rows == rows
        assert session.edit(1, notes="last") == read_session(session.folder).rows[0]


def test_a_disk_that_is_full_while_a_session_is_made_leaves_nothing(tmp_path, monkeypatch):
    steps = steps_of(monkeypatch, lambda: Session.create(tmp_path / "first").close())
    for refused in range(1, steps + 1):
        with monkeypatch.context() as patch:
            FullDisk(patch, refused)
            with pytest.raises(SessionError, match="cannot be made: the disk is full"):
                Session.create(tmp_path / "second")
        assert not (tmp_path / "second").exists()
    Session.create(tmp_path / "second").close()


def test_a_read_only_folder_is_said_at_once(tmp_path, monkeypatch):
    Session.create(tmp_path / "tank").close()
    if os.name != "nt" and os.geteuid() != 0:
        (tmp_path / "tank" / ".lock").chmod(0o444)
        (tmp_path / "tank").chmod(0o555)
    else:  # root may write anywhere

        def refuse(*_):
            raise PermissionError(errno.EACCES, "Permission denied")

        monkeypatch.setattr("dockpose.app.experiment.lock.os.open", refuse)
    with pytest.raises(SessionError, match=r"cannot be reopened: it may not be written to \(read-only"):
        Session.open(tmp_path / "tank")
    (tmp_path / "tank").chmod(0o755)


def test_the_second_of_two_is_told(tmp_path):
    with Session.create(tmp_path / "tank"):
        with pytest.raises(SessionError, match=f"it is in use by process {os.getpid()}"):
            Session.open(tmp_path / "tank")
        opening = f"from dockpose.app.experiment import Session; Session.open({str(tmp_path / 'tank')!r})"
        other = subprocess.run([sys.executable, "-c", opening], capture_output=True, text=True, timeout=60)
        assert other.returncode != 0
        assert f"it is in use by process {os.getpid()}" in other.stderr
    Session.open(tmp_path / "tank").close()


def test_after_closing_nothing_is_added(tmp_path):
    session = Session.create(tmp_path / "tank")
    session.close()
    session.close()
    with pytest.raises(SessionError, match="was closed"):
        session.take(PICTURE, FOUND, "a")


def test_what_a_stopped_program_leaves_is_cleared_or_told(tmp_path):
    folder = tmp_path / "tank"
    with Session.create(folder) as session:
        session.take(PICTURE, FOUND, "a")
        orphan = session.take(PICTURE, FOUND, "b")
    (folder / "frames/.0003.png.part").write_bytes(b"half")
    (folder / ".results.csv.part").write_bytes(b"half")
    # As if it had been stopped just before the row was written.
    results = folder / "results.csv"
    results.write_text("".join(line for line in results.read_text().splitlines(True) if ",b," not in line))
    kept = (folder / orphan.file).read_bytes()
    with Session.open(folder) as session:
        assert not list(folder.rglob("*.part"))
        assert len(session.rows) == 1
        assert "0002" in session.notices[0]
        assert session.take(PICTURE, FOUND, "c").number == 3
    assert (folder / orphan.file).read_bytes() == kept


def test_an_old_frame_is_never_overwritten(tmp_path):
    with Session.create(tmp_path / "tank") as session:
        stranger = session.folder / "frames/0001.png"
        stranger.write_bytes(b"mine")
        with pytest.raises(SessionError, match="is not overwritten"):
            session.take(PICTURE, FOUND, "a")
        assert stranger.read_bytes() == b"mine"


def test_a_picture_that_is_gone_is_told(tmp_path):
    with Session.create(tmp_path / "tank") as session:
        (session.folder / session.take(PICTURE, FOUND, "a").file).unlink()
    with Session.open(tmp_path / "tank") as session:
        assert "row 1 is no longer" in session.notices[0]


def test_a_session_half_made_is_made_again(tmp_path):
    folder = tmp_path / "tank"
    Session.create(folder).close()
    (folder / "session.yaml").unlink()  # the last file to be written
    with Session.create(folder) as session:
        assert session.take(PICTURE, FOUND, "a").number == 1


@pytest.mark.slow
@needs_forkserver
def test_kills_lose_nothing(tmp_path: Path):
    told = kill_often(tmp_path, kills=10, seed=1, longest_s=1.0)  # for a row or more on a busy machine
    assert (told.lost, told.unreadable) == (0, 0)
    assert told.confirmed > 0


def test_a_clock_that_is_set_back_is_told_and_changes_no_order(tmp_path, monkeypatch):
    times = iter(["2026-03-01T10:00:00.000+01:00", "2026-03-01T09:00:00.000+01:00", "2026-03-01T09:00:05.000+00:00"])
    with Session.create(tmp_path / "tank") as session:
        monkeypatch.setattr("dockpose.app.experiment.session._now", lambda: next(times))
        for _ in range(3):
            session.take(PICTURE, FOUND, "tank")
    with Session.open(tmp_path / "tank") as session:
        assert [row.number for row in session.rows] == [1, 2, 3]
        assert session.notices == (
            "By their times, row 2 was taken before the row above: the computer's clock was set back. Rows stand in "
            "the order in which they were taken.",
        )
