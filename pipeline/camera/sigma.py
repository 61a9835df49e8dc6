"""Standard errors of a camera's numbers, and how these errors go together."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    given = len(sigma.by_name())
    if not covariance:
        return
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
    # Numbers whose errors are not given go together as if each had been measured by itself.
    known = {} if camera.sigma is None else camera.sigma.by_name()
    covariance = np.array(camera.covariance) if camera.covariance else np.diag(np.square(list(known.values())))
    usual: dict[str, np.ndarray] = {}
    if not {"fx", "fy"} & known.keys():
        usual |= {"fx": np.array([FOCAL_SHARE * camera.fx, 0, 0]), "fy": np.array([FOCAL_SHARE * camera.fy, 0, 0])}
    if not {"cx", "cy"} & known.keys():
        usual |= {"cx": np.array([0, CENTRE_PX, 0]), "cy": np.array([0, 0, CENTRE_PX])}
    factors = np.array(list(usual.values())).reshape(-1, 3)
    count = len(known)
    errors = np.zeros((count + len(usual),) * 2)
    errors[:count, :count] = covariance.reshape(count, count)
    errors[count:, count:] = factors @ factors.T
    return [*known, *usual], errors


def moved(camera: Camera, name: str, by: float) -> Camera:
    """The camera with one of its numbers, as :func:`errors_of` names them, larger; a port's lengths stay above 0."""
    replace = msgspec.structs.replace
    if name in _PORT:
        port = camera.port
        assert port is not None
        return replace(camera, port=replace(port, **{name: max(0.0, getattr(port, name) + by)}))
    if name in _INTRINSICS:
        return replace(camera, **{name: getattr(camera, name) + by})
    bent = list(camera.distortion)
    bent[int(name[len("distortion[") : -1])] += by
    return replace(camera, distortion=tuple(bent))


def with_errors(camera: Camera, names: list[str], covariance: np.ndarray) -> Camera:
    """The camera with the covariance (P, P) of numbers that were fitted, named as by :func:`errors_of`."""
    sigma, order = _sigma_of(names, covariance, len(camera.distortion))
    known = np.zeros((len(order),) * 2)
    places = [order.index(name) for name in names]
    known[np.ix_(places, places)] = covariance
    return msgspec.structs.replace(camera, sigma=sigma, covariance=tuple(map(tuple, known.tolist())))


def with_port_errors(camera: Camera, names: list[str], covariance: np.ndarray) -> Camera:
    """The camera with the covariance (P, P) of its port's lengths, beside the standard errors that it has."""
    if camera.sigma is None:
        return with_errors(camera, names, covariance)
    before = {name: value for name, value in camera.sigma.by_name().items() if name not in _PORT}
    count = len(before)
    both = np.zeros((count + len(names),) * 2)
    both[:count, :count] = np.diag(np.square(list(before.values())))
    if camera.covariance:
        both[:count, :count] = np.array(camera.covariance)[:count, :count]
    both[count:, count:] = covariance
    return with_errors(camera, [*before, *names], both)


def transformed(
    sigma: CameraSigma | None, covariance: tuple[tuple[float, ...], ...], becomes: dict[str, tuple[str, float]]
) -> tuple[CameraSigma | None, tuple[tuple[float, ...], ...]]:
    """Sigma and covariance where each number becomes another, times a factor, as in a picture that is turned."""
    if sigma is None:
        return None, ()
    known = sigma.by_name()
    renamed, factors = zip(*(becomes.get(name, (name, 1.0)) for name in known), strict=True) if known else ((), ())
    errors = np.array(covariance) if covariance else np.diag(np.square(list(known.values())))
    errors = errors.reshape(len(known), len(known)) * np.outer(factors, factors)
    changed, order = _sigma_of(list(renamed), errors, len(sigma.distortion))
    places = [renamed.index(name) for name in order]
    return changed, tuple(map(tuple, errors[np.ix_(places, places)].tolist())) if covariance else ()


def _sigma_of(names: list[str], covariance: np.ndarray, coefficients: int) -> tuple[CameraSigma, list[str]]:
    """Standard errors of numbers with these names, and these names in order; other coefficients are exact."""
    known = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    bent = [f"distortion[{index}]" for index in range(coefficients)]
    of_lens = tuple(known.get(name, 0.0) for name in bent) if known.keys() & set(bent) else ()
    sigma = CameraSigma(distortion=of_lens, **{name: known.get(name) for name in (*_INTRINSICS, *_PORT)})
    return sigma, list(sigma.by_name())
