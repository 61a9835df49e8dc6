"""From a scene to its picture: direct light, glow, noise, saturation, 8 bit."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from pipeline.simulate.scene import Scene, Truth, truth_of

# The glow falls off more slowly than one Gaussian: widths (as a multiple of the half-energy width of the
# middle one) and shares of three that together have a long tail.
_GLOW_WIDTHS = np.array([0.35, 0.85, 2.5])
_GLOW_SHARES = np.array([0.3, 0.4, 0.3])


def render(scene: Scene) -> tuple[np.ndarray, Truth]:
    """Render the picture of ``scene``.

    Returns
    -------
    The (H, W) uint8 picture and its truth. A dock that faces away or lies outside the picture leaves it without
    lights, which is a valid picture.
    """
    truth = truth_of(scene)
    shape = (scene.camera.height, scene.camera.width)
    picture = np.full(shape, float(scene.background_level))
    lit = np.isfinite(truth.lights_px).all(axis=1) & (truth.lights_m @ truth.normal < 0)
    if lit.any():
        picture += _lights(scene, truth.lights_m[lit], truth.lights_px[lit], truth.normal, shape)
    noise = np.random.default_rng(scene.seed).normal(0, 1, shape)
    picture += scene.noise_levels * noise
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8), truth


def _lights(
    scene: Scene, lights_m: np.ndarray, lights_px: np.ndarray, normal: np.ndarray, shape: tuple[int, int]
) -> np.ndarray:
    focal = math.sqrt(scene.camera.fx * scene.camera.fy)
    distance = np.linalg.norm(lights_m, axis=1)
    facing = -(lights_m @ normal) / distance
    # A lamp is drawn as a Gaussian with the variance of its disc (a quarter of the squared radius).
    lamp_px = focal * scene.light_radius_m / lights_m[:, 2]
    sigma_px = np.hypot(scene.blur_px, lamp_px / 2)
    sigma_1m_px = math.hypot(scene.blur_px, focal * scene.light_radius_m / 2)
    energy = scene.light_level * 2 * math.pi * sigma_1m_px**2 * facing / distance**2
    direct = energy * np.exp(-scene.attenuation_per_m * distance)
    absorbed_only = scene.attenuation_per_m - scene.scattered_per_m
    glow = energy * np.exp(-absorbed_only * distance) - direct
    half_px = focal * math.tan(math.radians(scene.glow_width_deg)) / math.sqrt(2 * math.log(2))
    sigmas = [sigma_px] + [np.hypot(sigma_px, width * half_px) for width in _GLOW_WIDTHS]
    energies = [direct] + [share * glow for share in _GLOW_SHARES]
    centres = np.tile(lights_px, (len(sigmas), 1))
    return gaussian_spots(centres, np.concatenate(sigmas), np.concatenate(energies), shape)


def gaussian_spots(
    centres_px: np.ndarray, sigmas_px: np.ndarray, energies: np.ndarray, shape: tuple[int, int]
) -> np.ndarray:
    """Sum of Gaussian spots, each integrated exactly over every pixel.

    Parameters
    ----------
    centres_px : (N, 2) x, y.
    sigmas_px : (N,) standard deviations.
    energies : (N,) the integral of each spot.
    shape : (height, width) of the picture.
    """
    height, width = shape
    rows = _pixel_shares(centres_px[:, 1], sigmas_px, height)
    columns = _pixel_shares(centres_px[:, 0], sigmas_px, width)
    return (rows * energies[:, None]).T @ columns


def _pixel_shares(centres: np.ndarray, sigmas: np.ndarray, size: int) -> np.ndarray:
    """Share (N, size) of each one-dimensional Gaussian that falls into each pixel."""
    edges = np.arange(size + 1) - 0.5
    return np.diff(ndtr((edges - centres[:, None]) / sigmas[:, None]), axis=1)
