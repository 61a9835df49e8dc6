"""Rendering: from a scene to its picture."""

from dataclasses import dataclass

import numpy as np
from dockpose.simulate.emitters import Emitters, emitters_of
from dockpose.simulate.optics.glow import light_on_sensor
from dockpose.simulate.optics.water import BANDS, Water
from dockpose.simulate.scene import Scene
from dockpose.simulate.sensor import expose
from dockpose.simulate.surroundings import add_snow, background_picture, hide
from dockpose.simulate.truth import Truth, truth_of


@dataclass(frozen=True)
class Rendering:
    """A simulated picture and its components.

    Attributes
    ----------
    image : (H, W) or (H, W, 3) BGR array, uint8 or uint16
        The picture; uint16 for more than 8 bits.
    truth : Truth
        What it shows.
    direct, glow : (H, W) float32 arrays
        Unscattered and scattered light of all lamps, in grey levels before exposure; of a colour picture the green.
    """

    image: np.ndarray
    truth: Truth
    direct: np.ndarray
    glow: np.ndarray


def render(scene: Scene) -> tuple[np.ndarray, Truth]:
    """Render the picture of a scene.

    Parameters
    ----------
    scene : Scene
        What to render. A dock that faces away or lies outside the picture leaves it without lights, which is valid.

    Returns
    -------
    image : (H, W) or (H, W, 3) BGR array, uint8 or uint16
        The picture; uint16 for more than 8 bits. The same scene gives the same bytes.
    truth : Truth
        What it shows.

    Raises
    ------
    ValueError
        If a lamp is farther away than the water's point spread function is valid.

    Examples
    --------
    >>> from dockpose import Camera, Dock
    >>> from dockpose.simulate import Pose
    >>> camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
    >>> scene = Scene(camera=camera, dock=Dock(0.30, lights=10), pose=Pose(position_m=(0.0, 0.0, 1.5)))
    >>> image, truth = render(scene)
    >>> image.shape, image.dtype
    ((480, 640), dtype('uint8'))
    >>> int(truth.visible.sum())
    10
    """
    rendering = render_parts(scene)
    return rendering.image, rendering.truth


def render_parts(scene: Scene) -> Rendering:
    """Render the picture of a scene, and keep its direct and scattered light; see :func:`render`.

    Parameters
    ----------
    scene : Scene
        What to render.

    Returns
    -------
    Rendering
        The picture, what it shows, and its light in parts.

    Raises
    ------
    ValueError
        If a lamp is farther away than the water's point spread function is valid.
    """
    truth = truth_of(scene)
    emitters = emitters_of(scene, truth)
    if scene.sensor.colour == "grey":
        light, direct, glow = _band(scene, emitters, scene.water)
    else:
        bands = [
            _band(scene, _as_seen(emitters, index), scene.water.in_band(name), scene.background.colour[index])
            for index, name in enumerate(BANDS)
        ]
        light = np.dstack([band[0] for band in bands])
        _, direct, glow = bands[BANDS.index("green")]
    return Rendering(expose(light, scene), truth, direct, glow)


def _band(
    scene: Scene, emitters: Emitters, water: Water, background: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light on the sensor in one spectral band, and the direct and scattered part that the lamps have in it."""
    direct, glow = light_on_sensor(scene, emitters, water)
    light = background_picture(scene, water, background) + direct + glow
    add_snow(light, scene)
    hide(light, scene.occluders)
    return light, direct, glow


def _as_seen(emitters: Emitters, band: int) -> Emitters:
    levels = emitters.levels * emitters.colours[:, band]
    return Emitters(emitters.points_m, levels, emitters.intensity, emitters.radii_m, emitters.colours)
