"""Files that the page makes and sends to the browser that asked, one at a time, with progress and cancel."""

from __future__ import annotations

from collections.abc import Callable

import viser
from dockpose.app.processing.background import Progress, Task
from dockpose.app.web.notifications import Notify

_BUSY = "Something is being saved already. Wait for it, or stop it first."


class Saver:
    """A bar and a button to stop, which are there while a file is made.

    Parameters
    ----------
    gui : where to build them.
    notify : tells a browser why there is no file.
    on_error : told what goes wrong without anybody having expected it.
    """

    def __init__(self, gui: viser.GuiApi, notify: Notify, on_error: Callable[[Exception], None]) -> None:
        self._notify = notify
        self._bar = gui.add_progress_bar(0, visible=False, animated=True)
        self._stop = gui.add_button("Stop", icon=viser.Icon.PLAYER_STOP, visible=False, hint="Do not make the file.")
        self._task = Task(self._tell, self._on_end, on_error)
        self._stop.on_click(lambda event: self._task.cancel())

    def save(self, client: viser.ClientHandle, name: str, make: Callable[[Progress], bytes]) -> None:
        """Make a file in a thread of its own and send it to the browser's downloads under that name.

        Where ``make`` raises ValueError, its sentence is shown there.
        """

        def work(progress: Progress) -> None:
            self._bar.visible = self._stop.visible = True
            try:
                content = make(progress)
            except ValueError as error:
                self._notify("That did not work", str(error), "red", client)
                return
            for _ in progress.over(["send"]):  # unless it was asked to stop meanwhile
                client.send_file_download(name, content, save_immediately=True)

        if not self._task.start(work):
            self._notify("Please wait", _BUSY, "yellow", client)

    def close(self) -> None:
        """Stop whatever runs."""
        self._task.close()

    def _tell(self, share: float) -> None:
        if round(100 * share) != self._bar.value:
            self._bar.value = round(100 * share)

    def _on_end(self) -> None:
        self._bar.visible = self._stop.visible = False
        self._bar.value = 0
