"""Standard errors as a camera file has them: those of its numbers, and how these errors go together."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
from dockpose.checks import check_number, make_plain

INTRINSICS, PORT = ("fx", "fy", "cx", "cy"), ("air_gap_m", "glass_m")
_LEAST_EIGENVALUE = -1e-6  # of a correlation matrix, from rounding


class CameraSigma(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    omit_defaults=True,
    rename={name: f"{name}_px" for name in INTRINSICS},
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
        around = [(name, getattr(self, name)) for name in INTRINSICS]
        around += [(f"distortion[{index}]", value) for index, value in enumerate(self.distortion)]
        around += [(name, getattr(self, name)) for name in PORT]
        return {name: value for name, value in around if value is not None}


def check_sigma(
    sigma: CameraSigma, covariance: tuple[tuple[float, ...], ...], coefficients: int, *, has_port: bool
) -> None:
    """Raise ValueError where standard errors or their covariance are not of a camera's own numbers."""
    if len(sigma.distortion) not in (0, coefficients):
        text = f"sigma.distortion has {len(sigma.distortion)} values; the camera has {coefficients} coefficients"
        raise ValueError(text)
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


Covariance = tuple[tuple[float, ...], ...]


def known_errors(sigma: CameraSigma | None, covariance: Covariance) -> tuple[dict[str, float], np.ndarray]:
    """Standard errors that are known, by name, and their covariance, as of numbers measured each by itself if none."""
    known = {} if sigma is None else sigma.by_name()
    return known, np.array(covariance) if covariance else np.diag(np.square(list(known.values())))


def of_numbers(names: Sequence[str], covariance: np.ndarray, coefficients: int) -> tuple[CameraSigma, Covariance]:
    """What a camera says of numbers with a covariance (P, P); the others of so many coefficients are exact."""
    known = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    bent = [f"distortion[{index}]" for index in range(coefficients)]
    of_lens = tuple(known.get(name, 0.0) for name in bent) if known.keys() & set(bent) else ()
    sigma = CameraSigma(distortion=of_lens, **{name: known.get(name) for name in (*INTRINSICS, *PORT)})
    order = list(sigma.by_name())
    ordered = np.zeros((len(order),) * 2)
    places = [order.index(name) for name in names]
    ordered[np.ix_(places, places)] = covariance
    return sigma, tuple(map(tuple, ordered.tolist()))


def transformed(
    sigma: CameraSigma | None, covariance: Covariance, coefficients: int, becomes: Mapping[str, tuple[str, float]]
) -> dict[str, Any]:
    """Sigma and covariance of a camera whose numbers become others, times a factor, as in a picture that is turned."""
    known, errors = known_errors(sigma, covariance)
    becoming = [becomes.get(name, (name, 1.0)) for name in known]
    factors = [factor for _, factor in becoming]
    changed = of_numbers([name for name, _ in becoming], errors * np.outer(factors, factors), coefficients)
    return {"sigma": sigma and changed[0], "covariance": changed[1] if covariance else ()}
