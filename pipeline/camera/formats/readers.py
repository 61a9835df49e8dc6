"""One table of readers: what tells each program's form, and what makes cameras of it, in OpenCV's numbers."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
from dockpose.camera.formats import names
from dockpose.camera.formats.described import MODELS, Described, lens_name, model_in
from dockpose.camera.formats.fields import Fields, plain, size_in
from dockpose.text import shown

_MOST_CAMERAS, _MOST_LEVELS = 100, 5
_ALIKE, _OTHER_SIZE = 0.05, 0.3  # ratios of one projection matrix to another, of another size
# COLMAP's parameters of each camera model.
_COLMAP = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    **dict.fromkeys(("SIMPLE_RADIAL", "SIMPLE_RADIAL_FISHEYE"), "f cx cy k1"),
    **dict.fromkeys(("RADIAL", "RADIAL_FISHEYE"), "f cx cy k1 k2"),
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
}


def cameras_in(
    content: Any, levels: int = _MOST_LEVELS, above: Mapping[Any, Any] | None = None
) -> dict[str, Described]:
    """All cameras that a file describes, by their names; none where no reader knows it."""
    if isinstance(content, list):
        content = dict(enumerate(content[:_MOST_CAMERAS]))
    if isinstance(content, Mapping) and any(str(key).endswith(".K") for key in content):  # of OpenCV's stereo cameras
        content = _by_heads(content)
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


def _by_heads(content: Mapping[Any, Any]) -> dict[str, Any]:
    """Keys as LEFT.K and LEFT.D in a mapping for each head that has a matrix; others as they are."""
    heads = {str(key)[:-2]: dict[str, Any]() for key in content if str(key).endswith(".K")}
    rest = {}
    for key, value in content.items():
        head, _, name = str(key).rpartition(".")
        heads.get(head, rest)[name if head in heads else key] = value
    return {**({"Camera": rest} if _holds(rest, _MOST_LEVELS) else rest), **heads}


def _holds(content: Any, levels: int) -> bool:
    """Whether a reader knows what stands in it."""
    within = list(content.values()) if isinstance(content, Mapping) else content if isinstance(content, list) else []
    if isinstance(content, Mapping) and is_known(content):
        return levels > 0
    return levels > 1 and any(_holds(each, levels - 1) for each in within[:_MOST_CAMERAS])


def is_known(content: Mapping[Any, Any]) -> bool:
    """Whether a reader knows what stands in a file."""
    return _reader_of(content) is not None


def _reader_of(content: Mapping[Any, Any]) -> Callable[[Fields], Iterator[tuple[str, Described]]] | None:
    return next((read for knows, read in READERS if knows(content)), None)


def _refuse(kind: str, name: Any, instead: str) -> ValueError:
    return ValueError(f"its {kind} {shown(name)} is not read; {instead}")


def _kalibr(content: Fields) -> Iterator[tuple[str, Described]]:
    """Kalibr's camchain, the sensor.yaml of data sets like EuRoC, and what else has fx, fy, cx, cy in a row."""
    for key in ("camera_model", "distortion_model"):
        if lens_name(content.content.get(key) or "") not in MODELS:
            raise _refuse(key.replace("_", " "), content[key], "calibrate with pinhole-radtan or pinhole-equi")
    key, model = next(key for key in content.content if plain(key) in names.ROWS), model_in(content)
    values = names.numbers_of(key, content[key]).ravel().tolist()
    if len(values) != 4:
        raise ValueError(f"{key} has {len(values)} values; pinhole has 4")
    bent, size = names.lens_of(content, "", model), size_in(content, (values[2], values[3]))
    yield "", Described(names.matrix_by_four(*values), bent, size, model)


def _mrcal(content: Fields) -> Iterator[tuple[str, Described]]:
    """A .cameramodel of mrcal, whose coefficients stand behind the matrix's four numbers."""
    values = names.numbers_of("intrinsics", content["intrinsics"]).ravel().tolist()
    if len(values) < 4:
        raise ValueError(f"intrinsics has {len(values)} values; it must have 4 and the lens's")
    size, content.has_lens = size_in(content, (values[2], values[3])), True
    yield "", Described(names.matrix_by_four(*values[:4]), values[4:], size, str(content["lensmodel"]))


def _gyroflow(content: Fields) -> Iterator[tuple[str, Described]]:
    """A lens profile of Gyroflow; its names of camera and lens are a person's words."""
    inner = Fields(content["fisheye_params"])
    for key in ("crop", "input_horizontal_stretch", "input_vertical_stretch", "digital_lens", "interpolations"):
        if content.get(key) not in (None, 0, 1, "", [], {}):
            raise ValueError(f"its {key} is {shown(content.get(key))}, which is not read; take a profile without one")
    K = names.matrix_of("camera_matrix", inner.get("camera_matrix"))
    size = content.get("calib_dimension") or {}
    if content.get("use_opencv_standard"):
        raise ValueError("its use_opencv_standard is not read; take a profile with use_opencv_fisheye")
    content.mark("camera_model", "lens_model", "output_dimension", "compatible_settings")
    content.mark("use_opencv_fisheye", "calib_params")
    content.has_size = "w" in size and "h" in size
    bent, model = names.lens_of(inner, "", "fisheye"), content.get("distortion_model")
    if not any(bent) and not model:  # as Gyroflow takes it
        model = "pinhole"
    size = names.pair_of(size["w"], size["h"]) if content.has_size else None
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
            described = names.camera_by_names(own, model)
            own.refuse_rest()
            middle = described.matrix[0, 2], described.matrix[1, 2]
            yield name, replace(described, size=size_in(shared, middle) or described.size)


def _camodocal(content: Fields) -> Iterator[tuple[str, Described]]:
    """What camodocal writes, as for VINS."""
    model = content.get("model_type", "PINHOLE")
    terms = {"mu": "fx", "mv": "fy", "u0": "cx", "v0": "cy", "k2": "k1", "k3": "k2", "k4": "k3", "k5": "k4"}
    if model not in ("PINHOLE", "PINHOLE_FULL", "KANNALA_BRANDT"):
        raise _refuse("camera model", model, "calibrate with PINHOLE or KANNALA_BRANDT")
    is_brandt = model == "KANNALA_BRANDT"
    parts = [content.get(name) or {} for name in ("projection_parameters", "distortion_parameters")]
    given = {str(key): value for part in parts for key, value in part.items()}
    fields = {terms.get(key, key): value for key, value in given.items()} if is_brandt else given
    described = names.camera_alone(fields, "fisheye" if is_brandt else "")
    yield "", replace(described, size=size_in(content, (described.matrix[0, 2], described.matrix[1, 2])))


def _calibio(content: Fields) -> Iterator[tuple[str, Described]]:
    """JSON of calib.io's program, whose fy is f times an aspect ratio."""
    for number, camera in enumerate(content["Calibration"]["cameras"]):
        name, about = camera["model"]["polymorphic_name"], camera["model"]["ptr_wrapper"]["data"]
        if name.rpartition("CameraModel")[2] not in ("OpenCV", "KannalaBrandt"):
            raise _refuse("camera model", name, "export it as OpenCV's")
        fields = {key.lower(): each.get("val") for key, each in about["parameters"].items()}
        size = about["CameraModelCRT"]["CameraModelBase"].get("imageSize") or {}
        described = names.camera_alone(fields, name.rpartition("CameraModel")[2])
        yield f"cam{number}", replace(described, size=names.pair_of(size["width"], size["height"]) if size else None)


def _matlab(content: Fields) -> Iterator[tuple[str, Described]]:
    """MATLAB's cameraParameters as toStruct gives them, whose pixels count from 1, and whose size is the matrix's."""
    if (matrix := content.first("k", "intrinsicmatrix")) is not None:
        K = names.matrix_of("IntrinsicMatrix", matrix)
    else:
        four = [names.numbers_of(name, content.get(name)).ravel() for name in ("focallength", "principalpoint")]
        K = names.matrix_by_four(*np.concatenate(four).tolist(), skew=names.number_of(content, "skew", 0))
    size = content.get("imagesize")
    content.has_size = np.size(size) == 2
    note = "MATLAB counts pixels from 1; its principal point is moved by one pixel"
    K = K - np.array([[0, 0, 1], [0, 0, 1], [0, 0, 0]])
    bent = names.lens_of(content, "", "pinhole")
    yield "", Described(K, bent, names.pair_of(*reversed(size)) if content.has_size else None, "pinhole", note)


def _agisoft(content: Fields) -> Iterator[tuple[str, Described]]:
    """Agisoft's XML: Metashape's principal point counts from the picture's middle, that of Lens from its corner."""
    fields: dict[str, Any] = {key: value for key, value in content.content.items() if value}
    content.mark(*fields)
    model = str(fields.pop("projection"))
    for name in ("k4", "p3", "p4") if model == "frame" else ("p1", "p2"):
        if names.number_of(fields, name, 0):
            raise ValueError(f"its {name} has no place in OpenCV's lens model; optimise without {name}, export again")
    if "f" in fields and "width" in fields:
        f, size = names.number_of(fields, "f"), {name: names.number_of(fields, name) for name in ("width", "height")}
        middle = {"cx": size["width"] / 2, "cy": size["height"] / 2}
        fields |= {name: value + names.number_of(fields, name, 0) for name, value in middle.items()}
        fields |= {"fx": f + names.number_of(fields, "b1", 0), "fy": f, "skew": names.number_of(fields, "b2", 0)}
        fields |= {"p1": fields.get("p2", 0), "p2": fields.get("p1", 0)}
    yield "", names.camera_alone(fields, model, shift=0.5)


_HALF = "has the centre of the first pixel at 0.5; its principal point is moved by half a pixel"


def _colmap(content: Fields) -> Iterator[tuple[str, Described]]:
    """A line of COLMAP's cameras.txt."""
    model, (width, height, *values) = content["colmap"], content["numbers"]
    if model not in _COLMAP:
        raise _refuse("camera model", model, "let COLMAP refine one of " + ", ".join(_COLMAP))
    terms = _COLMAP[model].split()
    if len(values) != len(terms):
        raise ValueError(f"{model} has {len(terms)} parameters; the line has {len(values)}")
    lens = "fisheye" if "FISHEYE" in model else ""
    described = names.camera_alone(dict(zip(terms, values, strict=True)), lens, f"COLMAP {_HALF}", 0.5)
    yield "", replace(described, size=names.pair_of(width, height))


def _nerf(content: Fields) -> Iterator[tuple[str, Described]]:
    """The transforms.json of Nerfstudio and of Instant NGP."""
    yield "", names.camera_by_names(content, model_in(content), f"what reads a transforms.json {_HALF}", 0.5)


def _by_matrix(content: Fields) -> Iterator[tuple[str, Described]]:
    """A matrix and coefficients under whatever keys: ROS's, OpenCV's of all years, those of scripts."""
    model, roi = model_in(content), content.get("roi")
    for key, which in names.matrices_in(content.content):
        K = names.matrix_of(key, content[key])
        P = content.first("projectionmatrix", "p")
        if P is not None:
            check_projection(names.numbers_of("projection_matrix", P), K, key)
        bent, size = names.lens_of(content, which, model), size_in(content, (K[0, 2], K[1, 2]))
        if isinstance(roi, Mapping) and names.number_of(roi, "width", 0) and names.number_of(roi, "height", 0):
            size = names.pair_of(roi["width"], roi["height"])
            corner = names.number_of(roi, "x_offset", 0), names.number_of(roi, "y_offset", 0)
            K = K - np.array([[0, 0, corner[0]], [0, 0, corner[1]], [0, 0, 0]])
        yield which, Described(K, bent, size, model)


def check_projection(P: np.ndarray, K: np.ndarray, key: str) -> None:
    """Raise ValueError where a projection matrix (12 numbers) is of pictures of another size than a matrix (3, 3)."""
    if P.size == 12:
        pairs = zip(P.flat[[0, 5, 2, 6]].tolist(), K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(), strict=True)
        ratios = [one / max(other, 1.0) for one, other in pairs]
        if max(ratios) - min(ratios) < _ALIKE * max(ratios) and abs(ratios[0] - 1) > _OTHER_SIZE:
            text = f"its projection matrix is for pictures {ratios[0]:.3g} times as large as its {key} is; "
            raise ValueError(f"{text}which of them is of the size that it says?")


def _by_names(content: Fields) -> Iterator[tuple[str, Described]]:
    """Numbers under their names, as by scripts, Bouguet's toolbox and the tools of RealSense."""
    yield "", names.camera_by_names(content, model_in(content))


# What tells a form, and what reads it; the first that knows it counts.
Content = Mapping[Any, Any]
READERS: tuple[tuple[Callable[[Content], Any], Callable[[Fields], Iterator[tuple[str, Described]]]], ...] = (
    (lambda content: "colmap" in content, _colmap),
    (lambda content: "agisoft" in content, _agisoft),
    (lambda content: any(re.fullmatch(r"Camera[12]?\.fx", str(key)) for key in content), _orbslam),
    (lambda content: "projection_parameters" in content, _camodocal),
    (lambda content: "Calibration" in content, _calibio),
    (lambda content: "RadialDistortion" in content, _matlab),
    (lambda content: "fisheye_params" in content, _gyroflow),
    (lambda content: "lensmodel" in content and "intrinsics" in content, _mrcal),
    (lambda content: "fl_x" in content, _nerf),
    (names.is_row, _kalibr),
    (names.matrices_in, _by_matrix),
    (names.is_named, _by_names),
)
