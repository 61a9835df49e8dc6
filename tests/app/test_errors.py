import errno
import os

import pytest
from dockpose.app.errors import UserError, writing
from dockpose.files import write_whole


def test_a_table_that_another_program_holds_open_stays_and_is_named(tmp_path, monkeypatch):
    """On Windows nothing can take the place of a file that, say, Excel has open."""
    path = tmp_path / "day.csv"
    path.write_text("old")

    def refuse(source, target):
        raise PermissionError(errno.EACCES, "Access is denied", str(source), 5, str(target))

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(UserError, match=r"day\.csv: cannot be written .*open in another program"), writing(path):
        write_whole(path, b"new")
    assert [one.name for one in tmp_path.iterdir()] == ["day.csv"]
    assert path.read_text() == "old"
