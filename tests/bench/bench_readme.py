"""The README's figures, measured again: those of the study by fewer scenes, whose intervals must hold the README's."""

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest
from dockpose.app.cli import main
from dockpose.study.judge import PRODUCT, SUCCESS, WRONG_POSE
from dockpose.study.summary import FACTORS, Columns, Summary, columns_of, summary_of

ROOT = Path(__file__).resolve().parents[2]
SCENES, SEED = 400, 7  # other scenes than those of `make report`
ROUNDED = 0.5  # a figure of the README in per cent
SIGMAS = 3  # of the share of errors below the README's figure: chance exceeds them in 0.3 %


def figures(row: str) -> list[float]:
    """The numbers of the README's figure in the row that begins with these words."""
    (line,) = [line for line in (ROOT / "README.md").read_text(encoding="utf-8").splitlines() if line.startswith(row)]
    return [float(number) for number in re.findall(r"\d+(?:\.\d+)?", line.split("|")[2])]


@pytest.fixture(scope="module")
def columns(tmp_path_factory: pytest.TempPathFactory) -> Columns:
    folder = tmp_path_factory.mktemp("study")
    assert main(["study", "--scenes", str(SCENES), "--seed", str(SEED), "--out", str(folder)]) == 0
    return columns_of((folder / "study.csv").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def summary(columns: Columns) -> Summary:
    return summary_of(columns)


def meets(row: str, share: dict[str, float], said: list[float]) -> None:
    """Assert that one of the README's figures, in per cent and rounded, is within the interval of these scenes."""
    low, high = 100 * share["low"] - ROUNDED, 100 * share["high"] + ROUNDED
    print(f"\n{row}: README {said[0]:g} to {said[-1]:g} %, here {low:.1f} to {high:.1f} % of {share['count']}")
    assert low <= said[-1]
    assert high >= said[0]


def test_shares_of_the_study(summary: Summary):
    product = summary["methods"][PRODUCT]
    found, right, none = (
        "| docks found with the right",
        "| reported docks that are right",
        "| docks reported where there",
    )
    meets(found, product["success"], figures(found)[:1])
    meets(right, product["right_of_reported"], figures(right)[:1])
    meets(none, product["false_dock_without"], figures(none)[:1])
    held = "| 95 % intervals that hold"
    for name, share in summary["coverage"]["all"].items():
        meets(f"{held} {name}", share, figures(held))


@pytest.mark.parametrize("label", ["2 to 4", "12 to 20"])
def test_nine_in_ten_errors_are_below_what_is_said(columns: Columns, label: str):
    """The figure is a quantile of errors with a long tail, so that it is the errors below it that are counted."""
    factor = FACTORS["range_diameters"]
    is_in_bin = factor.bins_of(columns["range_diameters"]) == factor.labels.index(label)
    seen = is_in_bin & (columns["method"] == PRODUCT) & np.isin(columns["outcome"], (SUCCESS, WRONG_POSE))
    said = figures(f"| error, {label} diameters away")
    few = 0.9 - SIGMAS * math.sqrt(0.9 * 0.1 / seen.sum())
    for errors, most in zip((100 * columns["position_error_share"], columns["angle_error_deg"]), said, strict=True):
        below = float((errors[seen] <= most).mean())
        print(f"\n{label}: {100 * below:.0f} % of {seen.sum()} errors below {most} (asked {100 * few:.0f})")
        assert below >= few


def test_the_tank(tmp_path: Path):
    """From the seed of `make report`, so that each digit is the same."""
    assert main(["reproduce", "--only", "error_budget", "--out", str(tmp_path)]) == 0
    rows = {row[0]: [float(cell) for cell in row[1:]] for row in table(tmp_path, "error_budget")}
    for row, of in (
        ("| the paper's 12 tank poses, exact camera", "noise and JPEG"),
        ("| the same, camera and ring a little off", "all together, without ignored distortion"),
        ("| the paper's own method, real tank", "the paper"),
    ):
        print(f"\n{row}: README {figures(row)}, here {rows[of]}")
        for said, measured in zip(figures(row), rows[of], strict=True):
            digits = len(f"{said:g}".partition(".")[2])
            assert said == pytest.approx(measured, abs=0.5001 * 10**-digits)


def table(folder: Path, name: str) -> list[list[str]]:
    """The rows of a table below its head."""
    with next(folder.rglob(f"{name}.csv")).open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))[1:]
