"""A part of the report on the paper: one of its figures or tables, beside ours."""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dockpose.app.drawing.figures import to_png, to_svg
from dockpose.camera.durable_files import write_whole
from markupsafe import Markup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float | None
MISSING = "–"


@dataclass(frozen=True)
class Plot:
    """A drawn figure."""

    name: str  # stem of its files
    caption: str  # one or two sentences below it
    png: bytes  # the files
    svg: bytes  # the files
    is_photograph: bool = False  # shown as PNG within the report, since an SVG would hold all pixels of a picture

    @classmethod
    def of(cls, name: str, caption: str, figure: Figure, *, is_photograph: bool = False) -> Plot:
        """Draw a figure."""
        _settle(figure)
        return cls(name, caption, to_png(figure), to_svg(figure, name), is_photograph)

    @property
    def inline(self) -> Markup:
        """What stands in the page."""
        if self.is_photograph:
            alt = Markup.escape(self.caption)
            uri = "data:image/png;base64," + base64.b64encode(self.png).decode()
            return Markup('<img alt="{}" src="{}">').format(alt, uri)
        text = self.svg.decode()
        return Markup(text[text.index("<svg") :])


def _settle(figure: Figure) -> None:
    """Lay a figure out once, and round where its axes lie.

    The last digits of a layout depend on where objects lie in memory, and the names within an SVG on those digits.
    """
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:
        left, bottom, width, height = axes.get_position(original=True).bounds
        axes.set_position((round(left, 6), round(bottom, 6), round(width, 6), round(height, 6)))


@dataclass(frozen=True)
class NumberTable:
    """A table of numbers: rounded in the page, whole in its CSV file."""

    name: str  # stem of its file
    caption: str  # what the rows are
    head: Sequence[str]  # names of the columns, with units
    rows: Sequence[Sequence[Cell]]  # text, numbers, and None where there is none
    digits: int = 3  # significant digits in the page
    is_shown: bool = True  # false for the points of a curve, which only the file has

    @property
    def shown(self) -> list[list[str]]:
        """The cells as the page has them."""
        return [[self._text(cell) for cell in row] for row in self.rows]

    def _text(self, cell: Cell) -> str:
        if cell is None or cell != cell:  # not a number
            return MISSING
        if isinstance(cell, float):
            return f"{cell:.{self.digits}g}" if abs(cell) < 10**self.digits else f"{cell:.0f}"
        return str(cell)


@dataclass(frozen=True)
class Part:
    """One figure or table of the paper, reproduced."""

    key: str  # of files and links, as ``figure_14``
    title: str  # as "Figure 14: error of the dock's centre against the level"
    paper: str  # what the paper shows
    ours: str  # what the paper shows
    differs: str  # what the paper shows
    plots: Sequence[Plot] = ()  # in the order in which they are shown
    tables: Sequence[NumberTable] = ()  # in the order in which they are shown

    def write(self, folder: Path) -> None:
        """Write each plot as PNG and SVG, and each table as CSV."""
        for plot in self.plots:
            write_whole(folder / f"{plot.name}.png", plot.png)
            write_whole(folder / f"{plot.name}.svg", plot.svg)
        for table in self.tables:
            text = io.StringIO(newline="")
            writer = csv.writer(text)
            writer.writerow(table.head)
            writer.writerows([["" if cell is None else cell for cell in row] for row in table.rows])
            write_whole(folder / f"{table.name}.csv", text.getvalue().encode())
