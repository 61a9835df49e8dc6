"""What a browser may send: each kind of message with its fields, and each control with its values.

viser takes any message, casts any value to the control's type, and passes it on to all other browsers before our
callbacks see it; a number that does not fit into 64 bits would close them all. So every message is checked before viser
reads it.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any

import msgspec
import viser
from dockpose.app.web.server.viser_private import property_of
from dockpose.checks import one_line
from msgspec import Meta

LARGEST_BYTES = 64 * 2**10  # of a message that holds neither a part of a file nor a picture
LARGEST_PART_BYTES = 4 * 2**20  # viser's page sends parts of 512 KiB
LARGEST_FRAME_BYTES = 16 * 2**20  # a rendered picture of a 4K window
MOST_LETTERS = 10_000
_MOST_OF_ERROR = 100  # letters, for it may name what was sent
_MOST_PIXELS = 50_000_000  # of a rendered picture
_PNG = b"\x89PNG\r\n\x1a\n"
_MOST_WITHOUT_LIMITS = 1e9  # for controls that have none

_Id = Annotated[str, Meta(max_length=64)]
_Count = Annotated[int, Meta(ge=0, le=2**53)]
_Pixels = Annotated[float, Meta(ge=0, le=100_000)]
_Three = tuple[float, float, float]


class RefusedError(ValueError):
    """A message is refused; the text says why, without what was in it, and ``control`` is that of a wrong value."""

    def __init__(self, reason: str, control: str | None = None) -> None:
        super().__init__(reason if control is None else f"a value that is not taken: {reason}")
        self.reason, self.control = reason, control


class _Message(msgspec.Struct, tag=True, tag_field="type", forbid_unknown_fields=True, frozen=True):
    """Named as viser's own."""


class ViewerCameraMessage(_Message, frozen=True):
    """Where somebody looks from in the 3D view."""

    wxyz: tuple[float, float, float, float]
    position: _Three
    fov: float
    near: float
    far: float
    image_height: _Pixels
    image_width: _Pixels
    look_at: _Three
    up_direction: _Three


class _Value(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    value: (
        bool | int | float | Annotated[str, Meta(max_length=MOST_LETTERS)] | Annotated[list[float], Meta(max_length=4)]
    )


class GuiUpdateMessage(_Message, frozen=True):
    """The value of a control; no other of its properties."""

    uuid: _Id
    updates: _Value


class GuiFormSubmitMessage(_Message, frozen=True):
    """A form is sent off."""

    uuid: _Id


class GuiFormDirtyMessage(_Message, frozen=True):
    """Something in a form was changed."""

    uuid: _Id


class CommandTriggerMessage(_Message, frozen=True):
    """A command is given by its key."""

    uuid: _Id


class FileTransferStartUpload(_Message, frozen=True):
    """A file will come."""

    source_component_uuid: _Id
    transfer_uuid: _Id
    filename: Annotated[str, Meta(max_length=1000)]
    mime_type: Annotated[str, Meta(max_length=200)]
    part_count: _Count
    size_bytes: _Count


class FileTransferPart(_Message, frozen=True):
    """A part of a file."""

    source_component_uuid: _Id | None
    transfer_uuid: _Id
    part_index: _Count
    content: Annotated[bytes, Meta(max_length=LARGEST_PART_BYTES)]


class GetRenderResponseMessage(_Message, frozen=True):
    """The 3D view as a picture, which we asked for."""

    payload: bytes
    render_uuid: _Id


_SMALL = msgspec.msgpack.Decoder(
    ViewerCameraMessage
    | GuiUpdateMessage
    | GuiFormSubmitMessage
    | GuiFormDirtyMessage
    | CommandTriggerMessage
    | FileTransferStartUpload
    | FileTransferPart
    | GetRenderResponseMessage
)
_LARGE = msgspec.msgpack.Decoder(FileTransferPart | GetRenderResponseMessage)
_OF_VIEWERS = msgspec.msgpack.Decoder(ViewerCameraMessage)


def check_message(
    raw: bytes | str, find_control: Callable[[str], Any], find_form: Callable[[str], Any], *, only_views: bool = False
) -> Any:
    """Check what a browser sent."""
    if not isinstance(raw, bytes):
        raise RefusedError("a message as text, where all are binary")
    if only_views and len(raw) > LARGEST_BYTES:
        raise RefusedError(f"a message of {len(raw)} bytes from a viewer")
    decoder = _OF_VIEWERS if only_views else _SMALL if len(raw) <= LARGEST_BYTES else _LARGE
    try:
        message = decoder.decode(raw)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, OverflowError, MemoryError) as error:
        raise RefusedError(
            f"a message of {len(raw)} bytes that is not one of the page's ({one_line(str(error), _MOST_OF_ERROR)})"
        ) from error
    if isinstance(message, ViewerCameraMessage):
        _check_viewpoint(message)
    elif isinstance(message, GuiUpdateMessage):
        control = find_control(message.uuid)
        if control is None:
            raise RefusedError("a value for a control that does not exist")
        reason = why_not(control, message.updates.value)
        if reason is not None:
            raise RefusedError(reason, message.uuid)
    elif isinstance(message, GuiFormSubmitMessage | GuiFormDirtyMessage):
        if not isinstance(find_form(message.uuid), viser.GuiFormHandle):
            raise RefusedError("there is no such form")
    elif isinstance(message, GetRenderResponseMessage):
        _check_picture(message.payload)
    return message


def why_not(control: Any, value: Any) -> str | None:
    """Why a control of viser's cannot have a value; None where it can."""
    if getattr(control, "disabled", False):
        return "it cannot be used just now"
    if isinstance(control, viser.GuiUploadButtonHandle):
        return "an upload button has no value to set"
    if isinstance(control, viser.GuiButtonHandle | viser.GuiCheckboxHandle):
        return None if isinstance(value, bool) else "it is neither true nor false"
    if isinstance(control, viser.GuiDropdownHandle | viser.GuiButtonGroupHandle):
        options = property_of(control, "options")
        return None if isinstance(value, str) and value in options else "there is no such option"
    if isinstance(control, viser.GuiTextHandle):
        return None if isinstance(value, str) else "it is not text"
    if isinstance(control, viser.GuiNumberHandle | viser.GuiSliderHandle):
        return _out_of_range(value, control.min, control.max, control.precision)
    if isinstance(control, viser.GuiVector2Handle):
        if not isinstance(value, list) or len(value) != 2:
            return "it is not a pair of numbers"
        lows, highs = control.min or (None, None), control.max or (None, None)
        parts = (_out_of_range(*part, control.precision) for part in zip(value, lows, highs, strict=True))
        return next((reason for reason in parts if reason is not None), None)
    return "nobody sets this control"


def _out_of_range(value: Any, low: float | None, high: float | None, decimals: int) -> str | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "it is not a number"
    if not math.isfinite(value):
        return "it is not finite"
    rounding = 0.5 * 10.0**-decimals + 1e-9 * max(abs(low or 0), abs(high or 0))  # the page sends what it shows
    low = -_MOST_WITHOUT_LIMITS if low is None else low
    high = _MOST_WITHOUT_LIMITS if high is None else high
    if not low - rounding <= value <= high + rounding:
        return f"{value:.10g} is outside {low:g} to {high:g}"
    return None


def _check_viewpoint(message: ViewerCameraMessage) -> None:
    numbers = (*message.wxyz, *message.position, *message.look_at, *message.up_direction)
    if not all(map(math.isfinite, (*numbers, message.fov, message.near, message.far))):
        raise RefusedError("a viewpoint that is not finite")


def _check_picture(payload: bytes) -> None:
    """A rendered picture is a PNG file whose first chunk has its size; an empty one says that it could not be drawn."""
    if payload and not (payload.startswith(_PNG) and payload[12:16] == b"IHDR"):
        raise RefusedError("a rendered picture that is not a PNG file")
    width, height = int.from_bytes(payload[16:20]), int.from_bytes(payload[20:24])
    if width * height > _MOST_PIXELS:
        raise RefusedError(f"a rendered picture of {width} x {height} pixels")
