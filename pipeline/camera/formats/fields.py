"""Keys and values of a camera file that remember what was read; a lens, model, size or matrix left over is refused."""

import itertools
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from dockpose.text import shown

_MOST_LEVELS, _MOST_LISTED = 4, 20
# Mappings in which parts of one camera stand, so that their keys count as its own.
_PARTS = re.compile(
    "dist|lens|intrin|fisheye|radial|tangential|imag|img|size|resol|dim|calib|param|focal|princip|model"
)
# What real files hold beside the camera that is read: boards, poses, errors, other pictures.
_HARMLESS = re.compile(
    r"err|rms|std|sigma|dev|covar|uncert|confid|limit|flag|board|pattern|square|marker|tag|grid|chess|corner|(?<!principal)points?$|object"
    r"|extrins|rectif|(coef\w*|matrix|mtx)(rows|cols)$|projection(matrix)?$|^proj|pose|quat|^q|rotat|rvec|^rot|trans|essential|fundamental|new|optim|undistorted|valid|distance"
    r"|^file|path|date|time|unit|note|polymorph|sensorsize|pixel|^(sensor|fov|hfov|vfov|board)|^p\d?$|^r\d?$|^num|^nr|^est"
)
_LENS = re.compile(
    r"dist|coef|radial|tangential|fish|poly|prism|brown|^(left|right|cam|l|r)?d(left|right|\d)?$|^[kps]\d+$|^tau"
    r"|^xi$|^alphac?$|^beta$|^skew$|^kc|^k$|bend|decent|lens(coef|par)|mirror|mappingcoef|stretch"
)
_DISTANCE = re.compile(r"(?<=\w)dist(?!o|c|\d|k\d)")
MODEL = re.compile(
    r"(dist\w*|cam(era)?|lens|projection|(camera)?intrinsics?|calibration)?(model|type|modeltype|projection)"
)
LENS_WORDS = re.compile(
    "fish|equi|kannala|brandt|^kb|brown|conrady|radtan|radial|plumb|rational|omni|mei$|unified|^e?ucm|^ds$|sphere|^fov$"
    "|atan|theta|poly|scara|ocam|division|prism|panoram|stereograph|cylind|cahv|splined"
)
_MATRIX = re.compile(
    r"matrix|mtx|intrin|^[kma]{1,2}\d?$|calib|camera|focal|^f[xyuv]?\d?$|^c[xyuv]\d?$|^pp[xy]?$|princip"
)
_LENGTH = re.compile(r"width|height|size|shape|resol|dim|^(w|h|nx|ny|cols|rows)$")
_MOST_BENT = 20  # of a lens's coefficients
_LEAST_PX = 64  # fewer are squares of a board
_OF = "(?:image|img|im|frame|camera|cam|calib|calibration|picture|pic|video|raw|native|imager)?"
_SIZE = re.compile(rf"{_OF}(size|shape|res|resolution|dims?|dimensions?)(px|pixels)?|s\d\d")  # KITTI's S_00
_WIDTH = re.compile(rf"{_OF}(width|w|cols|resx|sizex)(px|pixels)?|nx|w\d\d")
_HEIGHT = re.compile(rf"{_OF}(height|h|rows|resy|sizey)(px|pixels)?|ny|h\d\d")
MOST_OFF = 0.25  # of half the picture, that a principal point is off its middle


def plain(name: Any) -> str:
    """A name without capitals and signs."""
    return re.sub(r"[^a-z0-9]", "", str(name).lower())


class Fields:
    """What a mapping of a file holds; of the mappings ``above`` it, what is no camera of its own."""

    def __init__(self, content: Mapping[Any, Any], above: Mapping[Any, Any] | None = None) -> None:
        self.content, self.has_size, self.has_lens = content, False, False
        self._read: set[str] = set()
        # Key with those above it, name by which it is asked for, value.
        self.entries = [*_entries(content), *_entries(above or {})]
        self._by_name: dict[str, tuple[str, Any]] = {}
        for key, name, value in self.entries:
            if value is not None and name:
                self._by_name.setdefault(name, (key, value))

    def __contains__(self, key: Any) -> bool:
        return key in self.content

    def __getitem__(self, key: Any) -> Any:
        self.mark(str(key))
        return self.content[key]

    def get(self, name: str, default: Any = None) -> Any:
        """The value of a name, however it is spelt; that of a mapping's parts, too."""
        key, value = self._by_name.get(plain(name), (None, default))
        if key is not None:
            self.mark(key)
        return value

    def first(self, *names: str) -> Any:
        """The value of the first of the names that is there, and no mapping of parts; None without one."""
        for name in names:
            value = self._by_name.get(name, ("", None))[1]
            if value is not None and (not isinstance(value, Mapping) or "data" in value):
                return self.get(name)
        return None

    def below(self, head: str) -> "Fields":
        """What stands under names with that beginning, as ``Camera.``."""
        self.mark(*(str(key) for key in self.content if str(key).startswith(head)))
        return Fields({key[len(head) :]: self.content[key] for key in self.content if str(key).startswith(head)})

    def mark(self, *keys: str) -> None:
        """Keys, with all below them, are read."""
        self._read.update(keys)

    def named(self, names: re.Pattern[str]) -> Iterator[tuple[str, Any]]:
        """Keys and values of the names that fit, no mappings."""
        for key, name, value in self.entries:
            if name and value is not None and not isinstance(value, Mapping) and names.fullmatch(name):
                yield key, value

    def refuse_rest(self) -> None:
        """Raise ValueError where a key was not read that bears a lens, a model, a size or a matrix."""
        known = {0.0, 1.0}
        for key, _, value in self.entries:
            known.update(numbers_in(value) if self._is_read(key) else ())
        for key, _, value in self.entries:
            parts = [plain(part) for part in key.split(".")]
            if self._is_read(key) or any(map(_HARMLESS.search, parts)):
                continue
            if isinstance(value, str) and MODEL.fullmatch(parts[-1]) and LENS_WORDS.search(plain(value)):
                raise ValueError(f"its {key} {shown(value)} is not read; say the lens model as distortion_model")
            numbers = numbers_in(value)
            if not numbers or (set(numbers) <= known and value is not True):
                continue
            is_row = len(numbers) in (4, 5, 8, 12, 14) and max(map(abs, numbers)) < _MOST_BENT  # under a misspelt name
            is_row = is_row and not all(map(float.is_integer, numbers))
            if len(numbers) == 1:  # a length, such as min_dist
                parts = [_DISTANCE.sub("", part) for part in parts]
            if any(map(_LENS.search, parts)) or (is_row and not self.has_lens):
                raise ValueError(
                    f"its {key} is not read; call the lens's coefficients distortion_coefficients, in OpenCV's order, "
                    "and its model distortion_model; or leave the key out"
                )
            if any(map(_MATRIX.search, parts[-1:])) and _is_matrix(parts[-1], numbers):
                raise ValueError(f"its {key} is not read beside the matrix that is; leave one of them out")
            if not self.has_size and _LENGTH.search(parts[-1]) and min(numbers) >= _LEAST_PX:
                raise ValueError(f"its {key} is not read; call the size image_width and image_height, or leave it out")

    def _is_read(self, key: str) -> bool:
        return any(each in self._read for each in itertools.accumulate(key.split("."), lambda a, b: f"{a}.{b}"))


def _entries(content: Mapping[Any, Any]) -> list[tuple[str, str, Any]]:
    """Keys, names and values, those of the outermost mapping first."""
    level: list[tuple[str, str, bool, Mapping[Any, Any]]] = [("", "", True, content)]
    found: list[tuple[str, str, Any]] = []
    for _ in range(_MOST_LEVELS):
        inner: list[tuple[str, str, bool, Mapping[Any, Any]]] = []
        for path, above, is_part, mapping in level:
            for key, value in mapping.items():
                name = plain(key)
                found.append((f"{path}{key}", (above + name if name in ("x", "y") else name) if is_part else "", value))
                within = value
                if isinstance(value, list) and any(isinstance(each, Mapping) for each in value[:_MOST_LISTED]):
                    within = dict(enumerate(value[:_MOST_LISTED]))
                if isinstance(within, Mapping) and "data" not in within:
                    is_its = within is value and bool(_PARTS.search(name)) and not _HARMLESS.search(name)
                    inner.append((f"{path}{key}.", name, is_part and is_its, within))
        level = inner
    return found


def numbers_in(value: Any) -> list[float]:
    """The numbers of a number, of text that is one, of lists or a matrix of them; none of what is something else."""
    if isinstance(value, Mapping):
        value = value.get("data")
    try:
        array = np.array(value.split() if isinstance(value, str) else value, dtype=float).ravel()
    except (TypeError, ValueError, OverflowError):
        return []
    return [] if np.isnan(array).any() else array.tolist()


def _is_matrix(name: str, numbers: list[float]) -> bool:
    """Whether numbers may be an intrinsic matrix, or one of its four."""
    if len(numbers) == 9:
        return numbers[8] == 1 and min(abs(numbers[0]), abs(numbers[4])) > 2
    return bool(re.fullmatch(r"(f|c|pp)[xyuv]\d?|\w*intrin\w*|focallength\w|principal\w+[xy]", name))


def size_in(fields: Fields, middle: tuple[float, float]) -> tuple[Any, Any] | None:
    """Width and height by whatever keys, told apart where need be by where the middle is; None without them."""
    found = [(key, value, two) for key, value in fields.named(_SIZE) if (two := _two(key, value, middle))]
    for (x, width), (y, height) in zip(fields.named(_WIDTH), fields.named(_HEIGHT), strict=False):
        numbers = [*numbers_in(width), *numbers_in(height)]
        # What is no number is told as it is.
        two = (whole(numbers[0]), whole(numbers[1])) if len(numbers) == 2 else (width, height)
        if len(numbers) != 2 or min(numbers) >= _LEAST_PX or plain(x) not in ("cols", "w", "nx"):
            found.append((f"{x}, {y}", two, two))
    if not found:
        return None
    key, _, size = found[0]
    for other, _, two in found[1:]:
        if two != size:
            raise ValueError(f"its {key} says {size[0]} x {size[1]} and its {other} {two[0]} x {two[1]}; leave one out")
    fields.mark(*itertools.chain(*(each.split(", ") for each, _, _ in found)))
    fields.has_size = True
    return size


def _two(key: str, value: Any, middle: tuple[float, float]) -> tuple[Any, Any] | None:
    """Width and height of a pair, of text as 640x480, of the shape of an array; None of anything else."""
    numbers = numbers_in(value) or ([*map(float, re.findall(r"\d+", value))] if isinstance(value, str) else [])
    is_shape = plain(key.rpartition(".")[2]).endswith("shape")
    if len(numbers) == 3 and numbers[2] in (1, 3, 4):  # an array's, with its channels
        numbers = [numbers[1], numbers[0]]
        is_shape = False
    elif len(numbers) > 2 and numbers == numbers[:2] * (len(numbers) // 2):  # of several cameras, all alike
        numbers = numbers[:2]
    if len(numbers) != 2 or min(numbers) < 1:
        return None
    own, turned = (max(abs(2 * float(x) / w - 1) for x, w in zip(middle, each, strict=True))
                   for each in (numbers, numbers[::-1]))  # fmt: skip
    if is_shape and numbers[0] != numbers[1] and (min(own, turned) > MOST_OFF or abs(own - turned) < MOST_OFF / 2):
        raise ValueError(f"its {key} {shown(value)} may be height x width or not; say image_width and image_height")
    if turned < own and (is_shape or (own > MOST_OFF and turned <= MOST_OFF)):
        numbers.reverse()
    return whole(numbers[0]), whole(numbers[1])


def whole(number: float) -> float:
    """An int where it is one."""
    return int(number) if float(number).is_integer() else number
