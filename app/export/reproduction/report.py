"""The report on the paper: all parts, made by several processes, in one HTML file that opens offline."""

from __future__ import annotations

import datetime
import importlib
from collections.abc import Callable
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path

import jinja2
from dockpose.app.errors import UserError, check_folder, writing
from dockpose.app.experiment.versions import versions
from dockpose.app.export.reproduction.part import Part
from dockpose.app.processing.parallel import workers
from dockpose.app.resources import static_path
from dockpose.camera.durable_files import write_whole

# Key of each part, in the order of the report, and the module here whose function of that name makes it.
PARTS: dict[str, str] = {
    "figure_3": "levels",
    "figure_5": "spread",
    "figure_6": "spread",
    "figure_7": "spread",
    "figure_8": "histograms",
    "figure_14": "levels",
    "figure_15": "methods",
    "figure_16": "levels",
    "figure_17": "number_of_lights",
    "table_1": "duality",
    "table_2": "tank_tables",
    "table_3": "tank_tables",
    "table_4": "tank_tables",
    "error_budget": "error_budget",
    "literal_hats": "literal",
}
# The slowest, which begin first.
_SLOW: tuple[str, ...] = ("table_1", "error_budget", "literal_hats", "figure_15")


@dataclass(frozen=True)
class Reproduction:
    """The report, ready to be written."""

    seed: int  # of all that is random in it
    parts: list[Part]  # in the order of the paper

    def html(self) -> str:
        """Return the text of the file."""
        environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
        template = environment.from_string(static_path("reproduction.html").read_text(encoding="utf-8"))
        made = datetime.datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")
        return template.render(report=self, made=made, versions=versions())


def make_part(key: str, seed: int) -> Part:
    """Make one part; see ``PARTS`` for the keys."""
    module = importlib.import_module(f"dockpose.app.export.reproduction.{PARTS[key]}")
    return getattr(module, key)(seed)


def reproduce(out: Path, seed: int, jobs: int, only: tuple[str, ...], done: Callable[[str], None]) -> Reproduction:
    """Make the report and its files in the folder ``out``."""
    for key in only:
        if key not in PARTS:
            raise UserError(f"there is no part {key!r}; there are {', '.join(PARTS)}")
    wanted = [key for key in PARTS if not only or key in only]
    check_folder(out, f"--out {out}")
    with writing(f"--out {out}"):
        out.mkdir(parents=True, exist_ok=True)
    parts: dict[str, Part] = {}
    with workers(jobs, None) as (executor, _):
        begun = sorted(wanted, key=lambda key: _SLOW.index(key) if key in _SLOW else len(_SLOW))
        waiting = {executor.submit(make_part, key, seed): key for key in begun}
        for future in as_completed(waiting):
            key = waiting[future]
            parts[key] = future.result()
            with writing(f"--out {out}"):
                parts[key].write(out)
            done(key)
    report = Reproduction(seed, [parts[key] for key in wanted])
    with writing(f"--out {out}"):
        write_whole(out / "index.html", report.html().encode())
    return report
