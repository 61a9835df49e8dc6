from dataclasses import replace

import numpy as np
import pytest
from dockpose import Dock, Settings
from dockpose.app.state.camera import kept, with_my_tank, with_tank
from dockpose.app.state.changes import with_method
from dockpose.app.state.parameters import put
from dockpose.app.state.tank import Tank
from dockpose.app.state.undo import History, changed_names, difference_words
from msgspec.structs import replace as changed

from tests.support.clock import Clock


@pytest.fixture
def history():
    return History(Clock())


def walk(history, view, *steps, pause_s=4.0):
    for step in steps:
        after = step(view)
        history._clock.now_s += pause_s
        history.note(view, after)
        view = after
    return view


def fx(value):
    return lambda view: put(view, "fx", value)


def test_undo_and_redo_go_back_and_forth(history, view):
    last = walk(history, view, fx(710), fx(720), lambda one: put(one, "level", 90))
    back = history.undo(last)
    assert (back.camera.fx, back.settings) == (720, view.settings)
    history.note(last, back)  # as the app does with every change
    assert history.undo(back).camera.fx == 710
    assert history.redo(history.redo(put(view, "fx", 710))) is last
    assert history.redo(last) is last


def test_a_drag_is_one_step(history, view):
    last = walk(history, view, *map(fx, range(701, 741)), pause_s=0.05)
    assert history.undo(last) is view
    assert history.undo(view) is view


def test_a_slow_drag_is_one_step_also_where_its_first_change_makes_what_the_others_change(history, view):
    levels = [lambda one, level=level: put(with_method(one, "fixed", level), "level", level) for level in (90, 91, 95)]
    last = walk(history, view, *levels, pause_s=2.0)
    assert history.undo(last) is view
    own = replace(view, camera_of="guess", tank=Tank())
    moved = [lambda one, fx=fx: kept(one, put(one, "fx", fx)) for fx in (710, 720, 730)]
    assert history.undo(walk(history, own, *moved, pause_s=2.0)) is own


def test_drags_that_follow_upon_each_other_are_steps_of_their_own(history, view):
    first = walk(history, view, *map(fx, range(701, 711)), pause_s=0.05)
    history.end_move()
    last = walk(history, first, *map(fx, range(711, 721)), pause_s=0.05)
    assert history.undo(last) is first
    assert history.undo(first) is view


def test_other_numbers_moved_at_once_are_steps_of_their_own(history, view):
    last = walk(history, view, fx(710), lambda one: put(one, "diameter_cm", 50), pause_s=0.05)
    assert history.undo(last).camera.fx == 710


def test_a_new_change_ends_what_could_be_redone(history, view):
    last = walk(history, view, fx(710))
    back = history.undo(last)
    other = walk(history, back, fx(900))
    assert history.redo(other) is other
    assert history.undo(other) is back


def test_scenes_are_undone_but_other_pictures_are_not(history, view):
    turned = walk(history, view, lambda one: put(one, "z_cm", 90))
    assert history.undo(turned) is view
    other = walk(history, turned, lambda one: replace(one, image=np.zeros((4, 4), np.uint8)))
    assert history.undo(other) is other


def other_picture(view):
    """The next upload, which has no camera of its own."""
    return replace(
        with_my_tank(replace(view, image=view.image.copy())), source="next", settings=Settings(min_area_px=7)
    )


def test_my_tank_is_undone_across_pictures_and_nothing_else_is(history, view):
    mine = with_my_tank(replace(view, tank=Tank(camera=view.camera, dock=view.dock, knows_diameter=True)))
    narrow = changed(mine.tank, camera=put(mine, "fx", 720).camera)
    level = lambda one: put(one, "level", 90)  # noqa: E731
    last = walk(history, mine, lambda one: with_tank(one, narrow), level, other_picture, other_picture)
    assert last.camera.fx == 720
    before = history.undo(last)
    assert (before.tank, before.camera.fx, before.settings) == (mine.tank, 700, last.settings)
    assert before.image is last.image
    history.note(last, before)
    assert history.undo(before) is before
    again = history.redo(before)
    assert (again.tank, again.camera.fx) == (narrow, 720)
    history.note(before, again)
    moved = walk(history, again, other_picture)
    assert history.undo(moved).tank == mine.tank


def test_what_was_undone_is_said(view):
    assert difference_words(fx(720)(view), fx(710)(view)) == "fx (px): 720 → 710"
    assert difference_words(view, view) == ""
    assert difference_words(view, replace(view, by_hand=(0.0, 0.0, -1.0))) == "by hand"
    tanks = [replace(view, tank=Tank(dock=Dock(size), knows_diameter=True)) for size in (0.4, 0.3)]
    assert difference_words(*tanks) == "My tank: Diameter (cm): 40 → 30"


def test_changes_are_named_and_what_changed_nothing_is_no_step(history, view):
    same = walk(history, view, fx(view.camera.fx))
    assert history.undo(same) is same
    assert changed_names(view, fx(710)(view)) == {"camera.fx"}
    assert changed_names(view, put(view, "theta_x_deg", 3)) == {"scene.pose.theta_x_deg"}
