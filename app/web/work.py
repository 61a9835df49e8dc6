"""Work in the background, one piece at a time, with its progress and a button to stop it."""

import threading
from collections.abc import Callable

import viser
from dockpose.app.processing.background import CancelledError, Progress
from dockpose.app.web.choices import Client

_BUSY = "Other work is running already. Wait for it, or stop it first."


class BackgroundWork:
    """Runs work in its own thread, with a bar or none. ``report`` is told of errors, ``notify`` of waiting."""

    def __init__(
        self, gui: viser.GuiApi | None, report: Callable[[Exception, Client | None], None], notify: Callable[..., None]
    ) -> None:
        self._report, self._notify, self._bar = report, notify, None
        if gui is not None:
            self._bar = gui.add_progress_bar(0, visible=False, animated=True)
            self._stop = gui.add_button("Stop", icon=viser.Icon.PLAYER_STOP, visible=False)
            self._stop.on_click(lambda event: self.cancel())
        self._lock = threading.Lock()
        self._running: tuple[threading.Thread, Progress] | None = None

    def start(self, work: Callable[[Progress], None], client: Client | None = None) -> bool:
        """Start; return False if other work is still running, of which ``client`` is told."""
        with self._lock:
            if self._running is None:
                progress = Progress(self._tell)
                thread = threading.Thread(
                    target=self._run, args=(work, progress, client), name="dockpose task", daemon=True
                )
                self._running = thread, progress
                thread.start()
                return True
        if client is not None:
            self._notify("Please wait", _BUSY, "yellow", client)
        return False

    def save(self, client: Client, name: str, make: Callable[[Progress], bytes]) -> None:
        """Make a file and send it to the browser's downloads under that name."""

        def work(progress: Progress) -> None:
            content = make(progress)
            for _ in progress.over(["send"]):  # unless it was asked to stop meanwhile
                client.send_file_download(name, content, save_immediately=True)

        self.start(work, client)

    def cancel(self) -> None:
        """Ask whatever runs to stop at its next step."""
        with self._lock:
            if self._running is not None:
                self._running[1].stop()

    def close(self, timeout_s: float = 5.0) -> None:
        """Stop whatever runs and wait for its end."""
        self.cancel()
        running = self._running
        if running is not None and running[0] is not threading.current_thread():
            running[0].join(timeout_s)

    def _run(self, work: Callable[[Progress], None], progress: Progress, client: Client | None) -> None:
        self._show(True)
        try:
            work(progress)
        except CancelledError:
            pass
        except Exception as error:  # whatever it was, people should read of it on the page
            self._report(error, client)
        finally:
            with self._lock:
                self._running = None
            self._show(False)

    def _tell(self, share: float) -> None:
        if self._bar is not None and round(100 * share) != self._bar.value:
            self._bar.value = round(100 * share)

    def _show(self, is_running: bool) -> None:
        if self._bar is not None:
            self._bar.visible = self._stop.visible = is_running
            self._bar.value = 0
