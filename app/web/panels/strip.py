"""The strip along the top of the page: where the dock is, how far to trust that, and with whose camera."""

from html import escape

import viser
from dockpose.app.drawing.colours import TRUST_COLOURS
from dockpose.app.drawing.numbers import deviation_words, place_words
from dockpose.app.export.words import status_line
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.in_force import in_force_words
from dockpose.app.state.tank import Tanks, tank_words
from dockpose.app.state.view import View
from dockpose.app.web.live import LivePage
from dockpose.app.web.widgets import Panel


def place_html(analysis: Analysis) -> str:
    """Return the trust, and the place of the dock in large letters above the numbers of the search."""
    found, trust = analysis.estimate, analysis.trust
    where = "No dock seen"
    if found.selected is not None:
        sigma_m = found.selected.sigma_position_m
        exact = deviation_words(None if sigma_m is None else sigma_m[2])
        where = "; ".join(filter(None, (place_words(found.selected), exact)))
    return (
        f'<div id="strip-trust" style="background: {TRUST_COLOURS[trust.colour]}">{escape(trust.verdict)}</div>'
        f'<div id="strip-place"><div id="place">{escape(where)}</div>'
        f'<div id="status-line" data-trust="{trust.colour}">{escape(status_line(found))}</div></div>'
    )


def origin_html(view: View, is_saved: bool, browsers: int) -> str:
    """Return the picture's name, My tank and whether it is in force, and how many browsers show the page."""
    state = "" if is_saved or not view.tank.name else " (changed since it was saved)"
    other = in_force_words(view)
    in_force = f' · <span id="in-force">{escape(other)}</span>' if other else ""
    told = escape(
        ". ".join(filter(None, (view.source, other, tank_words(view.tank))))
    )  # where there is no room for all
    several = f' · <span id="browsers">{browsers} browsers</span>' if browsers > 1 else ""
    return (
        f'<div id="strip-origin" title="{told}"><div><b id="source">{escape(view.source)}</b>{in_force}{several}</div>'
        f'<div id="tank">{escape(tank_words(view.tank))}{state}</div></div>'
    )


class StripPanel(Panel):
    """The strip; it stays in view whichever tabs are open."""

    def __init__(self, gui: viser.GuiApi, live: LivePage, tanks: Tanks) -> None:
        self._live, self._tanks = live, tanks
        live.place(gui, "strip")
        self._browsers, self._newest = 1, None

    def show(self, analysis: Analysis) -> None:
        """Put a result there."""
        self._newest: Analysis | None = analysis
        view = analysis.view
        origin = origin_html(view, self._tanks.is_saved(view.tank), self._browsers)
        self._live.put_html("strip", f'<div id="strip">{place_html(analysis)}{origin}</div>')

    def count_browsers(self, browsers: int) -> None:
        """Say how many browsers show the page, where it is more than one."""
        with self._live.held:
            before, self._browsers = self._browsers, max(1, browsers)
            if self._newest is not None and before != self._browsers:
                self.show(self._newest)
                self._live.send()
