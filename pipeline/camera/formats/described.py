"""A camera as a file describes it, and what its program calls the lens model."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.formats.fields import LENS_WORDS, MODEL, MOST_OFF, Fields, plain
from dockpose.files import FileError
from dockpose.text import shown

_MOST_SKEW = 1e-3  # of fx
_LEAST_FOCAL = 0.1  # of the width, which no lens falls short of
_ALIKE = 0.05
# How many coefficients lens models have, by their names without capitals and signs.
_PLAIN = ("", "pinhole", "perspective", "opencv", "frame", "rectilinear", "linear")
_FISHEYES = ("equidistant", "fisheye", "equi", "kannalabrandt", "kannalabrandt4", "kannalabrandt8", "kannala", "kb")
_FISHEYES += ("kb4", "kb8", "opencvfisheye", "fisheyeopencv", "equidistantfisheye", "kannalabrandtfisheye")
_COUNTS = {
    "brownconrady brown radialtangential plumbbob radtan radtan5 brown5 opencv5 opencvstandard": (0, 4, 5),
    "rationalpolynomial rational opencv8 opencv12 radtan8 brownconrady8 opencvrational": (0, 8, 12, 14),
    "radtan4 opencv4": (0, 4),
    "none inversebrownconrady modifiedbrownconrady": (0,),
}
MODELS = {name: counts for names, counts in _COUNTS.items() for name in names.split()}
MODELS |= dict.fromkeys(_PLAIN, (0, 4, 5, 8, 12, 14)) | dict.fromkeys(_FISHEYES, (0, 4))
_KNOWN = "plumb_bob, rational_polynomial, radtan, equidistant, fisheye, kannala_brandt or pinhole"
# MC-Calib's distortion_type, DepthAI's cameraType, and the model that RealSense's library counts, beside its ppx.
_NUMBERED = {"distortiontype": ("brown", "fisheye"), "cameratype": ("perspective", "fisheye"), "distortionmodel": ()}
_REALSENSE = ("none", "modified Brown", "inverse Brown Conrady", "ftheta", "brown", "kannala brandt4")
_SURE_MODEL = re.compile("dist|lensmodel|projection(model|type)|intrinsic|modeltype")
_FISHEYE_FLAG = re.compile("(is|use)?fisheye(model|lens)?")


class NoSizeError(FileError):
    """A camera file does not say for which size of pictures it is."""


def lens_name(model: Any) -> str:
    """A lens model's name as it stands in the table, or as it would if it were there."""
    name = plain(model)
    for head in ("lensmodel", "distortion", "cameratype", "cameramodel", "pinhole", "perspective"):
        name = name.removeprefix(head) or name
    return name


def is_fisheye(model: str) -> bool:
    """Whether it is OpenCV's fisheye model under one of its names."""
    return lens_name(model) in _FISHEYES


def model_in(fields: Fields) -> str:
    """The lens model that a file tells under any key; ValueError where two contradict. No device's name is one."""
    found: dict[str, str] = {}
    for key, value in fields.named(MODEL):
        text, last = str(value).strip(), plain(key.rpartition(".")[2])
        if text.isdigit():
            names = _REALSENSE if last == "model" and "ppx" in fields else _NUMBERED.get(last)
            if names is None:
                continue
            text = names[int(text)] if len(text) == 1 and int(text) < len(names) else f"number {text}"
            found[text] = key
        if lens_name(text) in MODELS or _SURE_MODEL.search(last) or LENS_WORDS.search(plain(text)):
            found[text] = key
            fields.mark(key)
    for key, value in fields.named(_FISHEYE_FLAG):
        if str(value).lower() in ("true", "false") or not isinstance(value, (list, str)) or str(value).isdigit():
            fields.mark(key)
            found |= {"fisheye": key} if str(value).lower() not in ("0", "0.0", "false", "none") else {}
    strange = [each for each in found if lens_name(each) not in MODELS]
    told = strange or [each for each in found if lens_name(each) not in _PLAIN]
    if strange:
        raise _unknown(found[strange[0]], strange[0])
    for other in told[1:]:
        if is_fisheye(other) != is_fisheye(told[0]):
            raise ValueError(f"its {found[told[0]]} says {told[0]} and its {found[other]} {other}; which is it?")
    return next(iter([*told, *found]), "")


def _unknown(key: str, model: str) -> ValueError:
    return ValueError(f"its {key} is {shown(model)}, which is not read; calibrate with {_KNOWN}")


@dataclass(frozen=True)
class Described:
    """A camera as a file describes it, with pixel centres at integers."""

    matrix: np.ndarray  # (3, 3)
    distortion: list[float]  # in OpenCV's order
    size: tuple[Any, Any] | None  # width and height, where the file says it
    model: str = ""  # of the lens, as the file calls it
    note: str = ""  # what was changed in its numbers

    def camera(self, size: tuple[int, int] | None, tell: Callable[[str], None]) -> Camera:
        """The camera, for pictures of that size where the file does not say it."""
        (fx, skew, cx), (zero, fy, cy), last = self.matrix.tolist()
        if zero != 0 or last != [0, 0, 1] or not abs(skew) <= _MOST_SKEW * abs(fx):
            must = "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
            raise ValueError(f"camera_matrix is {self.matrix.tolist()}; it must be {must}")
        if (lengths := MODELS.get(lens_name(self.model))) is None:
            raise _unknown("distortion_model", self.model)
        bent = self.distortion
        if is_fisheye(self.model):  # of which DepthAI writes 14, and RealSense 5
            is_padded = (len(bent) > 8 or lens_name(self.model) == "kannalabrandt4") and not any(bent[4:])
            bent = bent[:4] if is_padded else bent
        elif 5 < len(bent) <= 14:
            bent = next(bent[:count] for count in (5, 8, 12, 14) if not any(bent[count:]))
        if lengths == (0,) and not any(bent):
            bent = []
        if not {len(bent), len(self.distortion)} & {0, *lengths}:
            wanted = " or ".join(map(str, filter(None, lengths))) or "none"
            has = f"distortion_coefficients has {len(self.distortion)} values"
            raise ValueError(f"{has}; {self.model or 'OpenCV'} has {wanted}")
        if self.size is None and size is None:
            missing = "does not say for which pictures it is (image_width, image_height)"
            raise NoSizeError(f"{missing}; say --camera-size WxH")
        notes = [f"its skew of {skew:g} pixels is taken as none" if skew else "", self.note]
        if len(bent) == 4 and any(bent) and not self.model:
            notes.append(
                "its four coefficients are taken for k1, k2, p1, p2; if it is a fisheye lens, "
                "write distortion_model: fisheye into it"
            )
        width, height = self.size or size or (0, 0)
        camera = Camera(fx, fy, cx, cy, width, height, bent, fisheye=is_fisheye(self.model))
        notes.append(self._off_middle(camera))
        for note in filter(None, notes):
            tell(note)
        return camera

    def _off_middle(self, camera: Camera) -> str:
        """What speaks against the size, of which half and double are taken for it by mistake; ValueError if guessed."""
        size = f"{camera.width} x {camera.height}"
        if max(camera.fx, camera.fy) < _LEAST_FOCAL * max(camera.width, camera.height):
            raise ValueError(f"its fx of {camera.fx:g} is no focal length in pixels of pictures {size}")
        shares = (2 * camera.cx + 1) / camera.width, (2 * camera.cy + 1) / camera.height
        told = f"its principal point ({camera.cx:g}, {camera.cy:g}) is far from the middle of pictures of {size}, "
        twice = f"{round(2 * camera.cx + 1)} x {round(2 * camera.cy + 1)}"
        if self.size is None and max(abs(each - 1) for each in shares) > MOST_OFF:
            text = f"does not say for which pictures it is, and {told}near that of {twice}; write image_width and "
            raise ValueError(f"{text}image_height into it, or say --camera-size WxH")
        is_alike = abs(shares[0] / shares[1] - 1) < _ALIKE if shares[1] else False
        if is_alike and abs(shares[0] - 1) > MOST_OFF:
            return f"{told}which it says, and near that of {twice}: check which it was calibrated with"
        return ""
