"""What a browser may set a control to; of another value it is shown the one in force.

viser takes any property and value and passes it on to all other browsers before our callbacks see it; a number that
does not fit into 64 bits would close them all.
"""

import math
from collections.abc import Mapping
from typing import Any

import viser
from dockpose.app.web.server.journal import JOURNAL
from dockpose.app.web.server.viser_private import send_value

MOST_LETTERS = 10_000
_MOST_WITHOUT_LIMITS = 1e9  # for controls that have none


def passes(client: viser.ClientHandle, control: Any, updates: Mapping[str, Any]) -> bool:
    """Whether a control may be updated so by a browser, which else is sent the value in force; on the event loop."""
    is_value = isinstance(updates, Mapping) and list(updates) == ["value"]
    reason = why_not(control, updates["value"]) if is_value else "no more than its value can be set"
    if reason is None:
        return True
    JOURNAL.note(f"browser {client.client_id}", f"refused a value that is not taken: {reason}")
    if is_value and hasattr(control, "label") and send_value(client, control):
        client.add_notification("Not taken", f"{control.label}: {reason}.", color="yellow")
    return False


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
        return (
            None
            if isinstance(value, str) and len(value) <= MOST_LETTERS
            else f"it is no text of up to {MOST_LETTERS} letters"
        )
    if isinstance(control, viser.GuiNumberHandle | viser.GuiSliderHandle):
        low, high = getattr(control, "widest", (control.min, control.max))  # more than a slider's track can be typed
        return _out_of_range(value, low, high, control.precision)
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
