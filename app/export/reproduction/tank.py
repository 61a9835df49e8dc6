"""Tables 2 to 4 of the paper: measured in the tank, the paper's estimates, ours on rendered pictures; error budget."""

import functools
import math
from collections.abc import Mapping
from operator import itemgetter

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREY, ORANGE, VERMILLION
from dockpose.app.export.parts import Cell, Part
from dockpose.app.export.plots import canvas
from dockpose.paper import error_budget as budgets
from dockpose.paper.error_budget import CAMERA, ITEMS, PICTURES_OF, poses_of_tables
from dockpose.paper.tables import COLUMNS, DRAWS, TABLES, reproduced

GROSS_DEG = 5.0  # an angle that is off by more shows another pose, not a less exact one


def _table(name: str, seed: int) -> Part:
    """One table: each pose's estimates, of ours the first picture's; and how far they are off, also on average."""
    table = TABLES[name]
    ours, epnp, right = map(np.array, zip(*reproduced(name, seed), strict=True))  # (rows, DRAWS, 5), and (rows, DRAWS)
    off, off_epnp = (np.abs(found - table.measured[:, None]) for found in (ours, epnp))
    mean = np.nanmean(off, axis=(0, 1))
    means = {"paper": table.mean_errors, f"ours, {DRAWS} pictures a pose": mean}
    who, each = {"paper": table.estimated, "ours": ours[:, 0]}, {"ours": ours}
    medians: dict[str, np.ndarray] = {}
    by_epnp = None
    if table.epnp is not None:
        who |= {"paper's EPnP": table.epnp, "our EPnP": epnp[:, 0]}
        each["EPnP"] = epnp
        means["paper's EPnP"] = np.abs(table.epnp - table.measured).mean(axis=0)
        means["our EPnP, all pictures"] = np.nanmean(off_epnp, axis=(0, 1))
        medians = {"median absolute: our EPnP": np.nanmedian(off_epnp, axis=(0, 1))}
        # But for pictures that show another pose, whose angle or range is far off, or none.
        is_good = (off_epnp[..., 3:] < GROSS_DEG).all(axis=-1) & (off_epnp[..., 2] < 0.05 * table.measured[:, 2, None])
        by_epnp = np.nanmean(off_epnp[is_good], axis=0), int((~is_good).sum())
    values, errors, pictures = [], [], []  # rows
    for k, measured in enumerate(table.measured):
        values += _rounded({f"{k + 1} measured": measured}, 2)
        values += _rounded({f"{k + 1} {name}": found[k] for name, found in who.items()}, 2)
        errors += _rounded({f"{k + 1} {name}": found[k] - measured for name, found in who.items()})
        for draw in range(DRAWS):
            pictures += [[k + 1, draw + 1, name, *found[k, draw].tolist()] for name, found in each.items()]
    errors += _rounded({f"mean absolute: {name}": one for name, one in means.items()} | medians)
    return Part.of(
        f"table_{name}",
        {},
        {"main": values, "errors": errors, "pictures": pictures},
        like="tank",
        **{"name": name, "table": table, "poses": len(table.measured), "ours": mean},
        missed=int(np.isnan(off[..., 0]).sum()),
        pictures=right.size,
        right=int(right.sum()),
        by_epnp=by_epnp,
    )


table_2, table_3, table_4 = (functools.partial(_table, name) for name in TABLES)


def _rounded(poses: Mapping[str, np.ndarray], digits: int = 4) -> list[list[Cell]]:
    """Rows of numbers (5,); four digits are a micrometre, which is more than anyone wants to know."""
    return [[name, *np.round(of, digits).tolist()] for name, of in poses.items()]


def error_budget(seed: int) -> Part:
    """The error budget; half a minute of computing."""
    measured, of_paper, _ = poses_of_tables()
    corner_px = budgets.rendered_calibration(CAMERA, seed).error_px / math.sqrt(2)
    found = budgets.calibrations(CAMERA, budgets.CALIBRATIONS, corner_px, seed)
    of_pictures = {words: budgets.errors_of_pictures(seed, **sensor) for words, sensor in PICTURES_OF.items()}
    exact, centroid_px = of_pictures["noise and JPEG"]
    pictures = {words: _rms(errors) for words, (errors, _) in of_pictures.items()}
    items = {words: _rms(budgets.errors_of((key,), found, 0.0, seed)) for key, words in ITEMS.items()}
    believable = budgets.errors_of(budgets.TOGETHER, found, centroid_px, seed)
    steps = np.array([_step(group) for group in (*[measured[:, :3]] * 3, *[measured[:, 3:]] * 2)])
    together, rounding, paper = _rms(believable), steps / np.sqrt(12), _rms(of_paper)
    sums = {
        "all together, without ignored distortion": together,
        "rounding of the measured values": rounding,
        "all together, and rounding": np.hypot(together, rounding),
        "the paper": paper,
    }
    bars = [
        *((words, of, BLUE) for words, of in items.items()),
        ("noise and JPEG", pictures["noise and JPEG"], BLUE),
        ("all together", together, ORANGE),
        ("rounding of the measured values", rounding, GREY),
        ("the paper", paper, VERMILLION),
    ]
    figure = canvas(8.0, 4.6)
    panels = figure.subplots(1, 5, sharey=True)
    for k, axes in enumerate(panels):
        axes.barh(range(len(bars)), [of[k] for _, of, _ in bars], color=[colour for _, _, colour in bars])
        axes.set_title(COLUMNS[k], fontsize=9)
        axes.set_xlim(0, 1.2 * max(of[k] for _, of, _ in bars))
        axes.locator_params(axis="x", nbins=3)
        axes.grid(axis="x", lw=0.4, color="0.85")
        axes.set_axisbelow(True)
    panels[0].set_yticks(range(len(bars)), [words for words, _, _ in bars])
    panels[0].invert_yaxis()
    figure.supxlabel("root mean square error", fontsize=9)
    of_tables, of_exact, by_table = _mean_absolute(believable), _mean_absolute(exact), {}
    for name, table in TABLES.items():
        by_table[f"Table {name}: the paper"] = table.mean_errors
        by_table[f"Table {name}: ours, believable camera and ring"] = of_tables[name]
        by_table[f"Table {name}: ours, all known exactly, noise and JPEG"] = of_exact[name]
    cameras = [[k, one.fx, one.fy, one.cx, one.cy, *one.distortion] for k, one in enumerate(found, start=1)]
    # What brings the largest error in z, and in an angle; ignored distortion is a mistake.
    largest = [
        max(((w, of[k]) for w, of in items.items() if w != ITEMS["ignored"]), key=itemgetter(1)) for k in (2, 3, 4)
    ]
    return Part.of(
        "error_budget",
        {"main": figure},
        {
            "main": _rounded(items | pictures | sums),
            "tables": _rounded(by_table),
            "calibrations": cameras,
        },
        poses=len(measured),
        views=budgets.VIEWS,
        sigma_fx=float(np.std([one.fx for one in found])),
        paper=paper,
        together=together,
        largest_z=largest[0],
        largest_angle=max(largest[1:], key=itemgetter(1)),
        ignored=items[ITEMS["ignored"]],
        pictures=pictures["noise and JPEG"],
    )


def _rms(errors: np.ndarray) -> np.ndarray:
    """Root mean squares (5,) over all but the last axis."""
    return np.sqrt(np.nanmean(errors.reshape(-1, 5) ** 2, axis=0))


def _step(values: np.ndarray) -> float:
    """The largest of the usual steps in which these values are printed, in centimetres or degrees."""
    return next(step for step in (1.0, 0.5, 0.1) if np.allclose(values / step, np.rint(values / step)))


def _mean_absolute(errors: np.ndarray) -> dict[str, np.ndarray]:
    """Mean absolute errors (5,) of each table, of errors (draws, 12, 5)."""
    ends = np.cumsum([len(table.measured) for table in TABLES.values()])
    parts = np.split(np.abs(errors), ends[:-1], axis=1)
    return {name: np.nanmean(part, axis=(0, 1)) for name, part in zip(TABLES, parts, strict=True)}
