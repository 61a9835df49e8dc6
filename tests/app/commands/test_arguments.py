import pytest
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
def test_a_large_bare_diameter_is_asked_about(command, refusal, tmp_path):
    out = ["--out", str(tmp_path / "out")] if command == "export" else []
    told = refusal(command, "x.png", "--dock-diameter", "30", *out)
    assert "centimetres?" in told
    assert "write 0.3, or 30m" in told


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["dive.mp4", "--exposure", "120"],
            "--exposure is for a camera, as 0 or /dev/video0; dive.mp4 is not a camera",
        ),
        (["0", "--exposure", "nan"], "--exposure is nan; it must be a number"),
        (["0", "--gain", "inf"], "--gain is inf; it must be a number"),
        (["0", "--fps", "0"], "--fps is 0; it must be above 0 and at most 1000"),
        (["0", "--format", "JPEG2000"], "--format JPEG2000: must be the three or four letters"),
    ],
)
@pytest.mark.parametrize("command", ["estimate", "serve"])
def test_what_no_camera_can_be_asked_for_is_refused(command, words, sentence, refusal):
    assert sentence in refusal(command, *words)
