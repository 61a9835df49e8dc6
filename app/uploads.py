"""Files that a browser sends: their size is capped before they arrive, and their names are made harmless."""

from __future__ import annotations

from pathlib import PurePath
from typing import Any

import viser
from viser import _messages as messages

from app.state import MAX_UPLOAD_BYTES, upload_too_large

_LONGEST_NAME = 80


def clean_name(name: Any) -> str:
    """What to call an uploaded file: its last part, without control characters, at most 80 characters."""
    last = PurePath(str(name).replace("\\", "/")).name
    printable = "".join(letter for letter in last if letter.isprintable())
    return printable[:_LONGEST_NAME] or "the file"


def refuse_shared_uploads(server: viser.ViserServer) -> None:
    """Take no files outside a client's own upload button.

    viser would keep the parts of a file that is sent to any control of the page, a slider too.
    """
    gui = server.gui
    gui._websock_interface.unregister_handler(messages.FileTransferStartUpload, gui._handle_file_transfer_start)
    gui._websock_interface.unregister_handler(messages.FileTransferPart, gui._handle_file_transfer_part)


def cap_uploads(client: viser.ClientHandle) -> None:
    """Refuse this client's files above the cap before their parts are taken, and drop one that outgrows its size.

    viser itself has no cap: it keeps what arrives in memory until the client leaves.
    """
    gui = client.gui
    underway = gui._current_file_upload_states

    def start(client_id: Any, message: messages.FileTransferStartUpload) -> None:
        others = sum(transfer["total_bytes"] for transfer in underway.values())
        if not 0 <= message.size_bytes <= MAX_UPLOAD_BYTES - others:
            _release_button(client, message)
            sentence = upload_too_large(clean_name(message.filename), message.size_bytes)
            client.add_notification("The file was not taken", sentence, color="red")
            return
        gui._handle_file_transfer_start(client_id, message)

    def part(client_id: Any, message: messages.FileTransferPart) -> None:
        transfer = underway.get(message.transfer_uuid)
        if transfer is not None and transfer["transferred_bytes"] + len(message.content) > transfer["total_bytes"]:
            underway.pop(message.transfer_uuid)
            return
        gui._handle_file_transfer_part(client_id, message)

    connection = gui._websock_interface
    connection.unregister_handler(messages.FileTransferStartUpload, gui._handle_file_transfer_start)
    connection.unregister_handler(messages.FileTransferPart, gui._handle_file_transfer_part)
    connection.register_handler(messages.FileTransferStartUpload, start)
    connection.register_handler(messages.FileTransferPart, part)


def _release_button(client: viser.ClientHandle, message: messages.FileTransferStartUpload) -> None:
    """Have the page take the transfer for ended: its button waits for that, and a transfer cannot be refused."""
    client.gui._websock_interface.queue_message(
        messages.FileTransferPartAck(
            source_component_uuid=message.source_component_uuid,
            transfer_uuid=message.transfer_uuid,
            transferred_bytes=message.size_bytes,
            total_bytes=message.size_bytes,
        )
    )


def take_upload(button: viser.GuiUploadButtonHandle) -> tuple[bytes, str]:
    """Return the bytes and the name of the file that was just uploaded, and let the button forget it."""
    upload = button.value
    button._impl.value = viser.UploadedFile("", b"")  # else it stays in memory until the client leaves
    return upload.content, clean_name(upload.name)
