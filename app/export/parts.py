"""Parts of the reports on the paper and the study, with their words, plots and tables; and the page of any report."""

import datetime
import functools
import importlib
import math
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import jinja2
from dockpose.app.drawing.figures import to_png, to_svg
from dockpose.app.drawing.numbers import MISSING, number, sigma_words
from dockpose.app.errors import UserError, check_folder, writing
from dockpose.app.experiment.record import csv_text
from dockpose.app.processing.parallel import workers
from dockpose.app.resources import read_toml, static_path, versions
from dockpose.files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float | None
Rows = Sequence[Sequence[Cell]]
_VERDICTS = ("better", "worse", "open")
# Key of each part, in the order of the report, and the module of reproduction whose function of that name makes it.
PARTS: dict[str, str] = {
    "figure_3": "levels",
    "figure_5": "spread",
    "figure_6": "spread",
    "figure_7": "spread",
    "figure_8": "levels",
    "figure_14": "levels",
    "figure_15": "methods",
    "figure_16": "levels",
    "figure_17": "poses",
    "table_1": "poses",
    "table_2": "tank",
    "table_3": "tank",
    "table_4": "tank",
    "error_budget": "tank",
    "literal_hats": "methods",
}
_SLOW = ("table_1", "error_budget", "literal_hats", "figure_15")  # these begin first


@functools.cache
def _pages() -> jinja2.Environment:
    loader = jinja2.FunctionLoader(lambda name: static_path(name).read_text(encoding="utf-8"))
    escape = jinja2.select_autoescape(["html"], default_for_string=False)
    how: Any = {"autoescape": escape, "undefined": jinja2.StrictUndefined}
    pages = jinja2.Environment(loader=loader, trim_blocks=True, lstrip_blocks=True, **how)
    pages.filters |= {"is_finite": math.isfinite, "listed": listed, "number": number, "sigma_words": sigma_words}
    # A text as Markdown shows it to the letter.
    pages.filters["plain"] = functools.partial(re.sub, r"([\\`*_<>|])", r"\\\1")
    return pages


def page(template: str, **values: Any) -> str:
    """What a template in ``static`` says; one of HTML extends ``base.html`` and escapes every text."""
    made = datetime.datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")
    return _pages().get_template(template).render(made=made, **values)


def sentences(template: str, macro: str, *values: Any) -> list[str]:
    """What a macro of a template in ``static`` says, in paragraphs with empty lines between them."""
    return _paragraphs(getattr(_pages().get_template(template).module, macro)(*values))


def _paragraphs(text: str) -> list[str]:
    return [" ".join(one.split()) for one in re.split(r"\n\s*\n", text) if one.strip()]


def words(part: str, *path: str, **numbers: Any) -> str:
    """A text of ``parts.toml`` with its numbers in it; none where there is no such text."""
    found: Any = read_toml("parts.toml")[part]
    for name in path:
        found = found.get(name, "")
    return _filled(found, numbers)


def _filled(text: str, numbers: Mapping[str, Any]) -> str:
    """A text with its numbers in it, a paragraph a line; ``say`` is ``parts.txt``."""
    return "\n".join(_paragraphs(_pages().from_string('{% import "parts.txt" as say %}' + text).render(numbers)))


def listed(names: Sequence[str]) -> str:
    """Names as "a, b and c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def verdict(difference: Mapping[str, Any]) -> str:
    """Whether the first method is "better" or "worse" with 95 % confidence; "open" where the interval holds 0."""
    if difference["value"] is None:
        return "open"
    return "better" if difference["low"] > 0 else "worse" if difference["high"] < 0 else "open"


def by_verdict(differences: Mapping[str, Mapping[str, Any]]) -> dict[str, list[str]]:
    """Names of differences by their verdict; no verdict without any."""
    sorts = {sort: [name for name, one in differences.items() if verdict(one) == sort] for sort in _VERDICTS}
    return {sort: names for sort, names in sorts.items() if names}


@dataclass(frozen=True)
class Plot:
    """A drawn figure."""

    name: str  # stem of its files
    caption: str  # one or two sentences below it
    png: bytes
    svg: bytes
    is_photograph: bool = False

    @classmethod
    def of(cls, name: str, caption: str, figure: "Figure") -> "Plot":
        """Draw a figure; one that shows pictures is a photograph."""
        _settle(figure)
        is_photograph = any(axes.images for axes in figure.axes)
        return cls(name, caption, to_png(figure), to_svg(figure, name), is_photograph)

    @property
    def file(self) -> str:
        """The file that a page shows; an SVG of a photograph would hold all its pixels."""
        return f"{self.name}.{'png' if self.is_photograph else 'svg'}"


def _settle(figure: "Figure") -> None:
    """Lay a figure out once, and round where its axes lie: the last digits depend on where objects lie in memory."""
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    for axes in figure.axes:
        left, bottom, width, height = axes.get_position(original=True).bounds
        axes.set_position((round(left, 6), round(bottom, 6), round(width, 6), round(height, 6)))


@dataclass(frozen=True)
class NumberTable:
    """A table of numbers: whole in its CSV file, and rounded on the page where it has a caption."""

    name: str  # stem of its file
    head: Sequence[str]  # names of the columns, with units
    rows: Rows
    caption: str = ""  # what the rows are
    digits: int = 3  # significant digits in the page

    @classmethod
    def of(cls, part: str, table: str, name: str, rows: Rows, /, **numbers: Any) -> "NumberTable":
        """A table with the words of ``parts.toml``; its first row is its head where it has none there."""
        of = read_toml("parts.toml")[part].get("tables", {}).get(table, {})
        head, *body = rows if "head" not in of else (of["head"], *rows)
        filled = [_filled(str(cell), numbers) for cell in head]
        return cls(name, filled, body, _filled(of.get("caption", ""), numbers), of.get("digits", 3))

    @property
    def shown(self) -> list[list[str]]:
        """The cells as the page has them."""
        return [[self._text(cell) for cell in row] for row in self.rows]

    def _text(self, cell: Cell) -> str:
        if cell is None or cell != cell:  # not a number
            return MISSING
        if isinstance(cell, float):
            text = f"{cell:.{self.digits}g}"
            return f"{cell:.0f}" if "e+" in text else text
        return str(cell)


@dataclass(frozen=True)
class Part:
    """One figure or table of the paper, reproduced, or one section of the study."""

    key: str  # of files and links, as ``figure_14``
    title: str  # as "Figure 14: error of the dock's centre against the level"
    text: str  # what it shows, in numbers; a paragraph a line
    plots: Sequence[Plot] = ()
    tables: Sequence[NumberTable] = ()

    @classmethod
    def of(
        cls, key: str, plots: "Mapping[str, Figure]", tables: Mapping[str, Rows], /, like: str = "", **numbers: Any
    ) -> "Part":
        """A part with the words of its key, or of what it is ``like``; its main files have the key for their name."""
        like = like or key
        names = {name: key if name == "main" else f"{key}_{name}" for name in (*plots, *tables)}
        drawn = [Plot.of(names[name], words(like, "plots", name, **numbers), one) for name, one in plots.items()]
        listed = [NumberTable.of(like, name, names[name], rows, **numbers) for name, rows in tables.items()]
        return cls(key, words(like, "title", **numbers), words(like, "text", **numbers), drawn, listed)

    def write(self, folder: Path) -> None:
        """Write each plot as PNG and SVG, and each table as CSV."""
        for plot in self.plots:
            write_whole(folder / f"{plot.name}.png", plot.png)
            write_whole(folder / f"{plot.name}.svg", plot.svg)
        for table in self.tables:
            write_whole(folder / f"{table.name}.csv", csv_text([table.head, *table.rows], "\r\n").encode())


def make_part(key: str, seed: int) -> Part:
    """Make one part; see ``PARTS`` for the keys. Runs in a worker."""
    cv2.setNumThreads(1)  # several add up the same numbers in another order each time, which changes the last digits
    module = importlib.import_module(f"dockpose.app.export.reproduction.{PARTS[key]}")
    return getattr(module, key)(seed)


def reproduce(out: Path, seed: int, jobs: int, only: tuple[str, ...], done: Callable[[str], None]) -> Path:
    """Write the report and the files of each part, or of some; ``done`` gets the key of each. Returns its path."""
    for key in only:
        if key not in PARTS:
            raise UserError(f"there is no part {key!r}; there are {', '.join(PARTS)}")
    wanted = [key for key in PARTS if not only or key in only]
    make_folder(out)
    parts: dict[str, Part] = {}
    with workers(jobs) as (executor, _):
        waiting = {executor.submit(make_part, key, seed): key for key in sorted(wanted, key=lambda k: k not in _SLOW)}
        for future in as_completed(waiting):
            key = waiting[future]
            parts[key] = future.result()
            with writing(f"--out {out}"):
                parts[key].write(out)
            done(key)
    return write_page(out / "paper.md", [parts[key] for key in wanted], seed=seed)


def make_folder(out: Path) -> None:
    """Make the folder of a report. Raises UserError where nothing can be put there."""
    check_folder(out, f"--out {out}")
    with writing(f"--out {out}"):
        out.mkdir(parents=True, exist_ok=True)


def write_page(path: Path, parts: Sequence[Part], **about: Any) -> Path:
    """Write a report's page by the template of its name, and return its path."""
    text = page(path.name, parts=parts, versions=versions(), **about)
    with writing(f"--out {path.parent}"):
        write_whole(path, f"{text.strip()}\n".encode())
    return path
