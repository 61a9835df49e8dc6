"""Figures by Matplotlib: made without a window, and written with text that stays text."""

from __future__ import annotations

import io
import threading
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # it takes half a second to import, which whoever draws nothing need not wait for
    from matplotlib.figure import Figure

DPI = 150
_SETTINGS = {"svg.fonttype": "none", "pdf.fonttype": 42, "font.family": "DejaVu Sans", "font.size": 9.0}
_busy = threading.Lock()  # Matplotlib's settings are one for all threads


def new_figure(width_in: float, height_in: float, dpi: float = DPI) -> Figure:
    """Return an empty figure of that size in inches, on white paper."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), dpi=dpi, facecolor="white")


def to_png(figure: Figure) -> bytes:
    """The figure as PNG, at its own resolution."""
    return _saved(figure, "png", {"Software": None})


def to_svg(figure: Figure, name: str = "figure") -> bytes:
    """The figure as SVG. ``name`` goes into its identifiers, so that several fit into one page; no date is in it."""
    return _saved(figure, "svg", {"Date": None, "Creator": "dockpose"}, {"svg.hashsalt": name})


def to_pdf(figure: Figure) -> bytes:
    """The figure as PDF of one page, with fonts embedded and no date."""
    return _saved(figure, "pdf", {"CreationDate": None, "Creator": "dockpose", "Producer": None})


def _saved(figure: Figure, kind: str, metadata: dict[str, Any], more: dict[str, Any] | None = None) -> bytes:
    from matplotlib import rc_context

    memory = io.BytesIO()
    settings: Any = {**_SETTINGS, **(more or {})}
    with _busy, rc_context(settings):
        figure.savefig(memory, format=kind, metadata=metadata, dpi=figure.dpi)
    return memory.getvalue()
