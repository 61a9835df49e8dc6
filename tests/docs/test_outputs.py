"""The page on outputs names each field that the program writes, and no other."""

import dataclasses
import re

import numpy as np
import pytest
from dockpose import Dock, Entrance, Mount, Tracker, Vehicle, estimate
from dockpose.app.commands.compare import to_line
from dockpose.app.experiment.record import COLUMNS
from dockpose.app.export.data import CSV_COLUMNS
from dockpose.app.export.recordings.ros import TOPICS
from dockpose.app.export.truth.report import Compared
from dockpose.app.export.truth.results import Results
from dockpose.app.inputs.pictures import load_sample
from dockpose.camera.image import read
from dockpose.estimate import SCHEMA
from dockpose.sidecar import sample_path
from dockpose.simulate.files import TRUTH_COLUMNS
from dockpose.tracking.tracker import NO_TRACK
from dockpose.truth import compare_trajectory

from tests.docs.conftest import CAMERA, DOCK
from tests.docs.pages import DOCS, first_columns
from tests.support.moving import draw

PAGE = DOCS / "outputs.md"
LIKE_CHOSEN = ("predicted", "filtered")
VEHICLE, WITH_ENTRANCE = Vehicle(T_body_camera=Mount()), Dock(0.30, 10, entrance=Entrance())


def fields(value, path=""):
    """Names of all fields, with dots between a field and its own, and [] for each of a list."""
    if isinstance(value, dict):
        for name, one in value.items():
            yield from fields(one, f"{path}.{name}" if path else name)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield from fields(value[0], f"{path}[]")
    else:
        yield path


@pytest.fixture(scope="module")
def written():
    """Fields of a tracked frame."""
    tracked = Tracker(CAMERA, WITH_ENTRANCE).see(read(sample_path("tilted")), 0.0)
    line = tracked.to_dict("tilted.png", 0, 0.0, vehicle=VEHICLE)
    # No sample has a second ring in view.
    line["rivals"] = [{"lights": 8, "centre_px": [0.0, 0.0], "range_m": 1.0, "sigma_range_m": 0.1}]
    others = tuple(f"{one}." for one in (*LIKE_CHOSEN, "entrance", "dock.entrance"))
    return {name for name in fields(line) if not name.startswith(others)}


def test_fields_of_json_lines(written):
    told = set(first_columns(PAGE, "JSON lines")) | set(first_columns(PAGE, "A sequence"))
    chosen = {name for name in written if name.startswith("chosen.")}
    chosen |= {name for name in written if name.startswith("vehicle.")}
    assert written - chosen <= told
    # Those of the chosen pose and of the vehicle stand in the second column.
    assert chosen <= set(re.findall(r"`([^`]+)`", PAGE.read_text(encoding="utf-8")))
    parents = {name.rsplit(".", 1)[0] for name in written if "." in name}
    assert told <= written | parents | {*LIKE_CHOSEN, "entrance", "dock.entrance", "by_hand.lights_px", "by_hand.snap"}


def test_fields_of_a_rival_are_those_that_are_written():
    found = estimate(read(sample_path("tilted")), CAMERA, DOCK)
    assert found.ring is not None
    found = dataclasses.replace(found, ring=dataclasses.replace(found.ring, rivals=(found.ring.on_ring,)))
    (rival,) = found.to_dict()["rivals"]
    assert set(rival) == {"lights", "centre_px", "range_m", "sigma_range_m"}


def test_fields_of_a_sequence():
    assert set(NO_TRACK) <= set(first_columns(PAGE, "A sequence"))


def test_the_schema():
    assert f"\nIt is {SCHEMA}. " in PAGE.read_text(encoding="utf-8")


def test_columns_of_csv():
    told = set(first_columns(PAGE, "CSV"))
    told |= {f"b{name[1:]}" for name in told if name.startswith("a_")}
    told |= {f"{pose}{name[6:]}" for name in told if name.startswith("chosen_") for pose in LIKE_CHOSEN}
    assert told == set(CSV_COLUMNS)


def test_fields_of_compare():
    picture = load_sample("tilted")
    line = to_line(picture, {"hats": estimate(picture.image, CAMERA, DOCK)})
    assert set(first_columns(PAGE, "Compare")) == {*line, *line["methods"]["hats"]}


def test_topics():
    text = PAGE.read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| `(/[\w/]+)` \| `(\w+/msg/\w+)` \|", text, re.MULTILINE))
    assert told == TOPICS


def test_columns_of_a_session():
    assert set(COLUMNS) <= set(first_columns(PAGE, "A session"))
    files = {"session.yaml", "results.csv", "frames/0001.png", "frames/0001.json"}
    assert set(first_columns(PAGE, "A session")) <= set(COLUMNS) | files


def test_columns_of_the_truth():
    assert set(first_columns(PAGE, "The simulator")) == set(TRUTH_COLUMNS)


def test_fields_of_a_comparison():
    moved = draw(1, duration_s=30.0, gaps=0)
    results = Results(moved.results, "time_s", (), [], lambda row: (np.zeros((1, 1), np.uint8), None))
    report = Compared("film.jsonl", "truth.txt", results, compare_trajectory(moved.results, moved.truth)).report
    assert set(first_columns(PAGE, "Against a trajectory")) == set(report)
