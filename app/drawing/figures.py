"""Matplotlib figures: made without a window, saved with text kept as text."""

import io
import threading
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # imported where it is used, since that takes half a second
    from matplotlib.figure import Figure

DPI = 150
_SETTINGS = {"svg.fonttype": "none", "pdf.fonttype": 42, "font.family": "DejaVu Sans", "font.size": 9.0}
_busy = threading.Lock()  # all threads share Matplotlib's settings


def new_figure(width_in: float, height_in: float, dpi: float = DPI, layout: Any = None) -> "Figure":
    """Return an empty white figure of that size in inches; ``layout`` is Matplotlib's."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), dpi=dpi, facecolor="white", layout=layout)


def to_png(figure: "Figure") -> bytes:
    """Return the figure as PNG at its own resolution."""
    return _saved(figure, "png", {"Software": None})


def to_svg(figure: "Figure", name: str = "figure") -> bytes:
    """Return the figure as SVG without a date; ``name`` keeps the identifiers of several figures on a page apart."""
    return _saved(figure, "svg", {"Date": None, "Creator": "dockpose"}, {"svg.hashsalt": name})


def to_pdf(figure: "Figure") -> bytes:
    """Return the figure as one page of PDF, with fonts embedded and no date."""
    return _saved(figure, "pdf", {"CreationDate": None, "Creator": "dockpose", "Producer": None})


def _saved(figure: "Figure", kind: str, metadata: dict[str, Any], more: dict[str, Any] | None = None) -> bytes:
    from matplotlib import rc_context

    memory = io.BytesIO()
    settings: Any = {**_SETTINGS, **(more or {})}
    with _busy, rc_context(settings):
        figure.savefig(memory, format=kind, metadata=metadata, dpi=figure.dpi)
    return memory.getvalue()
