"""What controls other than sliders set: read back as it was put, and refused where it is none of what there is."""

import pytest
from dockpose.app.resources import read_toml
from dockpose.app.state.values import VALUES

PUT = {
    "angles": "0, 90, 200",
    "centroid": "Middle of the pixels kept",
    "extra": "0, 0, 5; 10, 0, -5",
    "missing": "0, 3",
    "paper": "uneven lighting",
    "port": True,
    "text": "ROV 7",
    "tone": "srgb",
}


@pytest.mark.parametrize("name", VALUES)
def test_every_value_reads_back_what_was_put(view, name):
    value = VALUES[name]
    before, after = value.get(view), value.put(view, PUT[name])
    assert value.get(after) == PUT[name] != before
    assert value.get(value.put(after, before)) == before
    if value.options is not None:
        assert {before, PUT[name]} <= {*value.options(view)}
        assert value.get(after) in value.options(after)
        with pytest.raises(ValueError, match=r"must be|could not"):
            value.put(view, "mud")


def test_every_value_has_a_control(view):
    rows = {name for table in read_toml("controls.toml").values() for name in table}
    assert {*VALUES} <= rows
