"""What controls other than sliders set of a view, by their names in static/controls.toml: how to read and change it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dockpose.app.state import camera, scene
from dockpose.app.state.changes import (
    angles_text,
    extra_lights_text,
    with_angles,
    with_centroid,
    with_extra_lights,
)
from dockpose.app.state.view import View

CENTROIDS = {"Weighed by brightness": "grey", "Middle of the pixels kept": "binary"}


@dataclass(frozen=True)
class Value:
    """One value of a view: what the control shows of it, the view with another, and what there is to choose from."""

    get: Callable[[View], Any]
    put: Callable[[View, Any], View]
    options: Callable[[View], tuple[str, ...]] | None = None


VALUES = {
    "angles": Value(lambda view: angles_text(view.dock), with_angles),
    "centroid": Value(
        lambda view: next(label for label, kind in CENTROIDS.items() if kind == view.settings.centroid),
        lambda view, label: with_centroid(view, CENTROIDS.get(label)),
        lambda view: tuple(CENTROIDS),
    ),
    "extra": Value(lambda view: extra_lights_text(view.dock), with_extra_lights),
    "missing": Value(lambda view: ", ".join(map(str, scene.scene_of(view).lights.missing)), scene.with_missing),
    "paper": Value(
        scene.paper_scene, scene.with_paper_scene, lambda view: (scene.NOT_OF_THE_PAPER, *scene.paper_scenes())
    ),
    "port": Value(lambda view: view.camera.port is not None, camera.with_port),
    "text": Value(lambda view: "".join(one.text for one in scene.scene_of(view).texts[:1]), scene.with_text),
    "tone": Value(
        lambda view: str(view.camera.tone), camera.with_tone, lambda view: tuple(camera.tone_names(view.camera))
    ),
}
