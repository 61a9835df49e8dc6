"""Tables 2 to 4 of the paper: what was measured in the tank, the paper's estimates, and ours on rendered pictures."""

from __future__ import annotations

import numpy as np
from dockpose.app.export.reproduction.part import Cell, NumberTable, Part
from dockpose.paper.tables import COLUMNS, TABLES, Table
from dockpose.paper.tank import DRAWS, Row, reproduce_row, table_dock

GROSS_DEG = 5.0  # an angle that is off by more shows another pose, not a less exact one


def table_2(seed: int) -> Part:
    """Make Table 2."""
    return _part("2", seed)


def table_3(seed: int) -> Part:
    """Make Table 3."""
    return _part("3", seed)


def table_4(seed: int) -> Part:
    """Make Table 4."""
    return _part("4", seed)


def _part(name: str, seed: int) -> Part:
    return part_of(name, [reproduce_row(name, number, seed) for number in range(len(TABLES[name].measured))])


def part_of(name: str, rows: list[Row]) -> Part:
    """The part for one table, with its rows as they were reproduced."""
    table = TABLES[name]
    lights = f"{table.lights} lights" if table.epnp is None else f"{table.lights} lights, of which 2 red and 2 blue"
    beside = "" if table.epnp is None else ", and of EPnP, which is told which light is which by the colours"
    return Part(
        key=f"table_{name}",
        title=f"Table {name}: measured and estimated poses, {table.lights} lights",
        paper=(
            f"Table {name} has {len(rows)} poses of a 30 cm ring of {lights} in a tank, measured by hand, and the "
            f"estimates of the paper's method{beside}. Its mean absolute errors, computed from the printed numbers, are "
            f"{_errors_in_words(table.mean_errors)}."
        ),
        ours=_ours(table, rows),
        differs=_differs(table, rows),
        tables=[_values(name, table, rows), _errors(name, table, rows), _draws(name, rows)],
    )


def _errors_in_words(errors: np.ndarray) -> str:
    x, y, z, theta_x, theta_y = (f"{error:.2g}" for error in errors)
    return f"{x}, {y} and {z} cm in x, y and z, and {theta_x} and {theta_y} degrees in theta x and theta y"


def _absolute(table: Table, found: list[np.ndarray]) -> np.ndarray:
    """Absolute errors (rows, draws, 5); NaN where nothing was found."""
    return np.abs(np.array(found) - table.measured[:, None])


def _ours(table: Table, rows: list[Row]) -> str:
    errors = _absolute(table, [row.ours for row in rows])
    pictures, missed = errors.shape[0] * errors.shape[1], int(np.isnan(errors[..., 0]).sum())
    right = sum(int(row.right.sum()) for row in rows)
    missing = f" In {missed} no dock was found." if missed else ""
    text = (
        f"The ring at each measured pose, rendered in tank water with sensor noise by a pinhole camera of 700 px and 640 "
        f"x 480 pixels, {DRAWS} pictures a pose with other rolls and noise, each through the whole pipeline. Mean "
        f"absolute errors over the {pictures} pictures: {_errors_in_words(np.nanmean(errors, axis=(0, 1)))}. The right "
        f"one of the two poses was chosen in {right}.{missing}"
    )
    if table.epnp is None:
        return text
    epnp = _absolute(table, [row.epnp for row in rows])
    gross = _is_gross(epnp)
    return text + (
        " EPnP, with the lights that the pipeline found and told apart by colour, has "
        f"{_errors_in_words(np.nanmean(epnp[~gross], axis=0))}, but for {gross.sum()} pictures in which an angle is off "
        f"by more than {GROSS_DEG:g} degrees or the range by more than 5 %, or it gave no pose."
    )


def _is_gross(errors: np.ndarray) -> np.ndarray:
    """Which pictures (rows, draws) show another pose: angles or range far off, or none."""
    measured_z = np.array([row[2] for row in TABLES["4"].measured])
    return ~((errors[..., 3:] < GROSS_DEG).all(axis=-1) & (errors[..., 2] < 0.05 * measured_z[:, None]))


def _differs(table: Table, rows: list[Row]) -> str:
    ours = np.nanmean(_absolute(table, [row.ours for row in rows]), axis=(0, 1))
    ratio = table.mean_errors / ours
    signed = table.estimated - table.measured
    scale = 100 * float((signed[:, 2] / table.measured[:, 2]).mean())
    text = (
        "The two are not comparable as they stand. The paper's errors are of a real tank: a real lens, its calibration, "
        "a ring built by hand, and poses measured with tape and protractor, whose own errors count as the method's. Ours "
        "are of rendered pictures, in which camera, ring and pose are known exactly; they show what the pictures allow, "
        f"not what a tank would give. That alone may be why they are {ratio.min():.0f} to {ratio.max():.0f} times "
        "smaller. What a believable camera and ring would add is in the part on the error budget. The printed estimates "
        f"of z are {abs(scale):.1f} % too {'large' if scale > 0 else 'small'} on average"
    )
    if abs(scale) < 0.1:
        return text + "."
    return text + (
        f", as they would be with a diameter that is {3 * abs(scale):.1f} mm, or a focal length that is "
        f"{abs(scale):.1f} %, too {'large' if scale > 0 else 'small'}; the printed numbers cannot tell which."
    )


def _who(table: Table, rows: list[Row], number: int) -> list[tuple[str, np.ndarray]]:
    """The estimates (5,) of one pose; of ours the first picture's."""
    found = [("paper", table.estimated[number]), ("ours", rows[number].ours[0])]
    if table.epnp is not None:
        found += [("paper's EPnP", table.epnp[number]), ("our EPnP", rows[number].epnp[0])]
    return found


def _values(name: str, table: Table, rows: list[Row]) -> NumberTable:
    lines: list[list[Cell]] = []
    for number, measured in enumerate(table.measured):
        lines.append([f"{number + 1} measured", *measured.tolist()])
        lines += [[f"{number + 1} {who}", *values.tolist()] for who, values in _who(table, rows, number)]
    caption = "Poses. Ours is the first picture of each."
    return NumberTable(f"table_{name}", caption, ["pose", *COLUMNS], lines, digits=5)


def _errors(name: str, table: Table, rows: list[Row]) -> NumberTable:
    lines: list[list[Cell]] = []
    for number, measured in enumerate(table.measured):
        for who, values in _who(table, rows, number):
            lines.append([f"{number + 1} {who}", *(values - measured).tolist()])
    ours = _absolute(table, [row.ours for row in rows])
    lines.append(["mean absolute: paper", *table.mean_errors.tolist()])
    lines.append([f"mean absolute: ours, {DRAWS} pictures a pose", *np.nanmean(ours, axis=(0, 1)).tolist()])
    if table.epnp is not None:
        epnp = _absolute(table, [row.epnp for row in rows])
        lines.append(["mean absolute: paper's EPnP", *np.abs(table.epnp - table.measured).mean(axis=0).tolist()])
        lines.append(["mean absolute: our EPnP, all pictures", *np.nanmean(epnp, axis=(0, 1)).tolist()])
        lines.append(["median absolute: our EPnP", *np.nanmedian(epnp, axis=(0, 1)).tolist()])
    caption = "Errors: estimated minus measured."
    return NumberTable(f"table_{name}_errors", caption, ["pose", *COLUMNS], lines, digits=2)


def _draws(name: str, rows: list[Row]) -> NumberTable:
    lines: list[list[Cell]] = []
    for number, row in enumerate(rows, start=1):
        for draw in range(len(row.ours)):
            lines.append([number, draw + 1, "ours", *row.ours[draw].tolist()])
            if table_dock(name).colours:
                lines.append([number, draw + 1, "EPnP", *row.epnp[draw].tolist()])
    head = ["pose", "picture", "method", *COLUMNS]
    return NumberTable(f"table_{name}_pictures", "Estimates of all pictures.", head, lines, is_shown=False)
