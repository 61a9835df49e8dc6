"""Where it ends: how tilted a dock may be, and how far off the axis of a fisheye lens, told by simulated pictures."""

import math

from dockpose import Camera, Dock, estimate
from dockpose.simulate import Pose, Scene, render

from tests.support.judged import judged

DOCK = Dock(0.30, lights=10)
PINHOLE = Camera(1000, 1000, 639.5, 479.5, 1280, 960)
FISHEYE = Camera(250, 250, 479.5, 479.5, 960, 960, fisheye=True, distortion=(0.0, 0.0, 0.0, 0.0))
SEEDS = 10


def is_right(camera: Camera, pose: Pose, seed: int) -> bool | None:
    """Whether the right pose was found; None where no dock was."""
    scene = Scene(camera=camera, dock=DOCK, pose=pose, seed=seed)
    image, truth = render(scene)
    came = judged(estimate(image, camera, DOCK), truth.position_m, truth.normal)
    return came.right if came.found else None


def shares(camera: Camera, poses: list[Pose]) -> tuple[int, int]:
    """How many poses are found right, and how many wrong."""
    answers = [is_right(camera, pose, seed) for seed, pose in enumerate(poses)]
    return answers.count(True), answers.count(False)


def test_tilt():
    print(f"\ndock tilted by, at 1 m, of {SEEDS} pictures: right, wrong")
    right = {}
    for tilt in (60, 70, 75, 80, 82, 84, 86):
        poses = [Pose(position_m=(0.0, 0.0, 1.0), theta_y_deg=float(tilt), roll_deg=3.6 * one) for one in range(SEEDS)]
        right[tilt], wrong = shares(PINHOLE, poses)
        print(f"{tilt:8} deg {right[tilt]:8} {wrong:8}")
        assert wrong == 0
    assert right[82] == SEEDS
    assert right[86] == 0


def test_off_the_axis_of_a_fisheye():
    print(f"\nring off the axis by, tilted by 15 degrees against its direction, of {SEEDS} pictures: right, wrong")
    right = {}
    for range_m in (0.6, 2.5):
        for off in (0, 60, 70, 80):
            poses = [seen_off(math.radians(off), range_m, roll_deg=3.6 * one) for one in range(SEEDS)]
            right[range_m, off], wrong = shares(FISHEYE, poses)
            print(f"{range_m:8} m {off:4} deg {right[range_m, off]:8} {wrong:8}")
            assert wrong == 0
    assert right[0.6, 70] == right[2.5, 70] == SEEDS


def seen_off(angle_rad: float, range_m: float, roll_deg: float) -> Pose:
    """A dock so far off the axis that looks at the camera but for a pitch of 15 degrees."""
    position_m = (range_m * math.sin(angle_rad), 0.0, range_m * math.cos(angle_rad))
    return Pose(position_m=position_m, theta_x_deg=15.0, theta_y_deg=math.degrees(angle_rad), roll_deg=roll_deg)
