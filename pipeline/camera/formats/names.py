"""What programs call the numbers of a camera, and the numbers by these names."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from dockpose.camera.formats.described import Described, is_fisheye
from dockpose.camera.formats.fields import Fields, plain, size_in, whole
from dockpose.text import shown

# Coefficients in OpenCV's order, and in that of its fisheye model (Kannala and Brandt 2006), by their usual names.
_TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "taux", "tauy")
_FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
# What scripts call the same things, without capitals and signs; of several cameras with one of the pairs behind.
_MATRICES = ("cameramatrix", "intrinsicmatrix", "mtx", "cammatrix", "cammtx", "cameraintrinsics", "intrinsics")
_SHORT_MATRICES = ("intrinsic", "matrix", "k", "m", "kk", "intrinsicsmatrix", "cameramtx", "a", "cam", "kmatrix")
_SHORT_MATRICES += ("camk",)
_ENDS = ("coefficients", "coeffs", "coeff", "coefs", "coef", "parameters", "params", "vector", "vec", "")
_BENT = tuple(f"{head}{end}" for head in ("distortion", "dist") for end in _ENDS)
_BENT += ("d", "distortions", "coeffs", "kc", "coefficients", "lensdistortion", "coeff", "distcoeffsvector")
_PAIRS = ("", "0", "1", "2", "l", "r", "left", "right")
# The four numbers of a matrix, and the coefficients, one by one.
_ONE_BY_ONE = {
    "fx": ("fx", "camfx", "flx", "focallengthx", "focalx", "fu"),
    "fy": ("fy", "camfy", "fly", "focallengthy", "focaly", "fv"),
    "f": ("f", "focallength", "focal"),
    "cx": ("cx", "camcx", "ppx", "principalpointx", "principalptx", "principalx", "u0", "cu", "x0", "centerx"),
    "cy": ("cy", "camcy", "ppy", "principalpointy", "principalpty", "principaly", "v0", "cv", "y0", "centery"),
    "ar": ("ar", "aspectratio"),
    "skew": ("skew", "alphac"),
    **{f"k{n}": (f"k{n}", f"radialdistortion{n}", f"radial{n}", f"radialk{n}", f"distortionk{n}") for n in range(1, 7)},
    **{f"p{n}": (f"p{n}", f"tangentialdistortion{n}", f"tangential{n}", f"tangentialp{n}", f"distortionp{n}")
       for n in (1, 2)},
}  # fmt: skip
_ONE_BY_ONE |= {key: (*_ONE_BY_ONE[key], f"camd{n}") for n, key in enumerate(("k1", "k2", "p1", "p2"))}  # of SVO
ROWS = ("intrinsics", "intrinsic", "cameraintrinsics", "intrinsicparameters", "intrinsicparams")
_TWO = {"f": ("fc", "focallength", "focal", "f"), "c": ("cc", "principalpoint", "pp", "center", "opticalcenter", "c")}


def numbers_of(name: str, value: Any) -> np.ndarray:
    """An array of numbers: of a list of lists, of OpenCV's rows, cols and data, or of text."""
    if isinstance(value, Mapping):
        data = value.get("data")
        if isinstance(data, bytes):  # OpenCV's base64, behind a head of 24 bytes
            data = np.frombuffer(data[24:], {"d": "<f8", "f": "<f4"}[str(value.get("dt"))])
        array = numbers_of(f"{name}.data", data).ravel()
        if not {"rows", "cols"} & value.keys():  # parameters of a ROS 2 node
            return array
        rows, cols = (number_of(value, each) for each in ("rows", "cols"))
        if rows < 0 or cols < 0 or rows * cols != array.size:
            raise ValueError(f"{name} says {rows:g} x {cols:g}, but its data has {array.size} values")
        return array.reshape(int(rows), int(cols))
    try:
        return np.array(value.split() if isinstance(value, str) else value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is {shown(value)}; it must be numbers") from error


def number_of(fields: Fields | Mapping[str, Any], name: str, default: Any = None) -> float:
    """The number of a name, or of one of its aliases; ValueError where it is none."""
    value = next((each for alias in _ONE_BY_ONE.get(name, (name,)) if (each := fields.get(alias)) is not None), default)
    array = np.zeros(0) if value is None or isinstance(value, Mapping) else numbers_of(name, value)
    if array.size != 1:
        raise ValueError(f"{name} is {'missing' if value is None else shown(value)}; it must be a number")
    return float(array.ravel()[0])


def matrix_of(name: str, value: Any) -> np.ndarray:
    """An intrinsic matrix (3, 3); one that lies on its side, as MATLAB's did, is turned."""
    array = numbers_of(name, value)
    if array.shape not in ((3, 3), (9,)):
        raise ValueError(f"{name} is {' x '.join(map(str, array.shape)) or shown(value)}; it must be 3 x 3")
    array = array.reshape(3, 3)
    return array.T.copy() if not array[:2, 2].any() and array[2, :2].any() else array


def matrix_by_four(fx: float, fy: float, cx: float, cy: float, skew: float = 0) -> np.ndarray:
    """The intrinsic matrix (3, 3) of its numbers in pixels."""
    return np.array([[fx, skew, cx], [0, fy, cy], [0, 0, 1]])


def camera_by_names(fields: Fields, model: str = "", note: str = "", shift: float = 0) -> Described:
    """A camera whose numbers stand one by one under their usual names; its pixel centres are ``shift`` off integers."""
    two = {name: fields.first(*names) for name, names in _TWO.items()}
    two = {name: numbers_of(name, each).ravel() for name, each in two.items() if np.size(each) == 2}
    fx, fy = two["f"] if "f" in two else (number_of(fields, "fx", fields.first(*_ONE_BY_ONE["f"])), None)
    fy = number_of(fields, "fy", fx * number_of(fields, "ar", 1)) if fy is None else fy
    cx, cy = two["c"] if "c" in two else (number_of(fields, "cx"), number_of(fields, "cy"))
    skew = number_of(fields, "skew", 0) * (fx if "alpha_c" in fields else 1)
    K = matrix_by_four(fx, fy, cx - shift, cy - shift, skew)
    return Described(K, lens_of(fields, "", model), size_in(fields, (cx, cy)), model, note)


def camera_alone(values: Mapping[str, Any], *args: Any, **kwargs: Any) -> Described:
    """A camera by its numbers' names, of which each must be understood."""
    fields = Fields(values)
    described = camera_by_names(fields, *args, **kwargs)
    fields.refuse_rest()
    return described


def lens_of(fields: Fields, which: str, model: str) -> list[float]:
    """A lens's coefficients, in a list, in one of radial and one of tangential ones, or one by one."""
    value = fields.first(*(name for each in _BENT for name in (f"{each}{which}", f"{which}{each}")))
    if value is None and isinstance(part := fields.content.get("distortion"), Mapping):  # of SVO and maplab
        value = fields.get("parameters") if "parameters" in part else None
    if value is None and which == "" and isinstance(row := fields.first("k"), list) and np.size(row) != 9:
        value = row
    if value is not None:
        fields.has_lens = True
        return numbers_of("distortion_coefficients", value).ravel().tolist()
    ends = ("distortion", "coefficients", "coeffs", "dist", "distortioncoeffs", "")
    radial, tangential = (fields.first(*(f"{each}{end}" for end in ends)) for each in ("radial", "tangential"))
    if radial is not None:
        fields.has_lens = True
        radial = numbers_of("radial distortion", radial).ravel().tolist()
        tangential = numbers_of("tangential distortion", [0, 0] if tangential is None else tangential).ravel().tolist()
        radial += [0.0] * (3 - len(radial))
        return [*radial, *filter(None, tangential)] if is_fisheye(model) else [*radial[:2], *tangential, *radial[2:]]
    terms = _FISHEYE_TERMS if is_fisheye(model) else _TERMS
    given = (fields.first(name) for each in terms for name in _ONE_BY_ONE.get(each, (each,)))
    if all(each is None or isinstance(each, (list, Mapping)) for each in given):
        return []
    fields.has_lens = True
    bent = [number_of(fields, each, 0) for each in terms]
    if not model and any(bent[5:6]) and not any((*bent[2:4], *bent[6:])):
        raise ValueError("has k1, k2, k3 and k4 without p1 and p2; if it is a fisheye, write distortion_model: fisheye")
    return bent


def pair_of(width: Any, height: Any) -> tuple[float, float]:
    """Width and height in pixels, whole where they are."""
    return whole(float(width)), whole(float(height))


def _holds_nine(value: Any) -> bool:
    value = value.get("data") if isinstance(value, Mapping) else value
    return np.array(value.split() if isinstance(value, str) else value, dtype=object).size == 9


def matrices_in(content: Mapping[Any, Any]) -> list[tuple[str, str]]:
    """Keys of matrices, each with what tells the cameras apart."""
    found = []
    for key, value in content.items():
        name = plain(key)
        for alias in (*_MATRICES, *_SHORT_MATRICES):
            rest = name.removeprefix(alias) if name.startswith(alias) else name.removesuffix(alias)
            is_sure = rest == "" and alias in _MATRICES and alias not in ROWS and value not in (None, [], "")
            is_one = not isinstance(value, Mapping) or "data" in value
            if rest != name and (rest in _PAIRS or rest.isdigit()) and is_one and (is_sure or _holds_nine(value)):
                found.append((key, rest))
                break
    return found


def is_row(content: Mapping[Any, Any]) -> bool:
    """Whether fx, fy, cx and cy stand in a row."""
    rows = [value for key, value in content.items() if plain(key) in ROWS]
    rows = [each.get("data") if isinstance(each, Mapping) else each for each in rows]
    is_kalibr = "camera_model" in content or "distortion_model" in content
    return any(isinstance(each, list) and (is_kalibr or np.shape(each) == (4,)) for each in rows)


def is_named(content: Mapping[Any, Any]) -> bool:
    """Whether a focal length and a principal point stand under their names."""
    names = {plain(key) for key, value in content.items() if not isinstance(value, Mapping)}
    names |= {f"{plain(key)}x" for key, value in content.items() if isinstance(value, Mapping) and "x" in value}
    focal = {*_ONE_BY_ONE["fx"], *_ONE_BY_ONE["f"], *_TWO["f"]}
    return {"fx", "width"} <= names or bool(names & focal and names & {*_ONE_BY_ONE["cx"], *_TWO["c"]})
