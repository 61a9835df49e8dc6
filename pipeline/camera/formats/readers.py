"""One table of readers: what tells each program's form, and what makes cameras of it, in OpenCV's numbers."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
from dockpose.camera.formats.described import MODELS, Described, is_fisheye, lens_name, model_in
from dockpose.camera.formats.fields import Fields, plain, size_in, whole
from dockpose.text import shown

_MOST_CAMERAS, _MOST_LEVELS = 100, 5
# Coefficients in OpenCV's order, and in that of its fisheye model (Kannala and Brandt 2006), by their usual names.
_TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "taux", "tauy")
_FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
# What scripts call the same things, without capitals and signs; of several cameras with one of the pairs behind.
_MATRICES = ("cameramatrix", "intrinsicmatrix", "mtx", "cammatrix", "cammtx", "cameraintrinsics", "intrinsics")
_SHORT_MATRICES = ("intrinsic", "matrix", "k", "m", "kk", "intrinsicsmatrix", "cameramtx", "a", "cam", "kmatrix")
_BENT = ("distortioncoefficients", "distcoeffs", "distcoeff", "dist", "d", "distortion", "distortioncoeffs")
_BENT += ("distcoefs", "distcoef", "distortions", "coeffs", "kc", "distortioncoeff", "distortionvector", "coefficients")
_BENT += ("distortionparameters", "distortionparams", "distcoefficients", "lensdistortion", "distortioncoefs")
_BENT += ("distortioncoef", "distortionvec", "distvector", "distparams", "distvec", "coeff", "distcoeffsvector")
_PAIRS = ("", "0", "1", "2", "l", "r", "left", "right")
# The four numbers of a matrix, and the coefficients, one by one.
_ONE_BY_ONE = {
    "fx": ("fx", "flx", "focallengthx", "focalx", "fu"),
    "fy": ("fy", "fly", "focallengthy", "focaly", "fv"),
    "f": ("f", "focallength", "focal"),
    "cx": ("cx", "ppx", "principalpointx", "principalptx", "principalx", "u0", "cu", "x0", "centerx"),
    "cy": ("cy", "ppy", "principalpointy", "principalpty", "principaly", "v0", "cv", "y0", "centery"),
    "ar": ("ar", "aspectratio"),
    "skew": ("skew", "alphac"),
    **{f"k{n}": (f"k{n}", f"radialdistortion{n}", f"radial{n}", f"radialk{n}", f"distortionk{n}") for n in range(1, 7)},
    **{f"p{n}": (f"p{n}", f"tangentialdistortion{n}", f"tangential{n}", f"tangentialp{n}", f"distortionp{n}")
       for n in (1, 2)},
}  # fmt: skip
_ROWS = ("intrinsics", "intrinsic", "cameraintrinsics", "intrinsicparameters", "intrinsicparams")
_TWO = {"f": ("fc", "focallength", "focal", "f"), "c": ("cc", "principalpoint", "pp", "center", "opticalcenter", "c")}
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


def cameras_in(
    content: Any, levels: int = _MOST_LEVELS, above: Mapping[Any, Any] | None = None
) -> dict[str, Described]:
    """All cameras that a file describes, by their names; none where no reader knows it."""
    if isinstance(content, list):
        content = dict(enumerate(content[:_MOST_CAMERAS]))
    if not isinstance(content, Mapping) or levels == 0:
        return {}
    if (read := _reader_of(content)) is not None:
        fields = Fields(content, above)
        described = dict(islice(read(fields), _MOST_CAMERAS))
        fields.refuse_rest()
        return described
    found: dict[str, Described] = {}
    holding = {key: each for key, each in islice(content.items(), _MOST_CAMERAS) if _holds(each, levels - 1)}
    shared = {key: each for key, each in content.items() if key not in holding} | dict(above or {})
    for key, each in holding.items():
        inner = cameras_in(each, levels - 1, shared | ({"fisheye": True} if "fisheye" in plain(key) else {}))
        found |= {str(key): camera for camera in inner.values()} if len(inner) == 1 else inner
    return found


def _holds(content: Any, levels: int) -> bool:
    """Whether a reader knows what stands in it."""
    within = list(content.values()) if isinstance(content, Mapping) else content if isinstance(content, list) else []
    if isinstance(content, Mapping) and _reader_of(content) is not None:
        return levels > 0
    return levels > 1 and any(_holds(each, levels - 1) for each in within[:_MOST_CAMERAS])


def is_known(content: Mapping[Any, Any]) -> bool:
    """Whether a reader knows what stands in a file."""
    return _reader_of(content) is not None


def _reader_of(content: Mapping[Any, Any]) -> Callable[[Fields], Iterator[tuple[str, Described]]] | None:
    return next((read for knows, read in READERS if knows(content)), None)


def _numbers(name: str, value: Any) -> np.ndarray:
    """An array of numbers: of a list of lists, of OpenCV's rows, cols and data, or of text."""
    if isinstance(value, Mapping):
        data = value.get("data")
        if isinstance(data, bytes):  # OpenCV's base64, behind a head of 24 bytes
            data = np.frombuffer(data[24:], {"d": "<f8", "f": "<f4"}[str(value.get("dt"))])
        array, (rows, cols) = (
            _numbers(f"{name}.data", data).ravel(),
            (_number(value, each) for each in ("rows", "cols")),
        )
        if rows < 0 or cols < 0 or rows * cols != array.size:
            raise ValueError(f"{name} says {rows:g} x {cols:g}, but its data has {array.size} values")
        return array.reshape(int(rows), int(cols))
    try:
        return np.array(value.split() if isinstance(value, str) else value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is {shown(value)}; it must be numbers") from error


def _number(fields: Fields | Mapping[str, Any], name: str, default: Any = None) -> float:
    value = next((each for alias in _ONE_BY_ONE.get(name, (name,)) if (each := fields.get(alias)) is not None), default)
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


def _named(fields: Fields, model: str = "", note: str = "", shift: float = 0) -> Described:
    """A camera whose numbers stand one by one under their usual names; its pixel centres are ``shift`` off integers."""
    two = {name: fields.first(*names) for name, names in _TWO.items()}
    two = {name: _numbers(name, each).ravel() for name, each in two.items() if np.size(each) == 2}
    fx, fy = two["f"] if "f" in two else (_number(fields, "fx", fields.first(*_ONE_BY_ONE["f"])), None)
    fy = _number(fields, "fy", fx * _number(fields, "ar", 1)) if fy is None else fy
    cx, cy = two["c"] if "c" in two else (_number(fields, "cx"), _number(fields, "cy"))
    skew = _number(fields, "skew", 0) * (fx if "alpha_c" in fields else 1)
    K = _four(fx, fy, cx - shift, cy - shift, skew)
    return Described(K, _bent(fields, "", model), size_in(fields, (cx, cy)), model, note)


def _alone(values: Mapping[str, Any], *args: Any, **kwargs: Any) -> Described:
    """A camera by its numbers' names, of which each must be understood."""
    fields = Fields(values)
    described = _named(fields, *args, **kwargs)
    fields.refuse_rest()
    return described


def _bent(fields: Fields, which: str, model: str) -> list[float]:
    """A lens's coefficients, in a list, in one of radial and one of tangential ones, or one by one."""
    value = fields.first(*(name for each in _BENT for name in (f"{each}{which}", f"{which}{each}")))
    if value is None and which == "" and np.size(fields.first("k")) in (4, 5, 8):
        value = fields.first("k")
    if value is not None:
        return _numbers("distortion_coefficients", value).ravel().tolist()
    radial, tangential = (
        fields.first(
            *(f"{each}{end}" for end in ("distortion", "coefficients", "coeffs", "dist", "distortioncoeffs", ""))
        )
        for each in ("radial", "tangential")
    )
    if radial is not None:
        radial = _numbers("radial distortion", radial).ravel().tolist()
        tangential = _numbers("tangential distortion", [0, 0] if tangential is None else tangential).ravel().tolist()
        radial += [0.0] * (3 - len(radial))
        return [*radial, *tangential] if is_fisheye(model) else [*radial[:2], *tangential, *radial[2:]]
    if all(fields.first(*_ONE_BY_ONE.get(each, (each,))) is None for each in _TERMS):
        return []
    bent = [_number(fields, each, 0) for each in (_FISHEYE_TERMS if is_fisheye(model) else _TERMS)]
    if not model and any(bent[5:6]) and not any((*bent[2:4], *bent[6:])):
        raise ValueError("has k1, k2, k3 and k4 without p1 and p2; if it is a fisheye, write distortion_model: fisheye")
    return bent


def _pair(width: Any, height: Any) -> tuple[float, float]:
    return whole(float(width)), whole(float(height))


def _refuse(kind: str, name: Any, instead: str) -> ValueError:
    return ValueError(f"its {kind} {shown(name)} is not read; {instead}")


def _kalibr(content: Fields) -> Iterator[tuple[str, Described]]:
    """Kalibr's camchain, the sensor.yaml of data sets like EuRoC, and what else has fx, fy, cx, cy in a row."""
    for key in ("camera_model", "distortion_model"):
        if lens_name(content.content.get(key) or "") not in MODELS:
            raise _refuse(key.replace("_", " "), content[key], "calibrate with pinhole-radtan or pinhole-equi")
    key, model = next(key for key in content.content if plain(key) in _ROWS), model_in(content)
    values = _numbers(key, content[key]).ravel().tolist()
    if len(values) != 4:
        raise ValueError(f"{key} has {len(values)} values; pinhole has 4")
    yield "", Described(_four(*values), _bent(content, "", model), size_in(content, (values[2], values[3])), model)


def _mrcal(content: Fields) -> Iterator[tuple[str, Described]]:
    """A .cameramodel of mrcal, whose coefficients stand behind the matrix's four numbers."""
    values = _numbers("intrinsics", content["intrinsics"]).ravel().tolist()
    if len(values) < 4:
        raise ValueError(f"intrinsics has {len(values)} values; it must have 4 and the lens's")
    size = size_in(content, (values[2], values[3]))
    yield "", Described(_four(*values[:4]), values[4:], size, str(content["lensmodel"]))


def _gyroflow(content: Fields) -> Iterator[tuple[str, Described]]:
    """A lens profile of Gyroflow; its names of camera and lens are a person's words."""
    inner = Fields(content["fisheye_params"])
    for key in ("crop", "input_horizontal_stretch", "input_vertical_stretch", "digital_lens", "interpolations"):
        if content.get(key) not in (None, 0, 1, "", [], {}):
            raise ValueError(f"its {key} is {shown(content.get(key))}, which is not read; take a profile without one")
    K = _matrix("camera_matrix", inner.get("camera_matrix"))
    size = content.get("calib_dimension") or {}
    content.mark("camera_model", "lens_model", "orig_dimension", "output_dimension", "compatible_settings")
    content.has_size = "w" in size and "h" in size
    bent, model = _bent(inner, "", "fisheye"), content.get("distortion_model")
    if not any(bent) and not model:  # as Gyroflow takes it
        model = "pinhole"
    size = _pair(size["w"], size["h"]) if content.has_size else None
    described = Described(K, bent, size, str(model or "opencv_fisheye"))
    inner.refuse_rest()
    yield "", described


def _orbslam(content: Fields) -> Iterator[tuple[str, Described]]:
    """Settings of ORB-SLAM 2 and 3; the latter numbers its cameras."""
    shared = content.below("Camera.")
    model = model_in(shared)
    for name in ("Camera", "Camera1", "Camera2"):
        if f"{name}.fx" in content:
            own = shared if name == "Camera" else content.below(f"{name}.")
            described = _named(own, model)
            own.refuse_rest()
            middle = described.matrix[0, 2], described.matrix[1, 2]
            yield name, replace(described, size=size_in(shared, middle) or described.size)


def _camodocal(content: Fields) -> Iterator[tuple[str, Described]]:
    """What camodocal writes, as for VINS."""
    model = content.get("model_type", "PINHOLE")
    names = {"mu": "fx", "mv": "fy", "u0": "cx", "v0": "cy", "k2": "k1", "k3": "k2", "k4": "k3", "k5": "k4"}
    if model not in ("PINHOLE", "PINHOLE_FULL", "KANNALA_BRANDT"):
        raise _refuse("camera model", model, "calibrate with PINHOLE or KANNALA_BRANDT")
    is_brandt = model == "KANNALA_BRANDT"
    parts = [content.get(name) or {} for name in ("projection_parameters", "distortion_parameters")]
    given = {str(key): value for part in parts for key, value in part.items()}
    fields = {names.get(key, key): value for key, value in given.items()} if is_brandt else given
    described = _alone(fields, "fisheye" if is_brandt else "")
    yield "", replace(described, size=size_in(content, (described.matrix[0, 2], described.matrix[1, 2])))


def _calibio(content: Fields) -> Iterator[tuple[str, Described]]:
    """JSON of calib.io's program, whose fy is f times an aspect ratio."""
    for number, camera in enumerate(content["Calibration"]["cameras"]):
        name, about = camera["model"]["polymorphic_name"], camera["model"]["ptr_wrapper"]["data"]
        if name.rpartition("CameraModel")[2] not in ("OpenCV", "KannalaBrandt"):
            raise _refuse("camera model", name, "export it as OpenCV's")
        fields = {key.lower(): each.get("val") for key, each in about["parameters"].items()}
        size = about["CameraModelCRT"]["CameraModelBase"].get("imageSize") or {}
        described = _alone(fields, name.rpartition("CameraModel")[2])
        yield f"cam{number}", replace(described, size=_pair(size["width"], size["height"]) if size else None)


def _matlab(content: Fields) -> Iterator[tuple[str, Described]]:
    """MATLAB's cameraParameters as toStruct gives them, whose pixels count from 1, and whose size is the matrix's."""
    if (matrix := content.first("k", "intrinsicmatrix")) is not None:
        K = _matrix("IntrinsicMatrix", matrix)
    else:
        four = [_numbers(name, content.get(name)).ravel() for name in ("focallength", "principalpoint")]
        K = _four(*np.concatenate(four).tolist(), skew=_number(content, "skew", 0))
    size = content.get("imagesize")
    content.has_size = np.size(size) == 2
    note = "MATLAB counts pixels from 1; its principal point is moved by one pixel"
    K = K - np.array([[0, 0, 1], [0, 0, 1], [0, 0, 0]])
    bent = _bent(content, "", "pinhole")
    yield "", Described(K, bent, _pair(*reversed(size)) if content.has_size else None, "pinhole", note)


def _agisoft(content: Fields) -> Iterator[tuple[str, Described]]:
    """Agisoft's XML: Metashape's principal point counts from the picture's middle, that of Lens from its corner."""
    fields: dict[str, Any] = {key: value for key, value in content.content.items() if value}
    content.mark(*fields)
    model = str(fields.pop("projection"))
    for name in ("k4", "p3", "p4") if model == "frame" else ("p1", "p2"):
        if _number(fields, name, 0):
            raise ValueError(f"its {name} has no place in OpenCV's lens model; optimise without {name}, export again")
    if "f" in fields and "width" in fields:
        f, size = _number(fields, "f"), {name: _number(fields, name) for name in ("width", "height")}
        middle = {"cx": size["width"] / 2, "cy": size["height"] / 2}
        fields |= {name: value + _number(fields, name, 0) for name, value in middle.items()}
        fields |= {"fx": f + _number(fields, "b1", 0), "fy": f, "skew": _number(fields, "b2", 0)}
        fields |= {"p1": fields.get("p2", 0), "p2": fields.get("p1", 0)}
    yield "", _alone(fields, model, shift=0.5)


_HALF = "has the centre of the first pixel at 0.5; its principal point is moved by half a pixel"


def _colmap(content: Fields) -> Iterator[tuple[str, Described]]:
    """A line of COLMAP's cameras.txt."""
    model, (width, height, *values) = content["colmap"], content["numbers"]
    if model not in _COLMAP:
        raise _refuse("camera model", model, "let COLMAP refine one of " + ", ".join(_COLMAP))
    names = _COLMAP[model].split()
    if len(values) != len(names):
        raise ValueError(f"{model} has {len(names)} parameters; the line has {len(values)}")
    lens = "fisheye" if "FISHEYE" in model else ""
    described = _alone(dict(zip(names, values, strict=True)), lens, f"COLMAP {_HALF}", 0.5)
    yield "", replace(described, size=_pair(width, height))


def _nerf(content: Fields) -> Iterator[tuple[str, Described]]:
    """The transforms.json of Nerfstudio and of Instant NGP."""
    yield "", _named(content, model_in(content), f"what reads a transforms.json {_HALF}", 0.5)


def _holds_nine(value: Any) -> bool:
    return np.array(value.get("data") if isinstance(value, Mapping) else value, dtype=object).size == 9


def _matrices(content: Mapping[Any, Any]) -> list[tuple[str, str]]:
    """Keys of matrices, each with what tells the cameras apart."""
    found = []
    for key, value in content.items():
        name = plain(key)
        for alias in (*_MATRICES, *_SHORT_MATRICES):
            rest = name.removeprefix(alias) if name.startswith(alias) else name.removesuffix(alias)
            is_sure = rest == "" and alias in _MATRICES and alias not in _ROWS and value not in (None, [], "")
            is_one = not isinstance(value, Mapping) or "data" in value
            if rest != name and rest in _PAIRS and is_one and (is_sure or _holds_nine(value)):
                found.append((key, rest))
                break
    return found


def _by_matrix(content: Fields) -> Iterator[tuple[str, Described]]:
    """A matrix and coefficients under whatever keys: ROS's, OpenCV's of all years, those of scripts."""
    model, roi = model_in(content), content.get("roi")
    for key, which in _matrices(content.content):
        K = _matrix(key, content[key])
        bent, size = _bent(content, which, model), size_in(content, (K[0, 2], K[1, 2]))
        if isinstance(roi, Mapping) and _number(roi, "width", 0) and _number(roi, "height", 0):
            size = _pair(roi["width"], roi["height"])
            K = K - np.array([[0, 0, _number(roi, "x_offset", 0)], [0, 0, _number(roi, "y_offset", 0)], [0, 0, 0]])
        yield which, Described(K, bent, size, model)


def _by_names(content: Fields) -> Iterator[tuple[str, Described]]:
    """Numbers under their names, as by scripts, Bouguet's toolbox and the tools of RealSense."""
    yield "", _named(content, model_in(content))


def _is_row(content: Mapping[Any, Any]) -> bool:
    rows = [value for key, value in content.items() if plain(key) in _ROWS]
    is_kalibr = "camera_model" in content or "distortion_model" in content
    return any(isinstance(each, list) and (is_kalibr or np.shape(each) == (4,)) for each in rows)


def _is_named(content: Mapping[Any, Any]) -> bool:
    names = {plain(key) for key, value in content.items() if not isinstance(value, Mapping)}
    focal = {*_ONE_BY_ONE["fx"], *_ONE_BY_ONE["f"], *_TWO["f"]}
    return {"fx", "width"} <= names or bool(names & focal and names & {*_ONE_BY_ONE["cx"], *_TWO["c"]})


# What tells a form, and what reads it; the first that knows it counts.
Content = Mapping[Any, Any]
READERS: tuple[tuple[Callable[[Content], Any], Callable[[Fields], Iterator[tuple[str, Described]]]], ...] = (
    (lambda content: "colmap" in content, _colmap),
    (lambda content: "agisoft" in content, _agisoft),
    (lambda content: any(re.fullmatch(r"Camera[12]?\.fx", str(key)) for key in content), _orbslam),
    (lambda content: "projection_parameters" in content, _camodocal),
    (lambda content: "Calibration" in content, _calibio),
    (lambda content: "RadialDistortion" in content, _matlab),
    (lambda content: "fisheye_params" in content and "calib_dimension" in content, _gyroflow),
    (lambda content: "lensmodel" in content and "intrinsics" in content, _mrcal),
    (lambda content: "fl_x" in content, _nerf),
    (_is_row, _kalibr),
    (_matrices, _by_matrix),
    (_is_named, _by_names),
)
