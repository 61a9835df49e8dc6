import csv
import io
import json
import zipfile
from dataclasses import replace

import cv2
import numpy as np
import pytest
import yaml
from dockpose import Settings
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.colours import TRUST_COLOURS
from dockpose.app.export.bundle import picture_files, read_lines, to_zip
from dockpose.app.processing.analysis import analyse
from dockpose.app.processing.background import CancelledError, Progress
from dockpose.app.state.changes import MEASURED_LIMITS, with_measured
from dockpose.app.state.parameters import put
from dockpose.app.state.view import open_source
from dockpose.files import FileError


@pytest.fixture(scope="module")
def analysis():
    return analyse(open_source(None, None, None))


def files_of(analysis, **options):
    archive = zipfile.ZipFile(io.BytesIO(to_zip(picture_files(analysis, **options))))
    return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.slow
def test_all_files_agree(analysis):
    files = files_of(analysis)
    assert set(files) == {
        *("picture.png", "annotated.png", "annotated.svg", "histogram.png", "histogram.svg", "methods.png"),
        *("result.json", "result.csv", "settings.yaml", "report.html"),
    }
    picture = cv2.imdecode(np.frombuffer(files["picture.png"], np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(picture, analysis.view.image)
    drawn = cv2.imdecode(np.frombuffer(files["annotated.png"], np.uint8), cv2.IMREAD_COLOR)
    headline = ("Dock found", TRUST_COLOURS["green"])
    np.testing.assert_array_equal(drawn, annotate(analysis.view.image, analysis.estimate, headline=headline))
    line = json.loads(files["result.json"])
    (row,) = csv.DictReader(io.StringIO(files["result.csv"].decode()))
    assert float(row["a_z_m"]) == line["candidates"][0]["position_m"][2]
    assert (line["source"], row["source"]) == ("plain", "plain")
    settings = yaml.safe_load(files["settings.yaml"])
    assert settings["settings"]["method"] == "hats"
    assert settings["dock"]["diameter_m"] == analysis.view.dock.diameter
    assert settings["camera"]["width_px"] == 640
    assert set(settings["settings"]) == {field for field in Settings.__struct_fields__}


def test_without_a_dock(analysis):
    nothing = analyse(put(analysis.view, "min_area_px", 999))
    files = picture_files(nothing)
    assert json.loads(files["result.json"]())["status"] != "ok"


def test_measured_pose_goes_along(analysis):
    view = with_measured(analysis.view, dict(zip(MEASURED_LIMITS, (1, 2, 3, 4, 5), strict=True)))
    made = picture_files(analyse(view))["settings.yaml"]()
    assert yaml.safe_load(made)["measured"]["theta_y_deg"] == 5


def test_can_be_cancelled(analysis):
    progress = Progress(lambda share: None)
    progress.stop()
    with pytest.raises(CancelledError):
        to_zip(picture_files(analysis), progress)


def test_source_that_is_markup_stays_text(analysis):
    view = replace(analysis.view, source="a: [b\n- c")
    made = picture_files(analyse(view))["settings.yaml"]()
    assert yaml.safe_load(made)["source"] == "a: [b\n- c"


def line_of(analysis, **changed):
    return json.dumps(analysis.estimate.to_dict("a.png", 0) | changed).encode() + b"\n"


@pytest.mark.parametrize(
    "changed",
    [
        {"time_s": "now"},
        {"camera": {"fx_px": -1}},
        {"dock": {"diameter_m": 0}},
        {"settings": {"method": "magic"}},
        {"chosen": {"position_m": [0, 0]}},
        {"candidates": [{"position_m": [0, 0, 1e300], "theta_x_deg": 0, "theta_y_deg": 0}]},
        {"track": {"probability": 2.0}},
        {"selected": 7},
        {"frame": -1},
        {"schema": 99},
    ],
    ids=json.dumps,
)
def test_a_line_of_wrong_types_or_values_is_named_by_its_number(analysis, tmp_path, changed):
    path = tmp_path / "a.jsonl"
    path.write_bytes(line_of(analysis) + line_of(analysis, **changed) + line_of(analysis))
    with pytest.raises(FileError, match=r"a\.jsonl: line 2 does not follow schema 1 \(.{3,200}\)$"):
        read_lines(path)


def test_what_is_no_lines_is_refused(analysis, tmp_path):
    path = tmp_path / "a.jsonl"
    nested = line_of(analysis)[:-2] + b', "camera": ' + b'{"a": ' * 5000 + b"1" + b"}" * 5001 + b"\n"
    for content, words in (
        (b"", "has no lines"),
        (b"{}\n", "line 1 does not"),
        (b"[1]\n", "line 1 does not"),
        (nested, "line 1"),
    ):
        path.write_bytes(content)
        with pytest.raises(FileError, match=rf"a\.jsonl: {words}"):
            read_lines(path)
