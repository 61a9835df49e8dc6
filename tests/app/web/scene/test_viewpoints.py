import itertools
import types
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest
from dockpose.app.web.scene import viewpoints as places

from tests.app.web.scene.test_surroundings import on_screen


def docks_at(x, y, z, radius=0.15):
    corners = np.array(list(itertools.product((-1, 1), repeat=3)))
    return np.array([x, y, z]) + radius * corners


def with_camera(docks):
    return np.concatenate([docks, np.zeros((1, 3))])


class Browser:
    """What the server knows of one browser's viewpoint."""

    def __init__(self, aspect):
        self.client_id = 1
        self.camera = types.SimpleNamespace(aspect=aspect, position=np.zeros(3), look_at=np.ones(3), fov=1.0)

    def atomic(self):
        return nullcontext()

    def sees(self, points):
        return in_view(self.camera, self.camera.aspect, points)


def in_view(eye, aspect, points):
    """Whether every point is in the view of an eye whose up is -y."""
    x, y = on_screen(eye, points, aspect, 1.0).T
    return bool(((x > 0) & (x < aspect) & (y > 0) & (y < 1)).all())


@pytest.fixture
def shown() -> tuple[places.Viewpoints, Any]:
    """A browser in which a dock a metre ahead is shown, and the viewpoints that look after it."""
    browser, connected = Browser(0.6), []
    server: Any = types.SimpleNamespace(
        on_client_connect=connected.append,
        on_client_disconnect=lambda forget: None,
        get_clients=lambda: {1: browser},
        initial_camera=types.SimpleNamespace(),
    )
    viewpoints = places.Viewpoints(server)
    docks = docks_at(0, 0, 1)
    viewpoints.show(with_camera(docks), is_other=True)
    for callback in connected:
        callback(browser)
    return viewpoints, browser


def show(viewpoints, docks, *, is_other=False):
    viewpoints.show(with_camera(docks), is_other=is_other)


def test_dock_that_leaves_the_view_is_followed_and_one_that_does_not_leaves_it_alone(shown):
    viewpoints, browser = shown
    before = browser.camera.position
    show(viewpoints, docks_at(0.02, 0.01, 1.02))
    assert browser.camera.position is before
    show(viewpoints, docks_at(1.5, -0.5, 3))
    assert browser.sees(docks_at(1.5, -0.5, 3))
    assert browser.sees(np.zeros((1, 3)))  # the camera, too


def test_dock_that_comes_near_is_shown_larger(shown):
    viewpoints, browser = shown
    far = np.linalg.norm(browser.camera.position - browser.camera.look_at)
    show(viewpoints, docks_at(0, 0, 0.3, 0.05))
    assert np.linalg.norm(browser.camera.position - browser.camera.look_at) < far / 1.6


def test_scene_that_was_turned_by_hand_stays(shown):
    viewpoints, browser = shown
    browser.camera.position = turned = browser.camera.position + (0.3, 0, 0)
    show(viewpoints, docks_at(1.5, -0.5, 3))
    assert browser.camera.position is turned
    viewpoints.fit(browser)  # the button
    assert browser.sees(docks_at(1.5, -0.5, 3))
    show(viewpoints, docks_at(-1.5, 0.5, 3))  # and from then on it is followed again
    assert browser.sees(docks_at(-1.5, 0.5, 3))


def test_another_picture_is_fitted_anew_unless_the_scene_was_turned_by_hand(shown):
    viewpoints, browser = shown
    show(viewpoints, docks_at(0, 0, 1.05), is_other=True)
    np.testing.assert_allclose(
        browser.camera.position, places.viewpoint(with_camera(docks_at(0, 0, 1.05)), 0.6).position
    )
    browser.camera.position = turned = browser.camera.position + (0.1, 0, 0)
    show(viewpoints, docks_at(1.5, -0.5, 3), is_other=True)
    assert browser.camera.position is turned


def test_window_of_another_shape_is_fitted_with_the_next_result(shown):
    viewpoints, browser = shown
    browser.camera.aspect = 0.25
    show(viewpoints, docks_at(0, 0, 1))
    assert browser.sees(with_camera(docks_at(0, 0, 1)))


@pytest.mark.parametrize("aspect", [0.3, 1.0, 2.5])
def test_all_is_in_view_and_no_nearer_place_has_it(aspect):
    points = with_camera(docks_at(0.2, -0.1, 3))
    place = places.viewpoint(points, aspect)
    nearer = place.look_at + 0.6 * (place.position - place.look_at)
    assert in_view(place, aspect, points)
    assert not in_view(places.Viewpoint(nearer, place.look_at), aspect, points)
