"""A program that takes frames at full speed until it is killed, and the check of what it leaves."""

import csv
import hashlib
import json
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import yaml
from dockpose import estimate
from dockpose.app.experiment import Session
from dockpose.simulate import render
from PIL import Image

from tests.support.scenes import CAMERA, DOCK, random_scene

# Made once, in the server that the programs are forked from.
PICTURE = render(random_scene(2))[0]
FOUND = estimate(PICTURE, CAMERA, DOCK)


def take_until_killed(folder: str, confirmed: Connection) -> None:
    """Take up a session, or make it, and send the number of each row that is confirmed; first 0, to say it began."""
    confirmed.send_bytes(b"0")
    session = Session.open(folder) if (Path(folder) / "session.yaml").exists() else Session.create(folder)
    while True:
        row = session.take(PICTURE, FOUND, 'tank, "left"\n', measured_z_cm=110.0, notes="kill")
        confirmed.send_bytes(str(row.number).encode())


def faults(folder: Path, confirmed: set[int]) -> tuple[list[int], list[str]]:
    """Confirmed rows that are lost, and files that do not open, after a program was killed."""
    if not (folder / "session.yaml").exists():
        return sorted(confirmed), []
    bad = []
    rows = set()
    try:
        assert yaml.safe_load((folder / "session.yaml").read_text())["schema"] == 1
    except (ValueError, yaml.YAMLError, AssertionError, KeyError):
        bad.append("session.yaml")
    try:
        with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
        rows = {int(row["number"]) for row in table}
        checksums = {row["file"]: row["sha256"] for row in table}
        assert {row["notes"] for row in table} <= {"kill"}
    except (ValueError, AssertionError, KeyError):
        bad.append("results.csv")
        checksums = {}
    for path in sorted((folder / "frames").glob("[!.]*")):
        try:
            if path.suffix == ".json":
                assert json.loads(path.read_text())["schema"] == 1
            else:
                np.testing.assert_array_equal(np.asarray(Image.open(path)), PICTURE)
                known = checksums.get(f"frames/{path.name}")
                assert known is None or known == hashlib.sha256(path.read_bytes()).hexdigest()
        except (OSError, ValueError, AssertionError):
            bad.append(path.name)
    with_files = {number for number in rows if all((folder / f"frames/{number:04d}{end}").exists() for end in ENDS)}
    return sorted(confirmed - with_files), bad


ENDS = (".png", ".json")
