"""The report on the paper: all parts, made by several processes, in one HTML file that opens offline."""

import importlib
from collections.abc import Callable
from concurrent.futures import as_completed
from pathlib import Path

from dockpose.app.errors import UserError, check_folder, writing
from dockpose.app.export.parts import Part, page
from dockpose.app.processing.parallel import workers
from dockpose.app.resources import versions
from dockpose.files.durable_files import write_whole

# Key of each part, in the order of the report, and the module here whose function of that name makes it.
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


def make_part(key: str, seed: int) -> Part:
    """Make one part; see ``PARTS`` for the keys."""
    module = importlib.import_module(f"dockpose.app.export.reproduction.{PARTS[key]}")
    return getattr(module, key)(seed)


def reproduce(out: Path, seed: int, jobs: int, only: tuple[str, ...], done: Callable[[str], None]) -> None:
    """Write ``index.html`` and the files of each part, or of some, into a folder; ``done`` gets the key of each."""
    for key in only:
        if key not in PARTS:
            raise UserError(f"there is no part {key!r}; there are {', '.join(PARTS)}")
    wanted = [key for key in PARTS if not only or key in only]
    check_folder(out, f"--out {out}")
    with writing(f"--out {out}"):
        out.mkdir(parents=True, exist_ok=True)
    parts: dict[str, Part] = {}
    with workers(jobs, None) as (executor, _):
        begun = sorted(wanted, key=lambda key: key not in _SLOW)
        waiting = {executor.submit(make_part, key, seed): key for key in begun}
        for future in as_completed(waiting):
            key = waiting[future]
            parts[key] = future.result()
            with writing(f"--out {out}"):
                parts[key].write(out)
            done(key)
    html = page("reproduction.html", seed=seed, parts=[parts[key] for key in wanted], versions=versions())
    with writing(f"--out {out}"):
        write_whole(out / "index.html", html.encode())
