"""Tables 2 to 4 of the paper: measured in the tank, the paper's estimates, ours on rendered pictures; error budget."""

import functools

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREY, ORANGE, VERMILLION
from dockpose.app.export.parts import Cell, Part, Rows
from dockpose.app.export.reproduction.pictures import canvas
from dockpose.paper import error_budget as budgets
from dockpose.paper.error_budget import BOARD, ITEMS, VIEWS, Budget, poses_of_tables, reading_steps
from dockpose.paper.tables import COLUMNS, DRAWS, TABLES, Row, Table, reproduce_row
from matplotlib.figure import Figure

GROSS_DEG = 5.0  # an angle that is off by more shows another pose, not a less exact one
_PICTURES = {
    "quiet": "picture without noise",
    "noise": f"noise of {budgets.READ_NOISE_LEVELS:g} grey levels, and shot noise",
    "jpeg": f"JPEG of quality {budgets.JPEG_QUALITY}",
    "both": "noise and JPEG",
}
_NAMES = ("x", "y", "z", "theta x", "theta y")


def error_budget(seed: int) -> Part:
    """Make the error budget."""
    return budget_part(budgets.error_budget(seed))


def _made(name: str, seed: int) -> Part:
    return table_part(name, [reproduce_row(name, number, seed) for number in range(len(TABLES[name].measured))])


table_2, table_3, table_4 = (functools.partial(_made, name) for name in TABLES)


def table_part(name: str, rows: list[Row]) -> Part:
    """The part for one table, with its rows as they were reproduced."""
    table, errors = TABLES[name], _absolute(TABLES[name], [row.ours for row in rows])
    ours, pictures = np.nanmean(errors, axis=(0, 1)), errors.shape[0] * errors.shape[1]
    missed = int(np.isnan(errors[..., 0]).sum())
    ratio = table.mean_errors / ours
    values, off = _values_and_errors(table, rows, ours)
    return Part.of(
        f"table_{name}",
        {},
        {"main": values, "errors": off, "pictures": _pictures(table, rows)},
        like="tank",
        **{"name": name, "table": table, "poses": len(rows), "ours": ours, "missed": missed},
        draws=DRAWS,
        pictures=pictures,
        right=sum(int(row.right.sum()) for row in rows),
        least=ratio.min(),
        most=ratio.max(),
        scales=_scales(table, table.estimated),
        by_epnp=None if table.epnp is None else _by_epnp(table, rows),
        epnp_scales=None if table.epnp is None else _scales(table, table.epnp),
        gross_deg=GROSS_DEG,
    )


def _absolute(table: Table, found: list[np.ndarray]) -> np.ndarray:
    """Absolute errors (rows, draws, 5); NaN where nothing was found."""
    return np.abs(np.array(found) - table.measured[:, None])


def _by_epnp(table: Table, rows: list[Row]) -> tuple[np.ndarray, int]:
    """EPnP's errors (5,) but for pictures that show another pose, whose angle or range is far off; and how many."""
    errors = _absolute(table, [row.epnp for row in rows])
    gross = ~((errors[..., 3:] < GROSS_DEG).all(axis=-1) & (errors[..., 2] < 0.05 * table.measured[:, 2, None]))
    return np.nanmean(errors[~gross], axis=0), int(gross.sum())


def _scales(table: Table, found: np.ndarray) -> np.ndarray:
    """Signed errors (N,) of the printed z in per cent."""
    return 100 * (found - table.measured)[:, 2] / table.measured[:, 2]


def _rounded(name: str, errors: np.ndarray) -> list[Cell]:
    """A row of errors to a micrometre and a ten-thousandth of a degree, which is more than anyone wants to know."""
    return [name, *np.round(errors, 4).tolist()]


def _values_and_errors(table: Table, rows: list[Row], ours: np.ndarray) -> tuple[Rows, Rows]:
    """Each pose's estimates, of ours the first picture's; and how far they are off, also on average."""
    lines: list[list[Cell]] = [["pose", *COLUMNS]]
    errors = lines.copy()
    for number, (measured, row) in enumerate(zip(table.measured, rows, strict=True)):
        lines.append([f"{number + 1} measured", *measured.tolist()])
        who = {"paper": table.estimated[number], "ours": row.ours[0]}
        if table.epnp is not None:
            who |= {"paper's EPnP": table.epnp[number], "our EPnP": row.epnp[0]}
        lines += [[f"{number + 1} {name}", *np.round(values, 2).tolist()] for name, values in who.items()]
        errors += [_rounded(f"{number + 1} {name}", values - measured) for name, values in who.items()]
    means = {"mean absolute: paper": table.mean_errors, f"mean absolute: ours, {DRAWS} pictures a pose": ours}
    if table.epnp is not None:
        epnp = _absolute(table, [row.epnp for row in rows])
        means |= {
            "mean absolute: paper's EPnP": np.abs(table.epnp - table.measured).mean(axis=0),
            "mean absolute: our EPnP, all pictures": np.nanmean(epnp, axis=(0, 1)),
            "median absolute: our EPnP": np.nanmedian(epnp, axis=(0, 1)),
        }
    return lines, [*errors, *(_rounded(name, values) for name, values in means.items())]


def _pictures(table: Table, rows: list[Row]) -> Rows:
    lines: list[list[Cell]] = [["pose", "picture", "method", *COLUMNS]]
    for number, row in enumerate(rows, start=1):
        for draw, (ours, epnp) in enumerate(zip(row.ours.tolist(), row.epnp.tolist(), strict=True), start=1):
            lines.append([number, draw, "ours", *ours])
            if table.epnp is not None:
                lines.append([number, draw, "EPnP", *epnp])
    return lines


def budget_part(budget: Budget) -> Part:
    """The part for a budget."""
    together, reading, rounded, paper = _sums(budget).values()
    numbered = enumerate(budget.cameras, start=1)
    cameras = [[number, one.fx, one.fy, one.cx, one.cy, *one.distortion] for number, one in numbered]
    return Part.of(
        "error_budget",
        {"main": _figure(budget)},
        {"main": _budget_rows(budget), "tables": _by_table(budget), "calibrations": cameras},
        poses=len(poses_of_tables()[0]),
        paper=paper,
        **{"camera": budgets.CAMERA, "board": BOARD, "views": VIEWS, "budget": budget},
        sigma=dict(zip(("fx", "fy", "cx", "cy", "k1", "k2"), np.std(cameras, axis=0)[1:7].tolist(), strict=True)),
        together=together,
        largest_z=_largest(budget, 2),
        largest_angle=max(_largest(budget, 3), _largest(budget, 4), key=lambda one: one[1]),
        ignored=_rms(budget.items["ignored"]),
        steps=reading_steps(),
        reading=reading,
        rounded=rounded,
        worse=_worse(budget),
        pictures=_rms(budget.pictures["both"]),
    )


def _rms(errors: np.ndarray) -> np.ndarray:
    """Root mean squares (5,) over all but the last axis."""
    return np.sqrt(np.nanmean(errors.reshape(-1, 5) ** 2, axis=0))


def _largest(budget: Budget, column: int) -> tuple[str, float]:
    """What brings the largest error in a column, and how large it is; ignored distortion is a mistake."""
    errors = {words: float(_rms(budget.items[key])[column]) for key, words in ITEMS.items() if key != "ignored"}
    return max(errors.items(), key=lambda one: one[1])


def _mean_absolute(errors: np.ndarray) -> dict[str, np.ndarray]:
    """Mean absolute errors (5,) of each table, of errors (draws, 12, 5)."""
    ends = np.cumsum([len(table.measured) for table in TABLES.values()])
    parts = np.split(np.abs(errors), ends[:-1], axis=1)
    return {name: np.nanmean(part, axis=(0, 1)) for name, part in zip(TABLES, parts, strict=True)}


def _worse(budget: Budget) -> list[str]:
    """Where the believable camera and ring are worse than the paper."""
    ours = _mean_absolute(budget.together)
    return [
        f"{column} of Table {name} ({found:.2g} against {printed:.2g})"
        for name, table in TABLES.items()
        for column, found, printed in zip(_NAMES, ours[name], table.mean_errors, strict=True)
        if found > printed
    ]


def _sums(budget: Budget) -> dict[str, np.ndarray]:
    """Root mean square errors (5,) of all together, and what they are compared with."""
    together, reading = _rms(budget.together), reading_steps() / np.sqrt(12)
    return {
        "all together, without ignored distortion": together,
        "rounding of the measured values": reading,
        "all together, and rounding": np.hypot(together, reading),
        "the paper": _rms(poses_of_tables()[1]),
    }


def _budget_rows(budget: Budget) -> Rows:
    rows = {words: _rms(budget.items[key]) for key, words in ITEMS.items()}
    rows |= {words: _rms(budget.pictures[key]) for key, words in _PICTURES.items()} | _sums(budget)
    return [("what is off", *COLUMNS), *(_rounded(name, errors) for name, errors in rows.items())]


def _by_table(budget: Budget) -> Rows:
    rows: list[list[Cell]] = [["table", *COLUMNS]]
    believable, exact = _mean_absolute(budget.together), _mean_absolute(budget.pictures["both"])
    for name, table in TABLES.items():
        rows.append(_rounded(f"Table {name}: the paper", table.mean_errors))
        rows.append(_rounded(f"Table {name}: ours, believable camera and ring", believable[name]))
        rows.append(_rounded(f"Table {name}: ours, all known exactly, noise and JPEG", exact[name]))
    return rows


def _figure(budget: Budget) -> Figure:
    together, rounding, _, paper = _sums(budget).values()
    bars = [
        *((words, _rms(budget.items[key]), BLUE) for key, words in ITEMS.items()),
        (_PICTURES["both"], _rms(budget.pictures["both"]), BLUE),
        ("all together", together, ORANGE),
        ("rounding of the measured values", rounding, GREY),
        ("the paper", paper, VERMILLION),
    ]
    figure = canvas(8.0, 4.6)
    panels = figure.subplots(1, 5, sharey=True)
    places = np.arange(len(bars))
    for k, axes in enumerate(panels):
        axes.barh(places, [values[k] for _, values, _ in bars], color=[colour for _, _, colour in bars])
        axes.set_title(COLUMNS[k], fontsize=9)
        axes.set_xlim(0, 1.2 * max(values[k] for _, values, _ in bars))
        axes.locator_params(axis="x", nbins=3)
        axes.grid(axis="x", lw=0.4, color="0.85")
        axes.set_axisbelow(True)
    panels[0].set_yticks(places, [words for words, _, _ in bars])
    panels[0].invert_yaxis()
    figure.supxlabel("root mean square error", fontsize=9)
    return figure
