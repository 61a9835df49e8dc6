import pytest
from dockpose.app.cli import main
from dockpose.app.errors import UserError
from dockpose.app.experiment import Session, SessionError
from dockpose.app.experiment.folder import SessionFolder


def test_sessions_stay_below_their_folder(tmp_path):
    shelf = SessionFolder(tmp_path / "sessions")
    assert shelf.names() == []
    assert not shelf.root.exists()
    for typed, name in (("../../up", "up"), ("/etc/passwd", "etc_passwd"), ("", None), ("up", "up-2"), ("CON", "CON_")):
        with shelf.start(typed) as session:
            assert session.folder.parent == shelf.root
            assert name is None or session.folder.name == name
    assert len(shelf.names()) == 5
    Session.create(tmp_path / "outside").close()
    (shelf.root / "link").symlink_to(tmp_path / "outside")
    for name in ("../outside", "link", str(tmp_path / "outside"), "none"):
        with pytest.raises(UserError):
            shelf.take_up(name)
    shelf.take_up("up").close()


def test_folder_that_is_a_file_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SessionError, match="file"):
        SessionFolder(tmp_path / "file").start("a")
    assert main(["serve", "--port", "0", "--sessions", str(tmp_path / "file")]) == 2
