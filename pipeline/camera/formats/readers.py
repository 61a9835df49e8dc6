"""One table of readers: what tells each program's form, and what makes cameras of it, in OpenCV's numbers."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.files import FileError
from dockpose.text import shown

_MOST_SKEW = 1e-3  # of fx
_MOST_CAMERAS, _MOST_LEVELS = 100, 3
# Coefficients in OpenCV's order, and in that of its fisheye model (Kannala and Brandt 2006), by their usual names.
_TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "taux", "tauy")
_FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
# How many coefficients lens models have, by their names without capitals and signs.
_ANY = (0, 4, 5, 8, 12, 14)
_MODELS = {
    **{"plumbbob": (0, 4, 5), "rationalpolynomial": (0, 8, 12, 14), "radtan": (0, 4), "radialtangential": (0, 4, 5)},
    **{
        "brownconrady": (0, 4, 5),
        "none": (0,),
        **dict.fromkeys(("", "pinhole", "perspective", "opencv", "frame"), _ANY),
    },
    **dict.fromkeys(FISHEYES := ("equidistant", "fisheye", "equi", "kannalabrandt", "kannalabrandt8"), (0, 4)),
}
# What scripts call the same things, without capitals and signs; of several cameras with one of the pairs behind.
_MATRICES = ("cameramatrix", "intrinsicmatrix", "mtx", "cammatrix", "cammtx", "cameraintrinsics", "intrinsics")
_SHORT_MATRICES = ("intrinsic", "matrix", "k", "m", "kk")
_BENT = ("distortioncoefficients", "distcoeffs", "distcoeff", "dist", "d", "distortion", "distortioncoeffs")
_BENT += ("distcoefs", "distcoef", "distortions", "coeffs", "kc")
_PAIRS = ("", "0", "1", "2", "l", "r", "left", "right")
_SIZES = ("imagesize", "resolution", "imgsize", "size")
_WIDTHS, _HEIGHTS = ("imagewidth", "width", "w", "imgwidth"), ("imageheight", "height", "h", "imgheight")
_MODEL_NAMES = ("distortionmodel", "cameramodel", "modeltype", "model", "projection")
# COLMAP's parameters of each camera model.
_COLMAP = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
}
Fields = Mapping[str, Any]


class NoSizeError(FileError):
    """A camera file does not say for which size of pictures it is."""


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
            raise ValueError(
                f"camera_matrix is {self.matrix.tolist()}; it must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
            )
        if (lengths := _MODELS.get(plain(self.model))) is None:
            known = ", ".join(filter(None, _MODELS))
            raise ValueError(
                f"distortion_model is {shown(self.model)}, which is not read; calibrate with one of {known}"
            )
        bent = self.distortion
        if 8 < len(bent) <= 14:
            bent = next(bent[:count] for count in (5, 8, 12, 14) if not any(bent[count:]))
        if not {len(bent), len(self.distortion)} & {0, *lengths}:
            wanted = " or ".join(map(str, filter(None, lengths)))
            raise ValueError(f"distortion_coefficients has {len(self.distortion)} values; {self.model} has {wanted}")
        if self.size is None and size is None:
            raise NoSizeError(
                "does not say for which pictures it is (image_width, image_height); say --camera-size WxH"
            )
        for note in (f"its skew of {skew:g} pixels is taken as none" if skew else "", self.note):
            if note:
                tell(note)
        width, height = self.size or size or (0, 0)
        return Camera(fx, fy, cx, cy, width, height, bent, fisheye=plain(self.model) in FISHEYES)


def cameras_in(content: Any, levels: int = _MOST_LEVELS) -> dict[str, Described]:
    """All cameras that a file describes, by their names; none where no reader knows it."""
    if isinstance(content, list):
        content = dict(enumerate(content[:_MOST_CAMERAS]))
    if not isinstance(content, Mapping) or levels == 0:
        return {}
    for knows, read in READERS:
        if knows(content):
            return dict(islice(read(content), _MOST_CAMERAS))
    found: dict[str, Described] = {}
    for key, each in islice(content.items(), _MOST_CAMERAS):
        inner = cameras_in(each, levels - 1)
        found |= {str(key): camera for camera in inner.values()} if len(inner) == 1 else inner
    return found


def is_known(content: Fields) -> bool:
    """Whether a reader knows what stands in a file."""
    return any(knows(content) for knows, _ in READERS)


def plain(name: Any) -> str:
    """A name without capitals and signs."""
    return re.sub(r"[^a-z0-9]", "", str(name).lower())


def _folded(content: Fields) -> dict[str, Any]:
    return {plain(key): value for key, value in content.items()}


def _first(fields: Fields, names: tuple[str, ...], default: Any = None) -> Any:
    return next((fields[name] for name in names if fields.get(name) is not None), default)


def _numbers(name: str, value: Any) -> np.ndarray:
    """An array of numbers: of a list of lists, of OpenCV's rows, cols and data, or of text."""
    if isinstance(value, Mapping):
        array, (rows, cols) = (
            _numbers(f"{name}.data", value.get("data")).ravel(),
            (_number(value, each) for each in ("rows", "cols")),
        )
        if rows < 0 or cols < 0 or rows * cols != array.size:
            raise ValueError(f"{name} says {rows:g} x {cols:g}, but its data has {array.size} values")
        return array.reshape(int(rows), int(cols))
    try:
        return np.array(value.split() if isinstance(value, str) else value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is {shown(value)}; it must be numbers") from error


def _number(fields: Fields, name: str, default: Any = None) -> float:
    value = fields.get(name, default)
    array = np.zeros(0) if value is None or isinstance(value, Mapping) else _numbers(name, value)
    if array.size != 1:
        raise ValueError(f"{name} is {'missing' if value is None else shown(value)}; it must be a number")
    return float(array.ravel()[0])


def _matrix(name: str, value: Any) -> np.ndarray:
    """An intrinsic matrix (3, 3); one that lies on its side, as MATLAB's did, is turned."""
    array = _numbers(name, value)
    if array.shape not in ((3, 3), (9,)):
        raise ValueError(f"{name} is {' x '.join(map(str, array.shape)) or shown(value)}; it must be 3 x 3")
    array = array.reshape(3, 3)
    return array.T.copy() if not array[:2, 2].any() and array[2, :2].any() else array


def _four(fx: float, fy: float, cx: float, cy: float, skew: float = 0) -> np.ndarray:
    return np.array([[fx, skew, cx], [0, fy, cy], [0, 0, 1]])


def _size(fields: Fields) -> tuple[Any, Any] | None:
    """Width and height by whatever keys; None where they are not there."""
    found: Any = [_first(fields, _WIDTHS), _first(fields, _HEIGHTS)]
    if found[0] is None or found[1] is None:
        found = _first(fields, _SIZES, ())
    numbers = _numbers("image size", list(found.values()) if isinstance(found, Mapping) else found).ravel().tolist()
    width, height = (int(each) if each.is_integer() else each for each in numbers) if len(numbers) == 2 else (0, 0)
    return (width, height) if len(numbers) == 2 else None


def _named(fields: Fields, model: str = "", size: Any = None, note: str = "", shift: float = 0) -> Described:
    """A camera whose numbers stand one by one under their usual names; its pixel centres are ``shift`` off integers."""
    fx = _number(fields, "fx", fields.get("f"))
    fy = _number(fields, "fy", fx * _number(fields, "ar", 1))
    K = _four(fx, fy, _number(fields, "cx") - shift, _number(fields, "cy") - shift, _number(fields, "skew", 0))
    terms = _FISHEYE_TERMS if plain(model) in FISHEYES else _TERMS
    return Described(K, [_number(fields, each, 0) for each in terms], size or _size(fields), model, note)


def _refuse(kind: str, name: Any, instead: str) -> ValueError:
    return ValueError(f"its {kind} {shown(name)} is not read; {instead}")


def _kalibr(content: Fields) -> Iterator[tuple[str, Described]]:
    """Kalibr's camchain, and the sensor.yaml of data sets like EuRoC."""
    for key, known in (("camera_model", ("pinhole",)), ("distortion_model", _MODELS)):
        if plain(content.get(key, "pinhole")) not in known:
            raise _refuse(key.replace("_", " "), content[key], "calibrate with pinhole-radtan or pinhole-equi")
    values = _numbers("intrinsics", content["intrinsics"]).ravel().tolist()
    if len(values) != 4:
        raise ValueError(f"intrinsics has {len(values)} values; pinhole has 4")
    bent = _numbers("distortion_coeffs", _first(_folded(content), _BENT, [])).ravel().tolist()
    yield "", Described(_four(*values), bent, _size(content), str(content.get("distortion_model", "none")))


def _orbslam(content: Fields) -> Iterator[tuple[str, Described]]:
    """Settings of ORB-SLAM 2 and 3; the latter numbers its cameras."""
    shared = {key[7:].lower(): value for key, value in content.items() if key.startswith("Camera.")}
    for name in ("Camera", "Camera1", "Camera2"):
        if f"{name}.fx" in content:
            own = {key.partition(".")[2].lower(): each for key, each in content.items() if key.startswith(f"{name}.")}
            model = str(shared.get("type", "PinHole"))
            yield name, _named(own, "" if plain(model) == "rectified" else model, _size(shared))


def _camodocal(content: Fields) -> Iterator[tuple[str, Described]]:
    """What camodocal writes, as for VINS."""
    model = content.get("model_type", "PINHOLE")
    names = {"mu": "fx", "mv": "fy", "u0": "cx", "v0": "cy", "k2": "k1", "k3": "k2", "k4": "k3", "k5": "k4"}
    if model not in ("PINHOLE", "PINHOLE_FULL", "KANNALA_BRANDT"):
        raise _refuse("camera model", model, "calibrate with PINHOLE or KANNALA_BRANDT")
    is_fisheye = model == "KANNALA_BRANDT"
    parts = [content.get(name) or {} for name in ("projection_parameters", "distortion_parameters")]
    given = {str(key): value for part in parts for key, value in part.items()}
    fields = {names.get(key, key): value for key, value in given.items()} if is_fisheye else given
    yield "", _named(fields, "fisheye" if is_fisheye else "", _size(_folded(content)))


def _calibio(content: Fields) -> Iterator[tuple[str, Described]]:
    """JSON of calib.io's program, whose fy is f times an aspect ratio."""
    for number, camera in enumerate(content["Calibration"]["cameras"]):
        name, about = camera["model"]["polymorphic_name"], camera["model"]["ptr_wrapper"]["data"]
        if name.rpartition("CameraModel")[2] not in ("OpenCV", "KannalaBrandt"):
            raise _refuse("camera model", name, "export it as OpenCV's")
        fields = {key.lower(): each.get("val") for key, each in about["parameters"].items()}
        size = _size(_folded(about["CameraModelCRT"]["CameraModelBase"]))
        yield f"cam{number}", _named(fields, name.rpartition("CameraModel")[2], size)


def _matlab(content: Fields) -> Iterator[tuple[str, Described]]:
    """MATLAB's cameraParameters as toStruct gives them, whose pixels count from 1, and whose size is the matrix's."""
    fields = _folded(content)
    if (matrix := _first(fields, ("k", "intrinsicmatrix"))) is not None:
        K = _matrix("IntrinsicMatrix", matrix)
    else:
        four = [_numbers(name, fields.get(name)).ravel() for name in ("focallength", "principalpoint")]
        K = _four(*np.concatenate(four).tolist(), skew=_number(fields, "skew", 0))
    radial, tangential = (_numbers(name, fields.get(name, [0, 0])).ravel().tolist()
                          for name in ("radialdistortion", "tangentialdistortion"))  # fmt: skip
    size = _size({"size": fields.get("imagesize")})
    note = "MATLAB counts pixels from 1; its principal point is moved by one pixel"
    K = K - np.array([[0, 0, 1], [0, 0, 1], [0, 0, 0]])
    yield "", Described(K, [*radial[:2], *tangential, *radial[2:]], size and size[::-1], note=note)


def _agisoft(content: Fields) -> Iterator[tuple[str, Described]]:
    """Agisoft's XML: Metashape's principal point counts from the picture's middle, that of Lens from its corner."""
    fields, model = {key: value for key, value in content.items() if value}, str(content["projection"])
    for name in ("k4", "p3", "p4") if model == "frame" else ("p1", "p2"):
        if _number(fields, name, 0):
            raise ValueError(f"its {name} has no place in OpenCV's lens model; optimise without {name}, export again")
    size = _size(fields)
    if "f" in fields and size is not None:
        f, middle = _number(fields, "f"), {"cx": size[0] / 2, "cy": size[1] / 2}
        fields |= {name: value + _number(fields, name, 0) for name, value in middle.items()}
        fields |= {"fx": f + _number(fields, "b1", 0), "fy": f, "skew": _number(fields, "b2", 0)}
        fields |= {"p1": fields.get("p2", 0), "p2": fields.get("p1", 0)}
    yield "", _named(fields, model, size, shift=0.5)


def _colmap(content: Fields) -> Iterator[tuple[str, Described]]:
    """A line of COLMAP's cameras.txt."""
    model, (width, height, *values) = content["colmap"], content["numbers"]
    if model not in _COLMAP:
        raise _refuse("camera model", model, "let COLMAP refine one of " + ", ".join(_COLMAP))
    names = _COLMAP[model].split()
    if len(values) != len(names):
        raise ValueError(f"{model} has {len(names)} parameters; the line has {len(values)}")
    note = "COLMAP has the centre of the first pixel at 0.5; its principal point is moved by half a pixel"
    lens = "fisheye" if "FISHEYE" in model else ""
    yield "", _named(dict(zip(names, values, strict=True)), lens, _size({"size": [width, height]}), note, shift=0.5)


def _holds_nine(value: Any) -> bool:
    return np.array(value.get("data") if isinstance(value, Mapping) else value, dtype=object).size == 9


def _matrices(content: Fields) -> list[tuple[str, str]]:
    """Keys of matrices, each with what tells the cameras apart."""
    found = []
    for key, value in content.items():
        for alias in (*_MATRICES, *_SHORT_MATRICES):
            name, rest = plain(key), plain(key).removeprefix(alias)
            is_sure = rest == "" and alias in _MATRICES
            if name.startswith(alias) and rest in _PAIRS and (is_sure or _holds_nine(value)):
                found.append((key, rest))
    return found


def _by_matrix(content: Fields) -> Iterator[tuple[str, Described]]:
    """A matrix and coefficients under whatever keys: ROS's, OpenCV's of all years, those of scripts."""
    fields = _folded(content)
    for key, which in _matrices(content):
        K = _matrix(key, content[key])
        bent = _numbers("distortion_coefficients", _first(fields, tuple(f"{each}{which}" for each in _BENT), []))
        size, roi = _size(fields), fields.get("roi")
        if isinstance(roi, Mapping) and _number(roi, "width", 0) and _number(roi, "height", 0):
            size = _size(roi)
            K = K - np.array([[0, 0, _number(roi, "x_offset", 0)], [0, 0, _number(roi, "y_offset", 0)], [0, 0, 0]])
        model = "fisheye" if _number(fields, "fisheyemodel", 0) else _first(fields, _MODEL_NAMES, "")
        yield which, Described(K, bent.ravel().tolist(), size, model if isinstance(model, str) else "")


def _by_names(content: Fields) -> Iterator[tuple[str, Described]]:
    """Numbers under their names, as by scripts and by the tools of RealSense."""
    fields = _folded(content)
    bent = _numbers("coeffs", _first(fields, _BENT, [])).ravel().tolist()
    fields = {"cx": fields.get("ppx"), "cy": fields.get("ppy"), **dict(zip(_TERMS, bent, strict=False)), **fields}
    yield "", _named(fields, str(_first(fields, _MODEL_NAMES, "")))


# What tells a form, and what reads it; the first that knows it counts.
READERS: tuple[tuple[Callable[[Fields], Any], Callable[[Fields], Iterator[tuple[str, Described]]]], ...] = (
    (lambda content: "colmap" in content, _colmap),
    (lambda content: "agisoft" in content, _agisoft),
    (lambda content: any(re.fullmatch(r"Camera[12]?\.fx", str(key)) for key in content), _orbslam),
    (lambda content: "projection_parameters" in content, _camodocal),
    (lambda content: "Calibration" in content, _calibio),
    (lambda content: "RadialDistortion" in content, _matlab),
    (lambda content: "intrinsics" in content and ("camera_model" in content or "distortion_model" in content), _kalibr),
    (_matrices, _by_matrix),
    (lambda content: {"fx", "width"} <= content.keys() or {"fx", "cx"} <= content.keys(), _by_names),
)
