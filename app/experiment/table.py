"""The running table of an experiment: "estimated (measured)" as in the paper's Tables 2 and 3, errors, mean and RMS."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dockpose.app.drawing.numbers import MISSING, QUANTITIES, number
from dockpose.app.experiment.row import Row


@dataclass(frozen=True)
class Summary:
    """How far the estimates of a session are off."""

    counts: tuple[int, ...]  # rows in which x, y, z, theta_x and theta_y were both estimated and measured
    means: tuple[float | None, ...]  # mean and root mean square of estimated minus measured, in centimetres and degrees
    rms: tuple[float | None, ...]  # mean and root mean square of estimated minus measured, in centimetres and degrees


@dataclass(frozen=True)
class Table:
    """Text for every cell: ``body`` has one row per frame, its number first and notes last, ``foot`` the summaries."""

    head: tuple[str, ...]
    body: tuple[tuple[str, ...], ...]
    foot: tuple[tuple[str, ...], ...]


def summary(rows: Sequence[Row]) -> Summary:
    """Mean and root mean square of the errors of all rows that have them."""
    columns = [[row.errors[index] for row in rows] for index in range(len(QUANTITIES))]
    known = [[error for error in column if error is not None] for column in columns]
    return Summary(
        tuple(len(errors) for errors in known),
        tuple(math.fsum(errors) / len(errors) if errors else None for errors in known),
        tuple(
            math.sqrt(math.fsum(error * error for error in errors) / len(errors)) if errors else None
            for errors in known
        ),
    )


def table(rows: Sequence[Row], *, with_errors: bool = True) -> Table:
    """Every number as people read it, with two decimals; ``with_errors`` adds five columns of them."""
    errors = [f"Δ{name}" for name in QUANTITIES] if with_errors else []
    # Summaries of errors stand below the columns of errors, if there are any.
    foot = tuple((name, *[""] * len(errors), *cells, "") for name, cells in summaries(rows).items())
    return Table(("No.", *QUANTITIES, *errors, "Notes"), tuple(_cells(row, with_errors) for row in rows), foot)


def summaries(rows: Sequence[Row]) -> dict[str, tuple[str, ...]]:
    """The cells of each summary, by its name."""
    total = summary(rows)
    counts = tuple(str(count) for count in total.counts)
    return {"Compared": counts, "Mean error": _signed(total.means), "RMS error": _plain(total.rms)}


def _cells(row: Row, with_errors: bool) -> tuple[str, ...]:
    pairs = [
        f"{found} ({true})" if true != MISSING else found
        for found, true in zip(_plain(row.estimated), _plain(row.measured), strict=True)
    ]
    return (str(row.number), *pairs, *(_signed(row.errors) if with_errors else ()), row.notes)


def _plain(values: Sequence[float | None]) -> tuple[str, ...]:
    return tuple(number(value, 2) for value in values)


def _signed(values: Sequence[float | None]) -> tuple[str, ...]:
    return tuple(number(value, 2, signed=True) for value in values)
