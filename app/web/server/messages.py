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
from dockpose.text import one_line
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


class RefusedError(ValueError):
    """A message is refused; the text says why, without what was in it, and ``control`` is that of a wrong value."""

    def __init__(self, reason: str, control: str | None = None) -> None:
        super().__init__(reason if control is None else f"a value that is not taken: {reason}")
        self.reason, self.control = reason, control


class _Value(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    value: (
        bool | int | float | Annotated[str, Meta(max_length=MOST_LETTERS)] | Annotated[list[float], Meta(max_length=4)]
    )


def _kind(name: str, **fields: Any) -> Any:
    look: Any = {"tag": True, "tag_field": "type", "forbid_unknown_fields": True, "frozen": True}
    return msgspec.defstruct(name, list(fields.items()), **look)


_VIEWPOINT = {
    **dict.fromkeys(("position", "look_at", "up_direction"), tuple[float, float, float]),
    **dict.fromkeys(("fov", "near", "far"), float),
    **dict.fromkeys(("image_height", "image_width"), Annotated[float, Meta(ge=0, le=100_000)]),
}
ViewerCameraMessage = _kind("ViewerCameraMessage", wxyz=tuple[float, float, float, float], **_VIEWPOINT)
GuiUpdateMessage = _kind("GuiUpdateMessage", uuid=_Id, updates=_Value)  # its value, and no other of its properties
_FORM = tuple(_kind(name, uuid=_Id) for name in ("GuiFormSubmitMessage", "GuiFormDirtyMessage"))
_COMMAND = _kind("CommandTriggerMessage", uuid=_Id)
_START = _kind(
    "FileTransferStartUpload",
    source_component_uuid=_Id,
    transfer_uuid=_Id,
    filename=Annotated[str, Meta(max_length=1000)],
    mime_type=Annotated[str, Meta(max_length=200)],
    part_count=_Count,
    size_bytes=_Count,
)
_PART = _kind(
    "FileTransferPart",
    source_component_uuid=_Id | None,
    transfer_uuid=_Id,
    part_index=_Count,
    content=Annotated[bytes, Meta(max_length=LARGEST_PART_BYTES)],
)
_RENDERED = _kind("GetRenderResponseMessage", payload=bytes, render_uuid=_Id)  # a picture of the 3D view

_LARGE = msgspec.msgpack.Decoder(_PART | _RENDERED)
_SMALL = msgspec.msgpack.Decoder(
    ViewerCameraMessage | GuiUpdateMessage | _FORM[0] | _FORM[1] | _COMMAND | _START | _PART | _RENDERED
)
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
        numbers = (*message.wxyz, *message.position, *message.look_at, *message.up_direction)
        if not all(map(math.isfinite, (*numbers, message.fov, message.near, message.far))):
            raise RefusedError("a viewpoint that is not finite")
    elif isinstance(message, GuiUpdateMessage):
        control = find_control(message.uuid)
        if control is None:
            raise RefusedError("a value for a control that does not exist")
        reason = why_not(control, message.updates.value)
        if reason is not None:
            raise RefusedError(reason, message.uuid)
    elif isinstance(message, _FORM):
        if not isinstance(find_form(message.uuid), viser.GuiFormHandle):
            raise RefusedError("there is no such form")
    elif isinstance(message, _RENDERED):
        payload = message.payload  # a PNG file, whose first chunk has its size; empty where it could not be drawn
        if payload and not (payload.startswith(_PNG) and payload[12:16] == b"IHDR"):
            raise RefusedError("a rendered picture that is not a PNG file")
        width, height = int.from_bytes(payload[16:20]), int.from_bytes(payload[20:24])
        if width * height > _MOST_PIXELS:
            raise RefusedError(f"a rendered picture of {width} x {height} pixels")
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
        return None if isinstance(value, str) and value in control.options else "there is no such option"
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
