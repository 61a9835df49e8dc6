"""The tab Log: a session on the disk, to which frames are added with what was measured."""

import json
import threading
from collections import deque
from collections.abc import Mapping
from functools import partial
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import Any

from dockpose.app.errors import UserError
from dockpose.app.experiment import Row, Session
from dockpose.app.experiment.session import SessionFolder
from dockpose.app.export.bundle import bundle_name, session_files, to_zip
from dockpose.app.export.words import Checked, check_session
from dockpose.app.processing.background import Progress
from dockpose.app.resources import read_toml
from dockpose.app.state.camera import camera_file, dock_file
from dockpose.app.state.changes import with_measured
from dockpose.app.state.view import View
from dockpose.app.web.charts import CHARTS, Chart, error_points
from dockpose.app.web.choices import Client, on_person
from dockpose.app.web.html import help_link, name_around, small
from dockpose.app.web.page import Page
from dockpose.app.web.panels import experiment_rows as log_rows
from dockpose.app.web.server.viser_private import identity
from dockpose.app.web.widgets import Panel

NO_SESSION, NEXT_FRAME, ALL = "(none)", "the next frame", "all.zip"
WHAT = read_toml("controls.toml")["log"]["files"]


class ExperimentPanel(Panel):
    """Session, button to take a frame, boxes for measured values, running table, charts and downloads."""

    table = "log"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._sessions = SessionFolder(app.options.sessions)
        self._lock = threading.RLock()
        self._session: Session | None = None
        self._has_begun = False  # whether a session was begun or chosen since the start
        self._chosen_row: int | None = None  # whose boxes are shown; None for the next frame's
        self._drafts: dict[int | None, log_rows.Texts] = {}
        self.take = self.trying(self._take)
        self._heard = deque[int](maxlen=8)  # numbers of requests to take
        self._add_session()
        self._add_answers()
        self._add_fields()
        self._table = self.gui.add_html("")
        self._charts = [Chart(self.gui, title, marks) for title, marks in CHARTS.items()]
        self.gui.add_html(help_link("log"))
        app.closing.callback(self._close_session)
        self._show_session("")
        if app.options.resume and (session := self._sessions.last()) is not None:
            self._replace(session, f"Going on with {session.record.name}.")

    @property
    def folder(self) -> Path | None:
        """That of the session that is open."""
        return None if self._session is None else self._session.folder

    def take_typed(self, request: Any, client: Client) -> None:
        """Take a frame with what a browser's boxes say, and tell it that it was heard."""
        self._heard.append(request.number)
        self.app.live.put(taken=[*self._heard])
        self.app.live.send()
        self.app.attempt(lambda: self._take(client, request.boxes), client)

    def typed(self, request: Any, client: Client) -> None:
        """Take over what was typed in a browser, for the row that its boxes had then, which may be another by now."""
        with self._lock:
            if request.number <= max(self._heard, default=0):
                return  # a frame was taken with it
            row, typed = _row_of(request.boxes.get("target", "")), _texts_in(request.boxes)
            if row == self._chosen_row:
                self._fields.texts |= typed
            elif row in self._drafts:
                self._drafts[row] |= typed
        self._compare(client)

    def _compare(self, client: Client) -> None:
        """Set what is typed for the next frame beside the pose that was found in the picture."""
        with self._lock:
            measured = log_rows.pose_of(self._next_texts)

        def compared(view: View) -> View:
            after = with_measured(view, measured)
            return view if after.measured == view.measured else after

        self.change(compared, client)

    def _take_over(self, boxes: Mapping[str, str]) -> None:
        """Set the boxes to what a browser shows in its own, of which not everything may have come."""
        there, here = boxes.get("target"), target_name(self._chosen_row)
        if boxes and there != here:
            raise UserError(f"The boxes are those of {there} in this browser, and of {here} in the program; try again.")
        self._fields.texts |= _texts_in(boxes)

    def _add_session(self) -> None:
        self.gui.add_html(name_around("flowing"))
        self._words = self.gui.add_html("")
        names = NO_SESSION, *self._sessions.names()
        self._choice = self.add("dropdown", "choice", self.trying(self._open_chosen), options=names)
        self._name = self.add("text", "name")
        key = self.gui.add_command("Take this frame", description="Into the session that is open.", hotkey="T")
        on_person(key.on_trigger, self.take)

    def _add_fields(self) -> None:
        with self.gui.add_folder("Measured by hand", expand_by_default=True):
            self._fields = log_rows.MeasuredFields(self.gui)
            choose = self.trying(self._choose_row)
            self._target = self.add("dropdown", "target", choose, options=(target_name(None),))
            self._fields.on_update(self.app.choices, self._compare)
            ids = json.dumps({"target": identity(self._target), **self._fields.ids})
            self.gui.add_html(f'{name_around("measured")}<dockpose-measured boxes="{escape(ids)}"></dockpose-measured>')
            self._save_row = self.add("button", "save_row", self.trying(self._save_chosen))
            self._keep = self.add("checkbox", "keep")

    def _add_answers(self) -> None:
        self._what = self.add("dropdown", "what", options=tuple(WHAT))
        self._save = self.add("button", "save", self.trying(self._download))
        self._check = self.add("button", "check", self.trying(self._check_tape))
        self._told = self.gui.add_html("")
        self._corrected = {
            name: self.add("button", f"save_{name}", self.trying(partial(self._save_corrected, name)))
            for name in ("dock", "camera")
        }

    def _close_session(self) -> None:
        with self._lock:
            if self._session is not None:
                self._session.close()

    @property
    def _next_texts(self) -> log_rows.Texts:
        return self._fields.texts if self._chosen_row is None else self._drafts.get(None, log_rows.BLANK)

    @_next_texts.setter
    def _next_texts(self, texts: log_rows.Texts) -> None:
        if self._chosen_row is None:
            self._fields.texts = texts
        else:
            self._drafts[None] = texts

    def _open_chosen(self, client: Client) -> None:
        with self._lock:
            name = str(self._choice.value)
            try:
                session = None if name == NO_SESSION else self._sessions.take_up(name)
            except ValueError:
                self._choice.value = NO_SESSION if self._session is None else self._session.record.name
                raise
            self._replace(session, "" if session is None else "Reopened.")
        self._tell_notices(session, client)

    def _tell_notices(self, session: Session | None, client: Client) -> None:
        for sentence in () if session is None else session.notices:
            self.app.notify("About the session", sentence, "yellow", client)

    def _go_on(self, client: Client) -> Session:
        """The session for the first frame since the start: the last one of today, or a new one where there is none."""
        session = None if self._has_begun or str(self._name.value).strip() else self._sessions.last_of_today()
        if session is None:
            return self._start_new(str(self._name.value))
        self._replace(session, f"Going on with {session.record.name}.")
        self._tell_notices(session, client)
        return session

    def enter(self, asked: Any, client: Client) -> None:
        """Start a session of the name that was typed."""
        self.app.attempt(lambda: self._start_new(asked.name), client)

    def _start_new(self, name: str) -> Session:
        with self._lock:
            session = self._sessions.start(name)
            self._replace(session, "Started.")
            self._name.value = ""
            return session

    def _replace(self, session: Session | None, said: str) -> None:
        if self._session is not None:
            self._session.close()
        self._show_row(None)
        self._drafts.clear()
        self._session, self._has_begun = session, True
        self._show_session(said)

    def _take(self, client: Client, boxes: Mapping[str, str] = MappingProxyType({})) -> None:
        with self._lock:
            self._take_over(boxes)
            analysis, texts = self.analysis, self._next_texts
            if analysis is None:
                return
            values = log_rows.values_of(texts)
            session = self._session or self._go_on(client)
        view = analysis.view
        row = session.take(view.image, analysis.estimate, view.source, view.sha256, **values)
        said = log_rows.taken_words(row)
        with self._lock:
            if not self._keep.value and self._next_texts == texts:
                self._next_texts = log_rows.BLANK
            if session is self._session:
                self._show_rows(said)
        self.app.notify("Taken", said, "green", client)

    def _choose_row(self, client: Client) -> None:
        with self._lock:
            self._show_row(_row_of(str(self._target.value)))

    def _show_row(self, number: int | None) -> None:
        """Show the boxes of a row, or of the next frame, keeping the draft of the one shown before."""
        self._drafts[self._chosen_row] = self._fields.texts
        row = next((row for row in self._rows() if row.number == number), None)
        self._chosen_row = None if row is None else row.number
        stored = log_rows.BLANK if row is None else log_rows.texts_of(row)
        self._fields.texts = self._drafts.pop(self._chosen_row, stored)
        self._keep.visible, self._save_row.visible = row is None, row is not None
        self._save_row.label = "Save the row" if row is None else f"Save row {row.number}"
        self._target.value = target_name(self._chosen_row)

    def _save_chosen(self, client: Client) -> None:
        with self._lock:
            if self._session is None or self._chosen_row is None:
                return
            row = self._session.edit(self._chosen_row, **log_rows.values_of(self._fields.texts))
            said = f"Row {row.number} is on disk as changed."
            self._show_rows(said)
        self.app.notify("Saved", said, "green", client)

    def _rows(self) -> tuple[Row, ...]:
        return () if self._session is None else self._session.rows

    def _show_session(self, said: str) -> None:
        session = self._session
        name = NO_SESSION if session is None else session.record.name
        names = [NO_SESSION, *self._sessions.names()]
        self._choice.options = names if name in names else [*names, name]
        self._choice.value = name
        self._name.visible = session is None
        self._save.disabled = self._check.disabled = session is None
        self._show_rows(said)

    def _show_rows(self, said: str) -> None:
        rows = self._rows()
        self._target.options = [target_name(number) for number in (None, *(row.number for row in reversed(rows)))]
        self._table.content = "" if self._session is None else log_rows.session_table(rows)
        for chart in self._charts:
            chart.show(error_points(rows, chart.which))
        self._show_checked(None)
        folder = None if self._session is None else self._session.folder
        self._words.content = log_rows.state_html(folder, len(rows), said)

    def _download(self, client: Client) -> None:
        session, name = self._session, WHAT.get(str(self._what.value))
        if session is None or name is None:
            return
        files = session_files(session.record)

        def make(progress: Progress) -> bytes:
            return to_zip(files, progress) if name == ALL else files[name]()

        called = bundle_name(session.record.name, ".zip" if name == ALL else f"_{name}")
        self.app.work.save(client, called, make)

    def _check_tape(self, client: Client) -> None:
        with self._lock:
            if self._session is not None:
                self._show_checked(None)
                self._show_checked(check_session(self._session.record))

    def _show_checked(self, checked: Checked | None) -> None:
        self._checked = checked
        told = [] if checked is None else checked.told
        self._told.content = small("".join(f"<p>{escape(sentence)}</p>" for sentence in told), 'id="check"')
        for button in self._corrected.values():
            button.visible = checked is not None and checked.is_off

    def _save_corrected(self, name: str, client: Client) -> None:
        checked = self._checked
        if checked is not None:
            corrected = dock_file(checked.corrected_dock) if name == "dock" else camera_file(checked.corrected_camera)
            client.send_file_download(f"{name}.yaml", corrected, save_immediately=True)


def target_name(number: int | None) -> str:
    """What the boxes belong to, as the drop-down has it."""
    return NEXT_FRAME if number is None else f"row {number}"


def _row_of(target: str) -> int | None:
    """The row that the drop-down names; None for the next frame."""
    word = target.removeprefix("row ")
    return int(word) if word.isdecimal() else None


def _texts_in(boxes: Mapping[str, str]) -> log_rows.Texts:
    """Texts by column among what a browser sent."""
    return {name: boxes[name] for name in log_rows.BLANK if name in boxes}
