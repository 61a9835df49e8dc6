import dataclasses

import pytest
from dockpose.app.export.words import camera_lines, numbers_in_words
from dockpose.camera.board import Board
from dockpose.camera.calibrate import BoardView, Gathering, calibrate_gathered

from tests.support.boards import SIZE, TRUE, sightings


@pytest.fixture(scope="module")
def done():
    gathering = Gathering(Board(10, 7, 0.024), sightings=sightings(TRUE, 0), size=SIZE)
    gathering.views |= {each.name: BoardView(each.name, None, 54) for each in gathering.sightings}
    return calibrate_gathered(gathering)


@pytest.mark.slow
def test_the_terms_that_were_fixed_and_why_are_told(done):
    text = " ".join(camera_lines(done))
    assert "Lens: k2 (k1, k2)" in text
    assert "p1, p2, k3 fixed at 0: pictures left out are met to" in text


def test_each_number_has_its_sigma(done):
    assert f"fx {done.camera.fx:.2f} ± {done.sigmas.values['fx']:.2f} px" in numbers_in_words(done)
    assert numbers_in_words(done).count("±") == 6


def test_air_and_water_are_told_apart(done):
    assert "Calibrated in air" in " ".join(camera_lines(done, "air"))
    assert "--in water --camera" in " ".join(camera_lines(done, "air"))
    for medium in ("air", "water"):  # a page has no options
        assert "--" not in " ".join(camera_lines(done, medium, is_on_page=True))
    assert "holds at these distances only" in " ".join(camera_lines(done, "water"))


def test_a_focal_length_that_is_hardly_known_is_said_to_be(done):
    loose = dataclasses.replace(done.sigmas, values=done.sigmas.values | {"fx": 26.0})
    assert "only known to 5.0 %" in " ".join(camera_lines(dataclasses.replace(done, sigmas=loose)))
