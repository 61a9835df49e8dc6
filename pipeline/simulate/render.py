"""From a scene to its picture."""

from __future__ import annotations

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
    """A simulated picture and what it is made of.

    Attributes
    ----------
    image : (H, W) or (H, W, 3) BGR array of uint8, or uint16 for more than 8 bits.
    truth : what it really shows.
    direct, glow : (H, W) float32 in grey levels before exposure: the light of all lamps that came straight, and what
        was scattered on its way; of a coloured picture its green band.
    """

    image: np.ndarray
    truth: Truth
    direct: np.ndarray
    glow: np.ndarray


def render(scene: Scene) -> tuple[np.ndarray, Truth]:
    """Render the picture of ``scene`` and its truth; see :func:`render_parts`."""
    rendering = render_parts(scene)
    return rendering.image, rendering.truth


def render_parts(scene: Scene) -> Rendering:
    """Render the picture of ``scene``.

    A dock that faces away or lies outside the picture leaves it without lights, which is a valid picture.

    Raises
    ------
    ValueError
        if a lamp is farther away than the water's point spread function holds.
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
    """Light on the sensor in one band of the spectrum, and the lamps' direct and scattered part in it.

    ``background`` is the share that the band has in the background's levels.
    """
    direct, glow = light_on_sensor(scene, emitters, water)
    light = background_picture(scene, water, background) + direct + glow
    add_snow(light, scene)
    hide(light, scene.occluders)
    return light, direct, glow


def _as_seen(emitters: Emitters, band: int) -> Emitters:
    levels = emitters.levels * emitters.colours[:, band]
    return Emitters(emitters.points_m, levels, emitters.intensity, emitters.radii_m, emitters.colours)
