"""Calibrate on the page: gather boards from what is shown or uploaded, fit the camera, and use it."""

import base64
import contextlib
import itertools
import re
import tempfile
import threading
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import viser
from dockpose import Camera
from dockpose.app.drawing.colours import BLUE, bgr
from dockpose.app.errors import UserError
from dockpose.app.export.words import MEDIA, camera_lines, outcome
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import LatestWorker, Progress
from dockpose.app.state.camera import camera_file, with_calibrated_camera
from dockpose.app.web.choices import Client
from dockpose.app.web.html import help_link, name_around, small
from dockpose.app.web.page import Page
from dockpose.app.web.widgets import Panel
from dockpose.camera import mark
from dockpose.camera.board import Board, Sighting, count_squares
from dockpose.camera.calibrate import BoardView, Calibration, Gathering, calibrate_gathered
from dockpose.camera.coverage import Coverage, coverage_of
from dockpose.camera.image import decode, to_grey, to_levels
from dockpose.sources import VIDEO_ENDINGS, Video
from dockpose.sources.boards import Looked, gather

_BY_HAND = "you dropped it"
_MOST = 200  # pictures, after which the oldest that were left out are forgotten
_PICTURES = ".png,.jpg,.jpeg,.tif,.tiff,.bmp,.webp,"
WIDTH_PX, _CARD_PX = 340, 240
_SEEN_BGR = bgr(BLUE)
_CELL = "width: 2.2em; height: 1.6em; text-align: center; border: 1px solid rgba(128,128,128,0.5)"


def board_of(squares: str, side_mm: float) -> Board:
    """The board that was typed, as "10x7" and the side of a square in mm. Raises UserError where it is not a board."""
    match = re.fullmatch(r"\s*(\d{1,2})\s*[xX×*]\s*(\d{1,2})\s*", squares)
    if match is None:
        what = "not known: show all of it, or type it" if not squares.strip() else f"{squares[:20]!r}; it must be typed"
        raise UserError(f"The board's size is {what} as columns x rows, as 10x7.")
    return Board(int(match[1]), int(match[2]), side_mm / 1000)


class CalibrationPanel(Panel):
    """A folder in which boards are gathered and the camera is fitted."""

    table = "calibration"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._lock = threading.RLock()
        self._gathering = Gathering(Board(10, 7, 0.024), distinct=True)
        self._dropped: dict[str, Sighting] = {}
        self._cards: dict[str, tuple[viser.GuiHtmlHandle, str]] = {}  # and the picture in each
        self._done: Calibration | None = None
        self._count = itertools.count(1)
        self._worker: LatestWorker[np.ndarray] = LatestWorker(self._watch_one, app.fail)
        app.closing.callback(self._worker.close)
        area = self.gui.add_folder(None)
        with area:
            self._add_controls()
        self.add_upload(area, "add", self._take, _PICTURES + ",".join(VIDEO_ENDINGS), waits=True)

    def show(self, analysis: Analysis) -> None:
        """Keep what is shown, and look for the board in it while watching."""
        self.analysis = analysis
        if self._watch.value and not analysis.view.is_stale:
            self._worker.submit(analysis.view.image)

    def _add_controls(self) -> None:
        self.gui.add_html(name_around("flowing"), order=0)
        self._squares = self.add("text", "squares", self._forget_quietly)
        self._side = self.add("number", "side", self._forget_quietly)
        self._medium = self.add("dropdown", "medium", options=MEDIA)
        self._watch = self.add("checkbox", "watch")
        self.add("button", "now", self.trying(self._add_shown))
        self._seen = self.gui.add_html("", order=4)
        blank = np.zeros((1, WIDTH_PX, 3), np.uint8)
        self._shown = self.gui.add_image(blank, format="jpeg", visible=False, order=4.1)
        self._covered = self.gui.add_html("", order=5)
        self.add("button", "fit", lambda client: self.app.work.start(self._fit, client))
        self._result = self.gui.add_html("", order=8)
        use = self.add("button", "use", self.changing(lambda view: with_calibrated_camera(view, self._camera())))
        self._of_camera = use, self.add_download("save", "camera.yaml", lambda view: camera_file(self._camera()))
        self._boards = self.gui.add_folder("Pictures: a click drops one, and takes it back", order=9, visible=False)
        with self._boards:
            self.gui.add_html(name_around("boards"))
        self.add("button", "again", self.trying(lambda client: self._begin(self._gathering.board)))
        self.gui.add_html(help_link("tank"), order=13)

    def _ready(self, greys: Iterable[np.ndarray] = ()) -> Gathering:
        """What is gathered, begun anew where the board has changed; where none is typed, pictures tell its size."""
        if not self._squares.value.strip() and (counts := count_squares(greys)) is not None:
            self._squares.value = f"{counts[0]}x{counts[1]}"
        board = board_of(self._squares.value, float(self._side.value))
        if board != self._gathering.board:
            self._begin(board)
        return self._gathering

    def _begin(self, board: Board) -> None:
        with self._lock:
            self._gathering, self._dropped, self._done = Gathering(board, distinct=True), {}, None
            for handle in (self._seen, self._covered, self._result):
                handle.content = ""
            self._shown.visible = False
            self._offer_camera(False)
            self._show_gathered()

    def _add_shown(self, client: Client) -> None:
        if self.analysis is None:
            raise UserError("There is no picture yet.")
        self._look(self.analysis.view.image, f"shown {next(self._count)}", thorough=True)

    def _watch_one(self, image: np.ndarray) -> None:
        with contextlib.suppress(ValueError):  # the board is being typed
            self._look(image, f"frame {next(self._count)}", thorough=False)

    def _look(self, image: np.ndarray, name: str, *, thorough: bool) -> None:
        grey = to_levels(to_grey(image))[0]
        with self._lock:
            gathering = self._ready([grey])
            if name in gathering.views:  # of another folder, or the same once more
                name = f"{name} ({next(self._count)})"
            found = gathering.add(name, grey, thorough=thorough)
            dropped = gathering.views[name].dropped
            if dropped and not thorough:
                del gathering.views[name]
            for old in [each for each, view in gathering.views.items() if view.dropped][: -_MOST or None]:
                del gathering.views[old]
            self._seen.content = seen_html(name, found, dropped)
            self._shown.image = picture_with_board(grey, found, gathering.board, gathering.counted_as)
            self._shown.visible = True
            if thorough or not dropped:
                self._add_card(name, grey, found)
                self._show_gathered()

    def _add_card(self, name: str, grey: np.ndarray, found: Sighting | None) -> None:
        drawn = picture_with_board(grey, found, self._gathering.board, self._gathering.counted_as, _CARD_PX)
        jpeg = mark.to_jpeg(cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR))
        if name not in self._cards:
            with self._boards:
                self._cards[name] = self.gui.add_html(""), ""
        self._cards[name] = self._cards[name][0], base64.b64encode(jpeg).decode()

    def _show_gathered(self) -> None:
        gathering = self._gathering
        if gathering.size is not None:
            self._covered.content = coverage_html(coverage_of(gathering.sightings, gathering.size))
        self._show_cards(list(gathering.views.values()))

    def _show_cards(self, views: Sequence[BoardView]) -> None:
        """Show what became of each picture on its card, and remove the cards of all others."""
        views_of, worst = {view.name: view for view in views}, max([view.error_px or 0 for view in views], default=0)
        self._boards.visible = bool(views)
        for name, (handle, jpeg) in list(self._cards.items()):
            if name not in views_of:
                handle.remove()
                del self._cards[name]
            elif (html := card_html(views_of[name], jpeg, worst)) != handle.content:
                handle.content = html

    def _take(self, data: bytes, name: str, client: Client) -> None:
        if Path(name).suffix.lower() in VIDEO_ENDINGS:
            self.app.work.start(lambda progress: self._take_video(data, name, client), client)
        else:
            self.app.attempt(lambda: self._look(decode(data, name), name, thorough=True), client)

    def _take_video(self, data: bytes, name: str, client: Client) -> None:
        with tempfile.TemporaryDirectory(prefix="dockpose-") as folder:
            path = Path(folder) / f"sent{Path(name).suffix.lower()}"
            path.write_bytes(data)
            with Video(str(path), None, grey=True) as video:
                step = max(1, (video.count or 0) // _MOST)
                with self._lock:
                    gathering = self._ready(
                        to_levels(frame.image)[0] for frame in itertools.islice(video, 0, None, step)
                    )
                looked = gather(video, gathering, self._show_progress, f"{name} ")
        self.app.notify("Video", f"{name}: {looked.in_words(len(gathering.sightings))}.", "green", client)

    def _show_progress(self, looked: Looked, covered: Coverage | None) -> None:
        if covered is not None and looked.grey is not None:
            with self._lock:
                found = self._gathering.sightings[-1]
                self._add_card(found.name, looked.grey, found)
                self._show_gathered()

    def _fit(self, progress: Progress) -> None:
        with self._lock:
            gathering = self._ready()
            copy = replace(gathering, sightings=list(gathering.sightings), views=dict(gathering.views))
            dropped = set(self._dropped)
        done = calibrate_gathered(copy)
        lines = camera_lines(done, str(self._medium.value), is_on_page=True)
        with self._lock:
            if gathering is not self._gathering:  # it was begun anew
                return
            is_of_these = dropped == set(self._dropped)
            if is_of_these:
                self._done = done
                self._result.content = "".join([small(escape(line), 'class="calibration-line"') for line in lines])
                self._show_cards(done.views)
                self._offer_camera(True)
        if not is_of_these:  # a click dropped one meanwhile
            self._fit(progress)

    def toggle(self, asked: Any, client: Client) -> None:
        """Leave out a picture that counted, or take it back; where a camera was worked out, that is done again."""
        with self._lock:
            name = asked.name
            gathering, was_done = self._gathering, self._done is not None
            if name in self._dropped:
                sighting = self._dropped.pop(name)
                gathering.sightings.append(sighting)
                gathering.views[name] = BoardView(name, None, len(sighting.picture_px))
            else:
                kept = [each for each in gathering.sightings if each.name == name]
                if not kept:  # it was left out for another reason, or is gone
                    return
                self._dropped[name] = kept[0]
                gathering.drop(name, _BY_HAND)
            self._show_gathered()
            self._done = None  # it was of other pictures
            self._result.content = ""
            self._offer_camera(False)
        if was_done:
            self.app.work.start(self._fit, client)

    def _offer_camera(self, is_there: bool) -> None:
        for button in self._of_camera:
            button.visible = is_there

    def _camera(self) -> Camera:
        if self._done is None:
            raise UserError("There is no camera yet; work it out first.")
        return self._done.camera

    def _forget_quietly(self, client: Client) -> None:
        """Begin anew with another board, as soon as one is typed that can be."""
        with contextlib.suppress(ValueError), self._lock:
            self._ready()


def picture_with_board(
    grey: np.ndarray, found: Sighting | None, board: Board, counted_as: str, width_px: int = WIDTH_PX
) -> np.ndarray:
    """A small RGB copy of a grey picture (H, W), with the board's corners where one was found."""
    scale = width_px / grey.shape[1]
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    shown = cv2.cvtColor(small, cv2.COLOR_GRAY2BGR)
    if found is not None:
        corners = ((found.picture_px + 0.5) * scale - 0.5).astype(np.float32)
        across, down = board.inner(counted_as)
        if len(corners) == across * down:
            grid = corners.reshape(down, across, 2)
            for line in [*grid, *grid.transpose(1, 0, 2)]:
                cv2.polylines(shown, [np.rint(line * 8).astype(np.int32)], False, _SEEN_BGR, 1, cv2.LINE_AA, 3)
        for x, y in corners.tolist():
            cv2.circle(shown, (round(x), round(y)), 2, _SEEN_BGR, -1, cv2.LINE_AA)
    return cv2.cvtColor(shown, cv2.COLOR_BGR2RGB)


def seen_html(name: str, found: Sighting | None, dropped: str) -> str:
    """Whether the board was seen in the newest picture, and whether that counts."""
    if found is None:
        text = f"{escape(name)}: {escape(dropped)}."
    elif dropped:
        text = f"{escape(name)}: board seen, not taken: {escape(dropped)}."
    else:
        text = f"{escape(name)}: <b>board seen and taken</b>, {len(found.picture_px)} corners."
    return small(text, 'id="calibration-seen"')


def coverage_html(covered: Coverage) -> str:
    """The parts of the picture that boards reached and how often, tilts, distances, and what to add."""
    rows = ""
    for cells in covered.cells.tolist():
        shades = [f"background: rgba(0,114,178,{min(count, 4) / 8:.2f})" for count in cells]
        columns = [f'<td style="{_CELL}; {shade}">{count}</td>' for count, shade in zip(cells, shades, strict=True)]
        rows += f"<tr>{''.join(columns)}</tr>"
    parts = [f"{covered.pictures} {'view' if covered.pictures == 1 else 'views'}"]
    if covered.pictures:
        (left, top), (right, bottom) = covered.tilts_deg.min(axis=0), covered.tilts_deg.max(axis=0)
        parts.append(f"tilts {left:.0f}° to {right:.0f}° sideways, {top:.0f}° to {bottom:.0f}° up and down")
        parts.append(f"farthest {covered.distances.max():.1f} times the nearest")
    words = "That is enough." if covered.is_enough else f"Still wanted: {escape('; '.join(covered.wanted))}."
    cells = f'<table style="border-collapse: collapse; margin: 0.3em 0">{rows}</table>'
    return small(f"{cells}{escape(', '.join(parts))}. {words}", 'id="calibration-covered"')


def card_html(view: BoardView, jpeg: str, worst_px: float) -> str:
    """A picture with its corners, its error as a number and a bar, or why it was dropped; a click drops it."""
    is_mine, name = view.dropped in ("", _BY_HAND), escape(view.name)
    act = " disabled" if not is_mine else f' title="{"Take it back." if view.dropped else "Drop it."}"'
    share = 0 if view.error_px is None or worst_px == 0 else view.error_px / worst_px
    return (
        f'<button type="button" class="board" data-board="{name}" aria-pressed="{"false" if view.dropped else "true"}"'
        f'{act}><img alt="" src="data:image/jpeg;base64,{jpeg}">'
        f"<span><b>{name}</b>{escape(outcome(view))}"
        f'<i style="width: {100 * share:.0f}%"></i></span></button>'
    )
