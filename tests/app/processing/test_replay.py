import msgspec
from dockpose.app.processing.analysis import analyse
from dockpose.app.processing.following import chosen_by_track
from dockpose.app.processing.replay import differences, estimate_again
from dockpose.app.state.view import open_source
from dockpose.simulate import Pose, Scene, render
from dockpose.tracking.tracker import Tracker

from tests.support.scenes import CAMERA, DOCK


def test_what_the_frames_before_chose_is_chosen_again():
    tracker, chosen_by = Tracker(CAMERA, DOCK, use_region=False), set()
    for index in range(6):
        pose = Pose(position_m=(0.05, 0.02, 6.0 - 0.3 * index), theta_x_deg=4.0, theta_y_deg=-5.0)
        image = render(Scene(camera=CAMERA, dock=DOCK, pose=pose, seed=index))[0]
        line = msgspec.json.decode(msgspec.json.encode(chosen_by_track(tracker.see(image, 0.1 * index)).to_dict()))
        assert differences(line, estimate_again(image, line)) == []
        chosen_by.add(line["selected_by"])
    assert "tracking" in chosen_by


def test_rounding_is_no_difference():
    view = open_source(None, None, None)
    found = analyse(view).estimate
    for change, names in ((1e-13, []), (1e-6, ["candidates[0].position_m[2]"])):
        line = msgspec.json.decode(msgspec.json.encode(found.to_dict()))
        line["candidates"][0]["position_m"][2] += change
        assert [name for name, *_ in differences(line, found)] == names
