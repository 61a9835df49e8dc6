import pytest
from dockpose.app.errors import UserError
from dockpose.app.inputs.received import UploadStore


def test_oldest_uploads_make_room():
    uploads = UploadStore()
    for name in ("a", "b", "c"):
        uploads.add(name, b"12345")
    uploads.add("a", b"123")
    assert uploads.names() == ["b", "c", "a"]
    uploads.make_room(8)
    assert uploads.names() == ["c", "a"]
    assert uploads.kept_bytes == 8
    with pytest.raises(UserError, match="b is no longer kept"):
        uploads.get("b")
    uploads.make_room(0)
    assert uploads.kept_bytes == 0
