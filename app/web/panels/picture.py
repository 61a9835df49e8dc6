"""What was found in the picture: the strip along the top, words and a table; and the viewpoint of the 3D scene."""

from html import escape

from dockpose.app.drawing.colours import POSE_NAMES, STALE_COLOUR, TRUST_COLOURS
from dockpose.app.drawing.numbers import QUANTITIES, deviation_words, parts_words, place_words
from dockpose.app.export.words import advice, status_line, why_this_one
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.camera import in_force_words
from dockpose.app.state.tank import tank_words
from dockpose.app.state.view import View
from dockpose.app.web.html import pose_name, result_cells, row, sigma_cells, tab_link, table, wide_row
from dockpose.app.web.page import Page
from dockpose.app.web.widgets import Panel

NO_POSE = (
    f"No dock found here. Look at {tab_link('Compare', 'all methods')}, or try {tab_link('Detect', 'another level')}."
)
COLUMNS = (*QUANTITIES, "likely (%)", "error (px)")
STALE = '<div role="status">What is shown is old: the source gives no new picture.</div>'
EXPLANATION = (
    "Centre of the dock from the camera: x right, y down, z ahead. θx, θy: pitch and yaw, 0 if square on. "
    "Error: of the lights, root mean square."
)


def status_html(analysis: Analysis) -> str:
    """What was decided and why, and what to try; the verdict and the picture's name are for who hears it."""
    found, trust = analysis.shown, analysis.trust
    notes = analysis.view.notes[analysis.view.camera_of == "guess" :]  # of a guess the reasons tell already
    decided, _, more = f"{found.message} ".partition(". ")  # with a doubtful pose, the figures above say what
    why = f"<span class=why>{escape(why_this_one(found))}</span>" if trust.colour == "green" else ""
    words = " ".join(filter(None, (*trust.reasons, more.strip(), *notes, advice(found))))
    return (
        f'<div role="status"><span class="heard"><b id="trust" data-trust="{trust.colour}">{trust.verdict}</b> in '
        f"{escape(analysis.view.source)} ({found.width} × {found.height}).</span> "
        f"<span class={'heard' if trust.reasons else 'said'}>{escape(decided)}.</span> {why} {escape(words)}</div>"
    )


def table_html(analysis: Analysis) -> str:
    """Both candidates and, where they are known, the truth and the measured pose; sigma of the chosen one beneath."""
    found = analysis.shown
    rows, sigmas = [], ""
    for index, pose in enumerate(found.candidates):
        is_chosen = pose is found.selected
        if is_chosen and not analysis.view.assumed:
            sigmas = row(f"± {POSE_NAMES[index]}, one sigma", sigma_cells(pose))
        rows.append(row(pose_name(index, is_chosen), result_cells(pose), bold=is_chosen))
    for name, known in (("Truth", analysis.view.truth), ("Measured", analysis.view.measured)):
        if known is not None:
            rows.append(row(name, result_cells(known)))
    if not rows:
        rows.append(wide_row(NO_POSE, len(COLUMNS) + 1))
    return table("candidates", COLUMNS, rows, EXPLANATION, sigmas)


class ViewpointPanel(Panel):
    """The button of the 3D view, which moves only the browser it was pressed in."""

    table = "picture"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self.gui.add_html('<dockpose-name-next name="view-buttons"></dockpose-name-next>')
        self.add("button_group", "viewpoint", app.scene.fit, options=("Fit",))


def place_html(analysis: Analysis, stale_s: int = 0) -> str:
    """Return the trust, and the place of the dock in large letters above the words on it."""
    # Of a live source that gives nothing for so many seconds the age stands in place of the trust.
    found, trust = analysis.estimate, analysis.trust
    where, parts = "No dock seen", ""
    if found.selected is not None:
        sigma_m = None if analysis.view.assumed else found.selected.sigma_total_position_m
        exact = deviation_words(None if sigma_m is None else sigma_m[2])
        where = "; ".join(filter(None, (place_words(found.selected), exact)))
        if exact:
            parts = f"Of the range, one sigma in cm: {parts_words(found.selected, [2])[0]}"
    colour = f"{STALE_COLOUR}; color: #fff" if stale_s else TRUST_COLOURS[trust.colour]
    verdict = f"◷ No new picture for {stale_s} s" if stale_s else trust.verdict
    return (
        f'<div id="strip-trust" style="background: {colour}">{escape(verdict)}</div>'
        f'<div id="place" title="{escape(parts)}">{escape(where)}</div>{STALE if stale_s else status_html(analysis)}'
    )


def origin_html(view: View, is_saved: bool, browsers: int, line: str) -> str:
    """Return the picture's name, My tank and whether it is in force, how many browsers there are, and the search."""
    state = "" if is_saved or not view.tank.name else " (changed since it was saved)"
    other = in_force_words(view)
    made = ", simulated" if view.scene is not None or view.list_name == "samples" else ""
    in_force = made + (f' · <span id="in-force">{escape(other)}</span>' if other else "")
    several = f' · <span id="browsers">{browsers} browsers</span>' if browsers > 1 else ""
    return (
        f'<div id="strip-origin"><div><b id="source">{escape(view.source)}</b>{in_force}{several}</div>'
        f'<div id="tank">{escape(tank_words(view.tank))}{state}</div><div id="status-line">{escape(line)}</div></div>'
        '<button type="button" id="strip-size" aria-label="Large figures" title="Large figures">⤢</button>'
    )


class StripPanel(Panel):
    """The strip; it stays in view whichever tabs are open."""

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._browsers, self._newest, self._stale_s = 1, None, 0
        app.live.place("strip", self._html)

    def count_browsers(self, browsers: int) -> None:
        """Say how many browsers show the page, where it is more than one."""
        self._set(_browsers=max(1, browsers))

    def say_stale(self, seconds: int) -> None:
        """Say in place of the trust that no picture came for so long, and grey out the rest, until the next one."""
        self._set(_stale_s=seconds)

    def _set(self, **changes: int) -> None:
        with (live := self.app.live).held:
            is_same = changes.items() <= vars(self).items()
            vars(self).update(changes)
            if self._newest is not None and not is_same:
                live.put_html("strip", self._html(self._newest))
                live.send()

    def _html(self, analysis: Analysis) -> str:
        view = analysis.view
        if self._newest is not None and view.image is not self._newest.view.image:
            self._stale_s = 0
        self._newest: Analysis | None = analysis
        line = status_line(analysis.estimate)
        origin = origin_html(view, self.app.tanks.is_saved(view.tank), self._browsers, line)
        state = " data-stale" if self._stale_s else ""
        return f'<div id="strip"{state}>{place_html(analysis, self._stale_s)}{origin}</div>'
