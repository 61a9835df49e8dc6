"""A pose measured by hand, of which any number may be blank, and numbers as people type them."""

import math

import msgspec
from dockpose.app.errors import UserError
from dockpose.pose.known import KnownPose

_UNFINISHED = {"-", "+", "−", ".", ",", "-.", "-,", "−.", "−,"}  # what a number that is being typed begins with


class MeasuredPose(msgspec.Struct, frozen=True):
    """Centimetres and degrees of the dock's centre and face; None for what was not measured."""

    x_cm: float | None = None
    y_cm: float | None = None
    z_cm: float | None = None
    theta_x_deg: float | None = None
    theta_y_deg: float | None = None

    @property
    def values(self) -> tuple[float | None, ...]:
        """The five numbers, in the order of the tables."""
        return msgspec.structs.astuple(self)

    @property
    def pose(self) -> KnownPose | None:
        """The whole pose; None where a number of it is blank."""
        x, y, z, theta_x, theta_y = self.values
        if x is None or y is None or z is None or theta_x is None or theta_y is None:
            return None
        return KnownPose((x / 100, y / 100, z / 100), theta_x, theta_y)


def typed_number(name: str, text: str, *, is_finished: bool = True) -> float | None:
    """Return a typed number, with a point or comma; None for a blank or, unless ``is_finished``, a lone minus."""
    text = text.strip()
    if not text or (not is_finished and text in _UNFINISHED):
        return None
    try:
        number = float(text.replace(",", ".").replace("−", "-"))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise UserError(f"{name} is {text!r}; it must be a number, or blank where not measured.")
    return number


def number_text(number: float | None) -> str:
    """Return a number as people type it; blank for None."""
    return "" if number is None else f"{number:.6f}".rstrip("0").rstrip(".")
