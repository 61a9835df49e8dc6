"""Files that browsers send: capped in size before they arrive, with harmless names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser
from dockpose.app.inputs.filenames import clean_name
from dockpose.app.web.server.options import UPLOAD_LIMIT_BYTES
from viser import _messages as messages

# Takes a file's bytes and its cleaned name; runs in a thread of its own.
Receiver = Callable[[bytes, str], None]


def too_large(name: str, size: int, limit: int) -> str:
    """The sentence for a file that does not fit under the cap."""
    return (
        f"{name}: the file has {size / 2**20:.1f} MB, and at most {limit / 2**20:.0f} MB are taken at once, all "
        "browsers together (--upload-limit-mb sets this)."
    )


def refuse_shared_uploads(server: viser.ViserServer) -> None:
    """Take no files outside a client's own upload button.

    viser would keep the parts of a file that is sent to any control of the page, a slider too.
    """
    gui = server.gui
    gui._websock_interface.unregister_handler(messages.FileTransferStartUpload, gui._handle_file_transfer_start)
    gui._websock_interface.unregister_handler(messages.FileTransferPart, gui._handle_file_transfer_part)


class Uploads:
    """All files under way from browsers.

    viser itself has no cap, keeps files in memory until the client leaves, and mixes up two that arrive together. Here
    each file goes to its receiver and is forgotten.

    ``limit_bytes`` caps the files under way and those kept, together; ``make_room(at_most)`` must reduce the kept ones
    to that many bytes.
    """

    def __init__(
        self, limit_bytes: int = UPLOAD_LIMIT_BYTES, make_room: Callable[[int], None] = lambda at_most: None
    ) -> None:
        self.limit_bytes = limit_bytes
        self._make_room = make_room
        self._underway: dict[int, dict[str, Any]] = {}

    def attach(self, client: viser.ClientHandle) -> ClientUploads:
        """Take charge of one browser's files; add its buttons to what is returned."""
        mine = ClientUploads(client, self._fits)
        self._underway[client.client_id] = mine.underway
        return mine

    def detach(self, client: viser.ClientHandle) -> None:
        """Forget a browser that left and anything it was sending."""
        self._underway.pop(client.client_id, None)

    def _fits(self, name: str, size: int) -> str | None:
        """Why a file may not be sent; None where it may."""
        transfers = (one for mine in list(self._underway.values()) for one in list(mine.values()))
        room = self.limit_bytes - sum(one["total_bytes"] for one in transfers) - size
        if size < 0 or room < 0:
            return too_large(name, size, self.limit_bytes)
        self._make_room(room)
        return None


class ClientUploads:
    """One browser's files."""

    def __init__(self, client: viser.ClientHandle, fits: Callable[[str, int], str | None]) -> None:
        gui = client.gui
        self.underway: dict[str, Any] = gui._current_file_upload_states  # pyright: ignore[reportAttributeAccessIssue]
        self._client, self._fits = client, fits
        self._receivers: dict[str, Receiver] = {}
        connection = gui._websock_interface
        connection.unregister_handler(messages.FileTransferStartUpload, gui._handle_file_transfer_start)
        connection.unregister_handler(messages.FileTransferPart, gui._handle_file_transfer_part)
        connection.register_handler(messages.FileTransferStartUpload, self._start)
        connection.register_handler(messages.FileTransferPart, self._part)
        gui._finish_file_upload = self._finish

    def receive(self, button: viser.GuiUploadButtonHandle, receiver: Receiver) -> None:
        """Give the files of an upload button to ``receiver``."""
        self._receivers[button._impl.uuid] = receiver

    def _start(self, client_id: Any, message: messages.FileTransferStartUpload) -> None:
        if message.source_component_uuid not in self._receivers:
            return
        reason = self._fits(clean_name(message.filename), message.size_bytes)
        if reason is not None:
            self._release_button(message)
            self._client.add_notification("The file was not taken", reason, color="red")
            return
        self._client.gui._handle_file_transfer_start(client_id, message)

    def _part(self, client_id: Any, message: messages.FileTransferPart) -> None:
        transfer = self.underway.get(message.transfer_uuid)
        if transfer is not None and transfer["transferred_bytes"] + len(message.content) > transfer["total_bytes"]:
            self.underway.pop(message.transfer_uuid)
            return
        self._client.gui._handle_file_transfer_part(client_id, message)

    def _finish(self, client_id: Any, transfer_uuid: str, source_component_uuid: str | None) -> None:
        """In place of viser's own, which keeps the file in the button."""
        transfer = self.underway.pop(transfer_uuid, None)
        receiver = self._receivers.get(source_component_uuid or "")
        if transfer is None or receiver is None:
            return
        content = b"".join(transfer["parts"][index] for index in range(transfer["part_count"]))
        self._client.gui._thread_executor.submit(receiver, content, clean_name(transfer["filename"]))

    def _release_button(self, message: messages.FileTransferStartUpload) -> None:
        """Report the transfer as complete: the button waits for that, and viser cannot refuse a transfer."""
        self._client.gui._websock_interface.queue_message(
            messages.FileTransferPartAck(
                source_component_uuid=message.source_component_uuid,
                transfer_uuid=message.transfer_uuid,
                transferred_bytes=message.size_bytes,
                total_bytes=message.size_bytes,
            )
        )
