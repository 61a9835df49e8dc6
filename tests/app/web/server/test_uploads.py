import pytest
from dockpose.app.web.server.uploads import clean_name


@pytest.mark.parametrize(
    ("name", "clean"),
    [
        ("tank.png", "tank.png"),
        ("../../etc/passwd", "passwd"),
        ("C:\\pictures\\a.png", "a.png"),
        ("a\x00b\nc\x1b[31m.png", "abc[31m.png"),
        ("", "the file"),
        ("x" * 500, "x" * 80),
    ],
)
def test_names_of_uploads_are_made_harmless(name, clean):
    assert clean_name(name) == clean
