"""How far off a camera's numbers may be, as it says or as is usual, and cameras whose numbers are off."""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.standard_errors import INTRINSICS, PORT, known_errors, of_numbers

# Where a camera file says nothing: a share of the focal lengths, whose ratio a sensor keeps, and pixels of the
# principal point; a calibration from twenty pictures of a board in a tank is about as good.
FOCAL_SHARE, CENTRE_PX = 0.003, 2.0


def errors_of(camera: Camera) -> tuple[list[str], np.ndarray]:
    """Names of the numbers (P,) that may be off, and the covariance (P, P) of their errors: given, or else usual."""
    known, covariance = known_errors(camera.sigma, camera.covariance)
    usual: dict[str, list[float]] = {}
    if not {"fx", "fy"} & known.keys():
        usual |= {"fx": [FOCAL_SHARE * camera.fx, 0, 0], "fy": [FOCAL_SHARE * camera.fy, 0, 0]}
    if not {"cx", "cy"} & known.keys():
        usual |= {"cx": [0, CENTRE_PX, 0], "cy": [0, 0, CENTRE_PX]}
    factors = np.array(list(usual.values())).reshape(-1, 3)
    apart = np.zeros((len(covariance), len(factors)))  # the usual errors have nothing to do with those that are known
    return [*known, *usual], np.block([[covariance, apart], [apart.T, factors @ factors.T]])


def numbers_of(camera: Camera, names: Sequence[str]) -> np.ndarray:
    """The camera's numbers (P,) that have these names, as :func:`errors_of` gives them."""
    numbers = {f"distortion[{index}]": value for index, value in enumerate(camera.distortion)}
    numbers |= {name: getattr(camera, name) for name in INTRINSICS}
    numbers |= {name: getattr(camera.port, name) for name in PORT if camera.port is not None}
    return np.array([numbers[name] for name in names])


def with_numbers(camera: Camera, names: Sequence[str], numbers: np.ndarray) -> Camera:
    """The camera with other numbers (P,) under these names; a port's lengths stay above 0."""
    given = dict(zip(names, numbers.tolist(), strict=True))
    changed: dict[str, Any] = {name: given[name] for name in INTRINSICS if name in given}
    if camera.port is not None:
        lengths = {name: max(0.0, given[name]) for name in PORT if name in given}
        changed["port"] = msgspec.structs.replace(camera.port, **lengths)
    bent = (given.get(f"distortion[{index}]", value) for index, value in enumerate(camera.distortion))
    return msgspec.structs.replace(camera, distortion=tuple(bent), **changed)


def moved(camera: Camera, name: str, by: float) -> Camera:
    """The camera with one of its numbers larger."""
    return with_numbers(camera, [name], numbers_of(camera, [name]) + by)


def with_errors(camera: Camera, names: Sequence[str], covariance: np.ndarray) -> Camera:
    """The camera with the covariance (P, P) of numbers that were fitted; other coefficients are exact."""
    sigma, ordered = of_numbers(names, covariance, len(camera.distortion))
    return msgspec.structs.replace(camera, sigma=sigma, covariance=ordered)


def with_port_errors(camera: Camera, names: Sequence[str], covariance: np.ndarray) -> Camera:
    """The camera with the covariance (P, P) of its port's lengths, beside the standard errors that it has."""
    known, errors = known_errors(camera.sigma, camera.covariance)
    before = [name for name in known if name not in PORT]
    apart = np.zeros((len(before), len(covariance)))
    both = np.block([[errors[: len(before), : len(before)], apart], [apart.T, covariance]])
    return with_errors(camera, [*before, *names], both)
