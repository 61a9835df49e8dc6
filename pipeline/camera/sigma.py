"""Standard errors of a camera's numbers, and how these errors go together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from dockpose.checks import check_number, make_plain

if TYPE_CHECKING:
    from dockpose.camera.camera import Camera

# Where a camera file says nothing: a share of the focal lengths, whose ratio a sensor keeps, and pixels of the
# principal point; a calibration from twenty pictures of a board in a tank is about as good.
FOCAL_SHARE, CENTRE_PX = 0.003, 2.0
_INTRINSICS, _PORT = ("fx", "fy", "cx", "cy"), ("air_gap_m", "glass_m")
_LEAST_EIGENVALUE = -1e-6  # of a correlation matrix, from rounding


class CameraSigma(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    omit_defaults=True,
    rename={name: f"{name}_px" for name in _INTRINSICS},
):
    """Standard errors of a camera's numbers, in pixels and metres; None, or no coefficients, where unknown."""

    fx: float | None = None
    fy: float | None = None
    cx: float | None = None
    cy: float | None = None
    distortion: tuple[float, ...] = ()
    air_gap_m: float | None = None
    glass_m: float | None = None

    def __post_init__(self) -> None:
        make_plain(self)
        for name, value in self.by_name().items():
            check_number(f"sigma {name}", value, least=0)

    def by_name(self) -> dict[str, float]:
        """Those that are known, by name, in the order of a camera's ``covariance``."""
        around = [(name, getattr(self, name)) for name in _INTRINSICS]
        around += [(f"distortion[{index}]", value) for index, value in enumerate(self.distortion)]
        around += [(name, getattr(self, name)) for name in _PORT]
        return {name: value for name, value in around if value is not None}


def check_sigma(
    sigma: CameraSigma, covariance: tuple[tuple[float, ...], ...], coefficients: int, *, has_port: bool
) -> None:
    """Raise ValueError where standard errors or their covariance are not of a camera's own numbers."""
    if len(sigma.distortion) not in (0, coefficients):
        raise ValueError(
            f"sigma.distortion has {len(sigma.distortion)} values; the camera has {coefficients} coefficients"
        )
    if not has_port and (sigma.air_gap_m is not None or sigma.glass_m is not None):
        raise ValueError("sigma has a port's lengths; the camera has no port")
    if not covariance:
        return
    given = len(sigma.by_name())
    shape = {len(row) for row in covariance} | {len(covariance)}
    if shape != {given}:
        raise ValueError(f"covariance has {len(covariance)} rows; it must be {given} x {given}, as sigma has values")
    for index, row in enumerate(covariance):
        for value in row:
            check_number(f"covariance[{index}]", value)
    C = np.array(covariance)
    scale = np.sqrt(np.maximum(np.diag(C), 1e-300))
    if not np.allclose(C, C.T, rtol=1e-6) or np.linalg.eigvalsh(C / np.outer(scale, scale))[0] < _LEAST_EIGENVALUE:
        raise ValueError("covariance must be symmetric and have no negative eigenvalue")


def errors_of(camera: Camera) -> tuple[list[str], np.ndarray]:
    """Names of the numbers (P,) that may be off, and the covariance (P, P) of their errors: given, or else usual."""
    known, covariance = _known(camera)
    usual: dict[str, list[float]] = {}
    if not {"fx", "fy"} & known.keys():
        usual |= {"fx": [FOCAL_SHARE * camera.fx, 0, 0], "fy": [FOCAL_SHARE * camera.fy, 0, 0]}
    if not {"cx", "cy"} & known.keys():
        usual |= {"cx": [0, CENTRE_PX, 0], "cy": [0, 0, CENTRE_PX]}
    factors = np.array(list(usual.values())).reshape(-1, 3)
    apart = np.zeros((len(covariance), len(factors)))  # the usual errors have nothing to do with those that are known
    return [*known, *usual], np.block([[covariance, apart], [apart.T, factors @ factors.T]])


def _known(camera: Camera) -> tuple[dict[str, float], np.ndarray]:
    """Standard errors that are known, by name, and their covariance, as of numbers measured each by itself if none."""
    known = {} if camera.sigma is None else camera.sigma.by_name()
    return known, np.array(camera.covariance) if camera.covariance else np.diag(np.square(list(known.values())))


def numbers_of(camera: Camera, names: Sequence[str]) -> np.ndarray:
    """The camera's numbers (P,) that have these names, as :func:`errors_of` gives them."""
    numbers = {f"distortion[{index}]": value for index, value in enumerate(camera.distortion)}
    numbers |= {name: getattr(camera, name) for name in _INTRINSICS}
    numbers |= {name: getattr(camera.port, name) for name in _PORT if camera.port is not None}
    return np.array([numbers[name] for name in names])


def with_numbers(camera: Camera, names: Sequence[str], numbers: np.ndarray) -> Camera:
    """The camera with other numbers (P,) under these names; a port's lengths stay above 0."""
    given = dict(zip(names, numbers.tolist(), strict=True))
    changed: dict[str, Any] = {name: given[name] for name in _INTRINSICS if name in given}
    if camera.port is not None:
        lengths = {name: max(0.0, given[name]) for name in _PORT if name in given}
        changed["port"] = msgspec.structs.replace(camera.port, **lengths)
    bent = (given.get(f"distortion[{index}]", value) for index, value in enumerate(camera.distortion))
    return msgspec.structs.replace(camera, distortion=tuple(bent), **changed)


def moved(camera: Camera, name: str, by: float) -> Camera:
    """The camera with one of its numbers larger."""
    return with_numbers(camera, [name], numbers_of(camera, [name]) + by)


def with_errors(camera: Camera, names: Sequence[str], covariance: np.ndarray) -> Camera:
    """The camera with the covariance (P, P) of numbers that were fitted; other coefficients are exact."""
    known = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    bent = [f"distortion[{index}]" for index in range(len(camera.distortion))]
    of_lens = tuple(known.get(name, 0.0) for name in bent) if known.keys() & set(bent) else ()
    sigma = CameraSigma(distortion=of_lens, **{name: known.get(name) for name in (*_INTRINSICS, *_PORT)})
    order = list(sigma.by_name())
    ordered = np.zeros((len(order),) * 2)
    places = [order.index(name) for name in names]
    ordered[np.ix_(places, places)] = covariance
    return msgspec.structs.replace(camera, sigma=sigma, covariance=tuple(map(tuple, ordered.tolist())))


def with_port_errors(camera: Camera, names: Sequence[str], covariance: np.ndarray) -> Camera:
    """The camera with the covariance (P, P) of its port's lengths, beside the standard errors that it has."""
    known, errors = _known(camera)
    before = [name for name in known if name not in _PORT]
    apart = np.zeros((len(before), len(covariance)))
    both = np.block([[errors[: len(before), : len(before)], apart], [apart.T, covariance]])
    return with_errors(camera, [*before, *names], both)


def transformed(camera: Any, becomes: dict[str, tuple[str, float]]) -> dict[str, Any]:
    """Sigma and covariance of a camera whose numbers become others, times a factor, as in a picture that is turned."""
    known, errors = _known(camera)
    becoming = [becomes.get(name, (name, 1.0)) for name in known]
    factors = [factor for _, factor in becoming]
    changed = with_errors(camera, [name for name, _ in becoming], errors * np.outer(factors, factors))
    return {"sigma": camera.sigma and changed.sigma, "covariance": changed.covariance if camera.covariance else ()}
