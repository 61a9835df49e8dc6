import pytest
from dockpose.lights.region import part_of


@pytest.mark.parametrize(
    ("region", "part"),
    [
        (None, (0, 0, 640, 480)),
        ((10, 20, 30, 40), (10, 20, 40, 60)),
        ((-10, -20, 30, 40), (0, 0, 20, 20)),
        ((600, 470, 100, 100), (600, 470, 640, 480)),
        ((9.5, 20.0, 1.0, 0.5), (10, 20, 11, 21)),  # pixel centres within
        ((11, 21, 5, 5), (10, 20, 16, 26)),  # even, so that half pixels are rounded as in the whole picture
    ],
)
def test_a_region_is_clipped_to_the_picture(region, part):
    assert part_of(region, 640, 480) == part
