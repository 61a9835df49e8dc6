import pytest
from dockpose.app.cli import main
from dockpose.app.commands.arguments import metres
from dockpose.app.errors import UserError


@pytest.mark.parametrize(
    ("text", "expected"), [("0.3", 0.3), ("5", 5), ("30cm", 0.3), ("300 mm", 0.3), ("30m", 30), ("3e-1", 0.3)]
)
def test_diameters_are_in_metres_or_have_a_unit(text, expected):
    assert metres(text) == pytest.approx(expected)


@pytest.mark.parametrize("text", ["abc", "30 inch", "", "cm"])
def test_what_is_no_length_is_refused(text):
    with pytest.raises(UserError, match="must be a length"):
        metres(text)


@pytest.mark.parametrize("command", ["estimate", "compare", "serve", "export"])
def test_a_large_bare_diameter_is_asked_about(command, capsys, tmp_path):
    out = ["--out", str(tmp_path / "out")] if command == "export" else []
    assert main([command, "x.png", "--dock-diameter", "30", *out]) == 2
    told = capsys.readouterr().err
    assert "centimetres?" in told
    assert "write 0.3, or 30m" in told
    assert len(told.splitlines()) == 1
