"""Tables 2 to 4 of the paper: what was measured in the tank, the paper's estimates, and ours on rendered pictures."""

from __future__ import annotations

import numpy as np
from dockpose.app.export.reproduction.part import Cell, NumberTable, Part
from dockpose.paper.tables import COLUMNS, TABLES, Table
from dockpose.paper.tank.poses import DRAWS, Row, reproduce_row, table_dock

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
    lights = f"{table.lights} lights" if table.epnp is None else f"{table.lights} lights (2 of them red and 2 blue)"
    beside = "" if table.epnp is None else ", and of EPnP, which is told which light is which by the colours"
    return Part(
        key=f"table_{name}",
        title=f"Table {name}: measured and estimated poses, {table.lights} lights",
        paper=(
            f"Table {name} has {len(rows)} poses of a 30 cm ring of {lights} in a tank, measured by hand, and the "
            f"estimates of the paper's method{beside}. Its mean absolute errors, computed from the printed numbers, "
            f"are {_errors_in_words(table.mean_errors)}."
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
        "The ring at each measured pose, rendered in tank water with sensor noise by a pinhole camera of 700 px and "
        f"640 x 480 pixels, {DRAWS} pictures a pose with other rolls and noise, each through the whole pipeline. Mean "
        f"absolute errors over the {pictures} pictures: {_errors_in_words(np.nanmean(errors, axis=(0, 1)))}. The "
        f"right one of the two poses was chosen in {right} of {pictures}.{missing}"
    )
    if table.epnp is None:
        return text
    epnp = _absolute(table, [row.epnp for row in rows])
    gross = _is_gross(table, epnp)
    return text + (
        " EPnP, with the lights that the pipeline found and told apart by colour, has "
        f"{_errors_in_words(np.nanmean(epnp[~gross], axis=0))}, but for {gross.sum()} pictures in which an angle is "
        f"off by more than {GROSS_DEG:g} degrees or the range by more than 5 %, or it gave no pose."
    )


def _is_gross(table: Table, errors: np.ndarray) -> np.ndarray:
    """Which pictures (rows, draws) show another pose: angles or range far off, or none."""
    return ~((errors[..., 3:] < GROSS_DEG).all(axis=-1) & (errors[..., 2] < 0.05 * table.measured[:, 2, None]))


def _differs(table: Table, rows: list[Row]) -> str:
    ours = np.nanmean(_absolute(table, [row.ours for row in rows]), axis=(0, 1))
    ratio = table.mean_errors / ours
    return (
        "The two are not comparable as they stand. The paper's errors are of a real tank: a real lens, its "
        "calibration, a ring built by hand, and poses measured with tape and protractor, whose own errors count as "
        "the method's. Ours are of rendered pictures, in which camera, ring and pose are known exactly; they show "
        f"what the pictures allow, not what a tank would give. That alone may be why they are {ratio.min():.0f} to "
        f"{ratio.max():.0f} times smaller. What a believable camera and ring would add is in the part on the error "
        f"budget. {_scale(table)}"
    )


def _scale(table: Table) -> str:
    """What the signs of the printed errors of z say."""
    shares = 100 * (table.estimated - table.measured)[:, 2] / table.measured[:, 2]
    if min(shares) < 0 < max(shares):
        return "The printed errors of z have both signs: no wrong scale, as of diameter or focal length, made them all."
    mean = float(np.abs(shares).mean())
    text = (
        f"All printed estimates of z are too {'large' if shares[0] > 0 else 'small'}, by {mean:.1f} % on average, as "
        f"they would be with a diameter or a focal length that is wrong by as much: {3 * mean:.1f} mm of 30 cm."
    )
    if table.epnp is None:
        return text
    other = 100 * (table.epnp - table.measured)[:, 2] / table.measured[:, 2]
    if (np.sign(other) == np.sign(shares)).all():
        return text
    return text + (
        f" But both methods share diameter and focal length, and the paper's EPnP is off by {other.mean():+.1f} % on "
        "average, so that such a scale alone is not the reason."
    )


def _rounded(errors: np.ndarray) -> list[float]:
    """Errors to a micrometre and a ten-thousandth of a degree, which is more than anyone wants to know."""
    return np.round(errors, 4).tolist()


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
        lines += [[f"{number + 1} {who}", *np.round(values, 2).tolist()] for who, values in _who(table, rows, number)]
    caption = "Poses. Ours is the first picture of each; the CSV file of all pictures has more decimals."
    return NumberTable(f"table_{name}", caption, ["pose", *COLUMNS], lines, digits=5)


def _errors(name: str, table: Table, rows: list[Row]) -> NumberTable:
    lines: list[list[Cell]] = []
    for number, measured in enumerate(table.measured):
        for who, values in _who(table, rows, number):
            lines.append([f"{number + 1} {who}", *_rounded(values - measured)])
    ours = _absolute(table, [row.ours for row in rows])
    lines.append(["mean absolute: paper", *_rounded(table.mean_errors)])
    lines.append([f"mean absolute: ours, {DRAWS} pictures a pose", *_rounded(np.nanmean(ours, axis=(0, 1)))])
    if table.epnp is not None:
        epnp = _absolute(table, [row.epnp for row in rows])
        lines.append(["mean absolute: paper's EPnP", *_rounded(np.abs(table.epnp - table.measured).mean(axis=0))])
        lines.append(["mean absolute: our EPnP, all pictures", *_rounded(np.nanmean(epnp, axis=(0, 1)))])
        lines.append(["median absolute: our EPnP", *_rounded(np.nanmedian(epnp, axis=(0, 1)))])
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
