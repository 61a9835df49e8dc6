"""Files that browsers send: capped in size before they arrive, with harmless names."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

import viser
from dockpose.app.inputs.received import clean_name
from dockpose.app.web.server import viser_private
from dockpose.app.web.server.journal import LOG, log_failure
from dockpose.text import one_line

MOST_AT_ONCE = 16  # files of one browser; the page sends one after the other
PATIENCE_S = 60.0
_LONGEST_NAME = 1000
_SMALLEST_PART_BYTES = 2**16  # on average; the page's have 2**19
_BETWEEN_NOTICES_S = 1.0

# Takes a file's bytes and its cleaned name; runs in a thread of its own.
Receiver = Callable[[bytes, str], object]


class Uploads:
    """All files under way; ``limit_bytes`` caps them with those kept, of which ``make_room(at_most)`` drops some."""

    def __init__(self, limit_bytes: int, make_room: Callable[[int], None]) -> None:
        self.limit_bytes, self._make_room = limit_bytes, make_room
        self._clients: dict[int, ClientUploads] = {}

    def attach(self, client: viser.ClientHandle) -> "ClientUploads":
        """Take charge of one browser's files; add its buttons to what is returned."""
        mine = self._clients[client.client_id] = ClientUploads(client, self._fits)
        return mine

    def detach(self, client: viser.ClientHandle) -> None:
        """Forget a browser that left and anything it was sending."""
        mine = self._clients.pop(client.client_id, None)
        if mine is not None:
            mine.underway.clear()

    def _fits(self, name: str, size: int) -> str | None:
        """Why a file may not be sent; None where it may."""
        room = self.limit_bytes - sum(one.held_bytes for one in list(self._clients.values())) - size
        if room < 0:
            return (
                f"{name}: the file has {size / 2**20:.1f} MB, and at most {self.limit_bytes / 2**20:.0f} MB are taken "
                "at once, all browsers together (--upload-limit-mb sets this)."
            )
        self._make_room(room)
        return None


class ClientUploads:
    """One browser's files."""

    def __init__(self, client: viser.ClientHandle, fits: Callable[[str, int], str | None]) -> None:
        self._client, self._fits = client, fits
        self._receivers: dict[str, Receiver] = {}
        self._being_read: dict[str, int] = {}  # sizes of those that are there, and that a receiver still works on
        self._told_s = -_BETWEEN_NOTICES_S
        self.underway = viser_private.take_uploads(client.gui, self._start, self._part, self._finish)

    @property
    def held_bytes(self) -> int:
        """Memory that its files take, or will once they are there."""
        return sum(one["total_bytes"] for one in list(self.underway.values())) + sum(list(self._being_read.values()))

    def receive(self, button: viser.GuiUploadButtonHandle, receiver: Receiver) -> None:
        """Give the files of an upload button to ``receiver``."""
        self._receivers[viser_private.identity(button)] = receiver

    def _start(self, client_id: Any, message: viser_private.StartUpload) -> None:
        if message.source_component_uuid not in self._receivers or message.transfer_uuid in self.underway:
            return
        named = message.filename, message.mime_type, message.transfer_uuid
        counted = message.part_count, message.size_bytes
        if not all(isinstance(one, str) and len(one) <= _LONGEST_NAME for one in named) or not all(
            map(_is_count, counted)
        ):
            return  # viser takes anything; the page sends no such
        name, size = clean_name(message.filename), message.size_bytes
        if len(self.underway) + len(self._being_read) >= MOST_AT_ONCE:
            reason = f"{name}: {MOST_AT_ONCE} files of this browser are still under way. Wait for them."
        elif (size == 0) != (message.part_count == 0) or message.part_count > 1 + size // _SMALLEST_PART_BYTES:
            reason = f"{name}: {size} bytes do not come in {message.part_count} parts."
        else:
            reason = self._fits(name, size)
        if reason is not None:
            viser_private.release_upload_button(self._client.gui, message)
            self._refuse(reason)
            return
        viser_private.go_on(self._client.gui, client_id, message)
        if message.transfer_uuid in self.underway:  # a file of no bytes has arrived by now
            self._expire_unless_moving(message.transfer_uuid, 0)

    def _part(self, client_id: Any, message: viser_private.UploadPart) -> None:
        transfer = self.underway.get(message.transfer_uuid)
        if transfer is None or not isinstance(message.content, bytes) or not _is_count(message.part_index):
            return
        if transfer["transferred_bytes"] + len(message.content) > transfer["total_bytes"]:
            self.underway.pop(message.transfer_uuid)
            self._refuse(f"{clean_name(transfer['filename'])}: more came than the browser had said.")
            return
        viser_private.go_on(self._client.gui, client_id, message)

    def _finish(self, client_id: Any, transfer_uuid: str, source_component_uuid: str | None) -> None:
        """In place of viser's own, which keeps the file in the button."""
        transfer = self.underway.pop(transfer_uuid, None)
        receiver = self._receivers.get(source_component_uuid or "")
        if transfer is None or receiver is None:
            return
        name, parts = clean_name(transfer["filename"]), transfer["parts"]
        if transfer["transferred_bytes"] != transfer["total_bytes"]:
            self._refuse(f"{name}: less came than the browser had said.")
            return
        content = b"".join(parts[index] for index in range(transfer["part_count"]))
        self._being_read[transfer_uuid] = len(content)
        LOG.info("browser %d: took the file %s of %d bytes", self._client.client_id, one_line(name), len(content))
        reading = viser_private.run_beside(self._client.gui, receiver, content, name)
        reading.add_done_callback(lambda _: self._being_read.pop(transfer_uuid, None))
        reading.add_done_callback(log_failure)

    def _expire_unless_moving(self, transfer_uuid: str, seen_bytes: int) -> None:
        """Give up a file of which nothing more came for a while, so that it does not take the place of others."""

        def look() -> None:
            transfer = self.underway.get(transfer_uuid)
            if transfer is None:
                return
            if transfer["transferred_bytes"] > seen_bytes:
                self._expire_unless_moving(transfer_uuid, transfer["transferred_bytes"])
                return
            self.underway.pop(transfer_uuid)
            self._refuse(f"{clean_name(transfer['filename'])}: nothing more of it came for {PATIENCE_S:.0f} s.")

        asyncio.get_running_loop().call_later(PATIENCE_S, look)

    def _refuse(self, reason: str) -> None:
        """Say why a file is not taken, in the browser and the log; at most once a second."""
        now_s = time.monotonic()
        if now_s - self._told_s < _BETWEEN_NOTICES_S:
            return
        self._told_s = now_s
        LOG.warning("browser %d: refused a file: %s", self._client.client_id, one_line(reason))
        self._client.add_notification("The file was not taken", reason, color="red")


def _is_count(value: object) -> bool:
    return type(value) is int and value >= 0
