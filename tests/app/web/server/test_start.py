import os
import stat

import pytest
from dockpose.app.web.server.start import token_for


def test_a_token_stays_over_restarts_and_differs_by_port(tmp_path):
    folder = tmp_path / "config"
    first = token_for(folder, "8080")
    assert token_for(folder, "8080") == first
    assert token_for(folder, "8081") != first
    assert len(first) == 24


@pytest.mark.skipif(os.name != "posix", reason="owners and modes of files are POSIX")
def test_only_the_user_can_read_it_and_it_is_replaced_where_others_could(tmp_path):
    first = token_for(tmp_path, "8080")
    assert stat.S_IMODE((tmp_path / "token-8080").stat().st_mode) == 0o600
    (tmp_path / "token-8080").chmod(0o644)
    second = token_for(tmp_path, "8080")
    assert second != first
    assert token_for(tmp_path, "8080") == second


@pytest.mark.parametrize("content", [b"", b"short", b"\xff" * 24, b"../../../etc/passwd-----x"])
def test_a_damaged_file_is_replaced(tmp_path, content):
    path = tmp_path / "token-8080"
    path.write_bytes(content)
    path.chmod(0o600)
    token = token_for(tmp_path, "8080")
    assert path.read_text().strip() == token != content.decode("latin-1")


def test_without_a_folder_each_start_has_its_own_and_one_that_cannot_be_written_is_no_obstacle(tmp_path):
    assert token_for(None, "8080") != token_for(None, "8080")
    (tmp_path / "file").write_text("")
    assert len(token_for(tmp_path / "file", "8080")) == 24
