"""Everything of viser that is not public and that we touch; no other file does.

viser has no access control, no cap on files, and no hook before its messages, so some of its private parts are called
or replaced. Any version may change them: ``protection.py`` asks here whether all are there before anything is served.
With each group stands what viser would have to offer to replace it.
"""

import asyncio
import contextlib
import dataclasses
import functools
import inspect
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeAlias
from zipfile import ZipFile

import msgspec
import viser
import websockets.asyncio.server as websocket_server
from viser import _icons as icons
from viser import _messages as messages
from viser.infra._async_message_buffer import AsyncMessageBuffer

StartUpload: TypeAlias = "messages.FileTransferStartUpload"
UploadPart: TypeAlias = "messages.FileTransferPart"

# What the checks in ``protection.py`` ask for, by the names that are used below.
_CLOSED = ("ShareUrlRequest", "FileTransferStartUpload", "FileTransferPart")  # messages without a shared handler
_FIELDS = {
    "ShareUrlRequest": (),
    "GuiUpdateMessage": ("uuid", "updates"),
    "GuiFormDirtyMessage": ("uuid",),
    "FileTransferStartUpload": (
        *("source_component_uuid", "transfer_uuid", "filename", "mime_type", "part_count", "size_bytes"),
    ),
    "FileTransferPart": ("transfer_uuid", "part_index", "content"),
    "FileTransferPartAck": ("source_component_uuid", "transfer_uuid", "transferred_bytes", "total_bytes"),
}
_METHODS = {
    "_handle_file_transfer_start": ("self", "client_id", "message"),
    "_handle_file_transfer_part": ("self", "client_id", "message"),
    "_finish_file_upload": ("self", "client_id", "transfer_uuid", "source_component_uuid"),
    "_handle_gui_updates": ("self", "client_id", "message"),
    "_handle_gui_form_dirty": ("self", "client_id", "message"),
    "_resolve_client": ("self", "client_id"),
}
_GUI_PARTS = (
    *("_websock_interface", "_current_file_upload_states", "_thread_executor"),
    *("_gui_input_handle_from_uuid", "_container_handle_from_uuid"),
)
_CONNECTION_PARTS = (
    *("register_handler", "unregister_handler", "queue_message", "_incoming_handlers"),
    *("get_message_buffer", "_live_connections"),
)


# Whether it is the viser that this file knows.


def what_changed() -> str | None:
    """The message or method that is not as it is relied on; None where all are."""
    for name, wanted in _FIELDS.items():
        kind = getattr(messages, name, None)
        fields = {field.name for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else None
        if fields is None or not fields.issuperset(wanted):
            return f"its message {name} has changed"
    for name, wanted in _METHODS.items():
        method = getattr(viser.GuiApi, name, None)
        if method is None or tuple(inspect.signature(method).parameters) != wanted:
            return f"its method {name} has changed"
    return None


def what_is_missing(server: viser.ViserServer) -> str | None:
    """What a server lacks of that by which uploads and values are taken over; None where it lacks nothing."""
    for owner, names in ((server.gui, _GUI_PARTS), (getattr(server, "_websock_server", None), _CONNECTION_PARTS)):
        missing = [name for name in names if not hasattr(owner, name)]
        if missing:
            return f"{type(owner).__name__} has no {missing[0]}"
    if server.gui._websock_interface is not server._websock_server:
        return "controls receive messages by another way"
    return None


def answered_to_all(server: viser.ViserServer) -> str | None:
    """A message that a server answers whoever sends it, and should not; None where there is none."""
    handlers = server._websock_server._incoming_handlers
    return next((f"it still answers {name}" for name in _CLOSED if handlers.get(getattr(messages, name))), None)


# Starting. Replaced by: a parameter of ViserServer for each.


def page_html() -> str:
    """The page that viser serves."""
    return (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")


@contextlib.contextmanager
def serving_through(serve: Callable[..., Any]) -> Iterator[None]:
    """Let a server that is made within this context listen by ``serve(real, ...)``: it looks that up by name."""
    real = websocket_server.serve
    websocket_server.serve = functools.partial(serve, real)  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        websocket_server.serve = real


def log_failures_by(log: Callable[[Future[Any]], None]) -> None:
    """Log what fails in a callback, in place of a traceback in the terminal."""
    for module in (viser._gui_api, viser._scene_api, viser._viser):
        module.__dict__["print_threadpool_errors"] = log


def log_unhandled_by(server: viser.ViserServer, log: Callable[[asyncio.AbstractEventLoop, Any], None]) -> None:
    """Log what nobody handles in the server's loop."""
    server._event_loop.call_soon_threadsafe(server._event_loop.set_exception_handler, log)


@contextlib.contextmanager
def icons_from_one_archive() -> Iterator[None]:
    """Let viser read its archive of 5,000 icons once, where it would read it anew for each: 20 ms a button."""
    names = icons.__dict__
    zipfile = names["zipfile"]
    with ZipFile(icons.ICONS_DIR / "tabler-icons.zip") as archive:
        names["zipfile"] = SimpleNamespace(ZipFile=lambda path: contextlib.nullcontext(archive))
        try:
            yield
        finally:
            names["zipfile"] = zipfile


# Saving. Replaced by: a serializer that takes messages.


def page_of_scene(server: viser.ViserServer) -> str:
    """A page that draws the 3D scene as it is now, without a server.

    Each browser is shown the scene once it has the rest of its page; nobody would show it to a saved page.
    """
    serializer = server.get_scene_serializer()
    serializer._insert_message(messages.SetSceneNodeVisibilityMessage("", True))
    quiet = "<head><style>#webgl-software-rendering { display: none }</style>"  # that it draws slowly
    return serializer.as_html().replace("<head>", quiet, 1)


# Controls. Replaced by: public properties of the handles, a way to look them up, and events that have the value.


def identity(handle: Any) -> str:
    """The id by which the page knows a control."""
    return handle._impl.uuid


def hear_values(handle: Any, hear: Callable[[dict[str, Any]], None]) -> None:
    """Call ``hear`` with what a browser sets of a control, as ``{"value": 5.0}``, before any callback is called.

    The handle may have another value by then: that which the program has just set in another thread.
    """
    tell_others = handle._impl.sync_cb

    def hear_and_tell(client_id: int, updates: dict[str, Any]) -> None:
        hear(updates)
        tell_others(client_id, updates)

    handle._impl.sync_cb = hear_and_tell


def show_again(notice: viser.NotificationHandle) -> None:
    """Show a notification that may have been closed by hand; nothing happens where it is still there."""
    notice._show()


def hear_only_values(passes: Callable[[viser.ClientHandle, Any, Any], bool]) -> None:
    """Let browsers update controls only where ``passes(client, handle, updates)``, and mark only forms that there are.

    Replaced by: viser holding to a control's own limits.
    """
    update, mark = map(inspect.unwrap, (viser.GuiApi._handle_gui_updates, viser.GuiApi._handle_gui_form_dirty))

    @functools.wraps(update)
    async def update_if_right(gui: viser.GuiApi, client_id: Any, message: messages.GuiUpdateMessage) -> None:
        handle, client = gui._gui_input_handle_from_uuid.get(message.uuid), gui._resolve_client(client_id)
        if handle is not None and client is not None and passes(client, handle, message.updates):
            await update(gui, client_id, message)

    @functools.wraps(mark)
    async def mark_if_there(gui: viser.GuiApi, client_id: Any, message: messages.GuiFormDirtyMessage) -> None:
        if message.uuid in gui._container_handle_from_uuid:  # the message is kept for each browser that comes
            await mark(gui, client_id, message)

    setattr(viser.GuiApi, "_handle_gui_updates", update_if_right)  # noqa: B010
    setattr(viser.GuiApi, "_handle_gui_form_dirty", mark_if_there)  # noqa: B010


# Connections. Replaced by: the connection among the properties of ClientHandle, and a setter for one browser's value.


def connections(server: viser.ViserServer) -> dict[int, Any]:
    """The WebSockets that are open, by the id of their client."""
    return dict(server._websock_server._live_connections)


def send_value(client: viser.ClientHandle, handle: Any) -> bool:
    """Send one browser the value in force of a control; False where it is gone."""
    buffer = client.gui._websock_interface.get_message_buffer()
    if not buffer.done:
        buffer.push(messages.GuiUpdateMessage(identity(handle), {"value": handle._impl.value}))
    return not buffer.done


def protect_broadcasts(server: viser.ViserServer) -> None:
    """Let nothing enter the messages for all browsers that cannot be sent.

    viser finds that out while it sends, which closes every browser, and each new one. Here whoever queues such a
    message gets the ValueError. Replaced by: viser packing a message when it is queued.
    """
    buffer = server._websock_server.get_message_buffer()
    push = buffer.push

    def push_if_sendable(message: messages.Message) -> None:
        try:
            msgspec.msgpack.encode(message.as_serializable_dict([]))
        except Exception as error:
            raise ValueError(f"{type(message).__name__} cannot be sent: {error}") from error
        push(message)

    setattr(buffer, "push", push_if_sendable)  # noqa: B010


class _EventOfLoop(asyncio.Event):
    """An event that another thread may set: then it only becomes true, and whoever waits is woken by its loop.

    The other thread may have a loop of its own.
    """

    def set(self) -> None:
        waited_in = getattr(self, "_loop", None)  # None before anybody waits
        if waited_in is not None and asyncio._get_running_loop() is waited_in:
            self._value = False  # or it would wake nobody
            super().set()
        else:
            self._value = True


def wake_from_the_loop() -> None:
    """Let no thread but the loop's walk through those who wait for messages.

    viser sets a buffer's event from whichever thread queues a message, and once more in the loop. The first walks
    through the waiting browsers while the loop takes them out, and now and then ends in a RuntimeError that stops
    whoever queued the message. Replaced by: viser setting it in the loop alone.
    """
    begin = AsyncMessageBuffer.__init__
    if hasattr(begin, "__wrapped__"):
        return

    @functools.wraps(begin)
    def begin_with_our_event(buffer: AsyncMessageBuffer, *given: Any, **named: Any) -> None:
        begin(buffer, *given, **named)
        buffer.message_event.__class__ = _EventOfLoop

    setattr(AsyncMessageBuffer, "__init__", begin_with_our_event)  # noqa: B010


# Files from browsers. Replaced by: a cap on their size, and a callback that is given their bytes.


def refuse_from_all(server: viser.ViserServer) -> None:
    """Hear no wish to open the page to the internet, and of no file, which viser would keep for any control."""
    server._websock_server.unregister_handler(messages.ShareUrlRequest)
    _refuse_uploads(server.gui)


def _refuse_uploads(gui: viser.GuiApi) -> None:
    gui._websock_interface.unregister_handler(messages.FileTransferStartUpload, gui._handle_file_transfer_start)
    gui._websock_interface.unregister_handler(messages.FileTransferPart, gui._handle_file_transfer_part)


def take_uploads(gui: viser.GuiApi, start: Any, part: Any, finish: Any) -> dict[str, Any]:
    """Hear of files by these functions, in place of viser's own; returns the files under way."""
    _refuse_uploads(gui)
    gui._websock_interface.register_handler(messages.FileTransferStartUpload, start)
    gui._websock_interface.register_handler(messages.FileTransferPart, part)
    gui._finish_file_upload = finish
    return gui._current_file_upload_states  # pyright: ignore[reportAttributeAccessIssue]


def go_on(gui: viser.GuiApi, client_id: Any, message: "StartUpload | UploadPart") -> None:
    """Do as viser would with a file that will come, or a part of one."""
    if isinstance(message, messages.FileTransferStartUpload):
        gui._handle_file_transfer_start(client_id, message)
    else:
        gui._handle_file_transfer_part(client_id, message)


def release_upload_button(gui: viser.GuiApi, message: StartUpload) -> None:
    """Report a transfer as complete: the button waits for that, and viser cannot refuse a transfer."""
    gui._websock_interface.queue_message(
        messages.FileTransferPartAck(
            source_component_uuid=message.source_component_uuid,
            transfer_uuid=message.transfer_uuid,
            transferred_bytes=message.size_bytes,
            total_bytes=message.size_bytes,
        )
    )


def run_beside(gui: viser.GuiApi, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
    """Run a function in one of viser's threads."""
    return gui._thread_executor.submit(function, *arguments)
