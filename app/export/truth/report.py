"""What a comparison with a trajectory says: in words, JSON, CSV, LaTeX as the paper's Tables 2 to 4, and HTML."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from dockpose.app.drawing.numbers import LATEX, MISSING, POSE_COLUMNS, QUANTITIES, number, percent
from dockpose.app.experiment.record import csv_text
from dockpose.app.export.bundle import Files, figure_files
from dockpose.app.export.data import latex_line, to_json
from dockpose.app.export.parts import sentences
from dockpose.app.export.report import annotated_uri, as_svg, data_uri, html_of
from dockpose.app.export.truth import plots
from dockpose.app.export.truth.results import Results
from dockpose.app.resources import versions, with_versions
from dockpose.truth import TrajectoryComparison
from dockpose.truth.trajectory import angles

_SHOWN = 12  # rows of the LaTeX table
_UNITS = np.array([100, 100, 100, np.degrees(1), np.degrees(1)])  # centimetres and degrees


@dataclass(frozen=True)
class Compared:
    """Results beside a trajectory."""

    name: str
    truth: str
    results: Results
    found: TrajectoryComparison

    @cached_property
    def report(self) -> dict[str, Any]:
        """All that was found, as ``--json`` writes it."""
        about = {"results": self.name, "truth": self.truth, "clock": self.results.clock}
        content = with_versions(about | self.found.to_dict())
        return content | {"notes": [*self.results.notes, *content["notes"]]}

    @property
    def told(self) -> list[str]:
        """What was found, in sentences."""
        dock = self.results.track.dock
        return sentences("compared.txt", "told", self.report, None if dock is None else dock.diameter)

    @property
    def bands(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Statistics of all frames reported, and of those in each band."""
        yield "all", self.report
        yield "the right pose", self.report["right"]
        for one in self.report["by_range"]:
            yield f"{one['from_m']:.3g} to {one['to_m']:.3g} m", one
        for one in self.report["by_tilt"]:
            yield f"tilt {one['from_deg']:.3g} to {one['to_deg']:.3g}°", one

    def table(self, kind: str) -> list[list[str]]:
        """A kind of error of each band as people read it: ``rms``, ``median`` or ``most_95``."""
        rows = [["frames", "count", *QUANTITIES]]
        for label, one in self.bands:
            values = [] if one[kind] is None else zip(one[kind].values(), (100, 100, 100, 1, 1), strict=True)
            cells = ["< truth" if value is None else number(scale * value, 3) for value, scale in values]
            cells = cells or [MISSING] * len(QUANTITIES)
            rows.append([label, str(one["count"]), *cells])
        return rows

    def held(self) -> list[list[str]]:
        """How often intervals hold in each band."""
        rows = [["frames", *(f"{share} %: {name.split(' (')[0]}" for share in (50, 95) for name in QUANTITIES), "nees"]]
        for label, one in self.bands:
            if one["within"] is not None:
                shares = [value for share in ("0.5", "0.95") for value in one["within"][share].values()]
                rows.append([label, *(percent(value, 0) for value in shares), number(one["nees"]["mean"], 2)])
        return rows

    @cached_property
    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Estimated and true poses (N, 5) in centimetres and degrees."""
        track = self.results.track
        estimated = np.column_stack([track.positions_m, angles(track.normals)]) * _UNITS
        return estimated, estimated - self.found.errors * _UNITS

    def frames_csv(self) -> str:
        """A row a frame."""
        found, (estimated, true) = self.found, self.poses
        numbers = np.column_stack([estimated, true, found.errors * _UNITS, found.sigmas * _UNITS])
        head = [f"{kind}{name}" for kind in ("", "true_", "error_", "sigma_") for name in POSE_COLUMNS]
        rows: list[Sequence[Any]] = [("time_s", *head, "is_fitted", "is_wrong_pose", "is_wrong_dock", "view")]
        flags = zip(found.is_fitted, found.is_wrong_pose, found.is_wrong_dock, found.views, strict=True)
        for time_s, values, (*ones, view) in zip(self.results.track.times_s, numbers, flags, strict=True):
            rows.append((time_s, *(None if x != x else round(x, 6) for x in values.tolist()), *map(int, ones), view))
        return csv_text(rows)

    def latex(self) -> str:
        """Measured and estimated poses of some frames, spread over the range, and the errors of all reported."""
        estimated, true = self.poses
        is_right = ~self.found.is_fitted & ~self.found.is_wrong_pose & ~self.found.is_wrong_dock
        rows = np.flatnonzero(is_right & np.isfinite(true).all(axis=1))
        rows = rows[np.argsort(true[rows, 2])]
        shown = rows[np.linspace(0, len(rows) - 1, min(_SHOWN, len(rows))).round().astype(int)]
        body = [latex_line([number(x, 2) for x in (*true[row], *estimated[row])]) for row in shown]
        blank, rms = [""] * 4, [cell.replace("< truth", MISSING) for cell in self.table("rms")[2][2:]]
        mean = [number(x, 3) for x in np.abs(estimated - true)[rows].mean(axis=0)] if len(rows) else [MISSING] * 5
        foot = [latex_line([name, *blank, *cells]) for name, cells in (("Mean absolute", mean), ("RMS", rms))]
        heads = " & ".join([rf"\multicolumn{{5}}{{c}}{{{name}}}" for name in ("Measured", "Estimated")])
        about = f"% of {len(rows)} frames {len(shown)} are shown; the RMS is less what the trajectory is off"
        begin = [about, r"\begin{tabular}{rrrrrrrrrr}", r"\hline"]
        head = [rf"{heads} \\", rf"{' & '.join((*LATEX, *LATEX))} \\", r"\hline"]
        return "\n".join([*begin, *head, *body, r"\hline", *foot, r"\hline", r"\end{tabular}"]) + "\n"

    def html(self) -> str:
        """The report, with plots and the worst frames."""
        tables = [
            {"title": title, "head": rows[0], "body": rows[1:], "note": note}
            for title, rows, note in (
                ("Root mean square error", self.table("rms"), "< truth: less than what the trajectory is off itself."),
                ("Median error", self.table("median"), ""),
                ("Error that 95 % stay below", self.table("most_95"), ""),
                ("Intervals that hold (%)", self.held(), "nees: squared error over what is claimed; 1 where it holds."),
            )
        ]
        drawn = [(title, as_svg(make(self.found, self.results), name)) for name, (title, make) in plots.FIGURES.items()]
        facts = {"Results": self.name, "Trajectory": self.truth, "Found": "\n".join(self.told)}
        return html_of(
            **{"title": f"{self.name} beside {self.truth}", "kind": "comparison", "note": "", "facts": facts},
            **{"tables": tables, "plots": drawn, "groups": {"Versions, of this report": versions()}},
            **{"pictures": list(self._worst()), "of_pictures": "Worst frames"},
        )

    def _worst(self) -> Iterator[tuple[str, str]]:
        """Caption and picture of the worst frames, as far as their source can be opened."""
        for one in self.report["worst_frames"]:
            off = f"{100 * one['distance_m']:.2f} cm and {one['angle_deg']:.2f}° off"
            try:
                image, line = self.results.whole(one["row"])
                uri = data_uri(image) if line is None else annotated_uri(image, line)
            except ValueError:
                continue
            yield f"at {one['time_s']:.3f} s: {off}", uri

    def files(self) -> Files:
        """All that can be written of it."""
        bands = [["frames", "kind", "count", *POSE_COLUMNS]]
        bands += [[row[0], kind, *row[1:]] for kind in ("rms", "median", "most_95") for row in self.table(kind)[1:]]
        return {
            "report.html": lambda: self.html().encode(),
            "compared.json": lambda: to_json(self.report),
            "frames.csv": lambda: self.frames_csv().encode(),
            "bands.csv": lambda: csv_text(bands).encode(),
            "table.tex": lambda: self.latex().encode(),
            **{name: make for stem in plots.FIGURES for name, make in self._figure(stem).items()},
        }

    def _figure(self, stem: str) -> Files:
        draw = plots.FIGURES[stem][1]
        return figure_files(stem, lambda: draw(self.found, self.results), "svg", "png")
