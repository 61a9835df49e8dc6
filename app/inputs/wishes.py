"""What a camera may be asked for, whether typed as arguments or on the page."""

import math
import re
from collections.abc import Mapping

from dockpose.app.errors import UserError
from dockpose.sources import Wishes

MOST_HZ = 1000.0
_FORMAT = re.compile(r"[A-Z0-9]{3,4}")


def wishes_from(given: Mapping[str, float | str | None], names: Mapping[str, str]) -> Wishes:
    """Wishes made of what was typed."""
    numbers = {name: _number(given[name], names[name]) for name in ("exposure", "gain", "rate_hz")}
    rate_hz = numbers["rate_hz"]
    if rate_hz is not None and not 0 < rate_hz <= MOST_HZ:
        raise UserError(f"{names['rate_hz']} is {rate_hz:g}; it must be above 0 and at most {MOST_HZ:g}")
    letters = str(given["format"] or "").strip().upper()
    if letters and not _FORMAT.fullmatch(letters):
        raise UserError(f"{names['format']} {letters}: must be the three or four letters of a format, as MJPG or Y16")
    return Wishes(exposure=numbers["exposure"], gain=numbers["gain"], rate_hz=rate_hz, format=letters or None)


def _number(value: float | str | None, name: str) -> float | None:
    if value is None or (isinstance(value, str) and not value.strip()):
        return None
    try:
        number = float(value)
    except ValueError as error:
        raise UserError(f"{name} is {value!r}; it must be a number") from error
    if not math.isfinite(number):
        raise UserError(f"{name} is {number:g}; it must be a number")
    return number
