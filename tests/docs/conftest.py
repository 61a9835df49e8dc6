"""A folder with the files that the pages' commands and programs name."""

import shutil

import cv2
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.app.experiment import Session
from dockpose.app.export.video import VideoFile
from dockpose.app.inputs.pictures import save_dock
from dockpose.camera.files import save_camera
from dockpose.camera.image import read
from dockpose.sidecar import sample_path

from tests.docs.pages import DOCS, blocks
from tests.support.bags import CAMERA_INFO, START_NS, camera_info, frames, write_mcap

INFO_TOPIC = "/camera/camera_info"
CAMERA, DOCK = Camera(700, 700, 319.5, 239.5, 640, 480), Dock(0.30, 10)


@pytest.fixture(scope="session")
def tank(tmp_path_factory):
    """What a lab has: picture, camera files, dock file, pictures, video, bag, session, a scene's file."""
    folder = tmp_path_factory.mktemp("lab")
    picture = read(sample_path("plain"))
    shutil.copy(sample_path("plain"), folder / "tank.png")
    shutil.copy(sample_path("plain").with_suffix(".yaml"), folder / "scene.yaml")
    save_camera(CAMERA, folder / "camera.yaml")
    save_camera(CAMERA, folder / "tank.yaml")
    save_dock(DOCK, folder / "dock.yaml")
    (folder / "vehicle.yaml").write_text("T_body_camera: {position_m: [0.2, 0, 0], pitch_deg: -15}\nframe: frd\n")
    course = next(one for one in blocks(DOCS / "experiments.md") if one.language == "yaml")
    (folder / "course.yaml").write_text(course.text)
    (folder / "shots").mkdir()
    with VideoFile(folder / "dive.mp4", 10.0) as video:
        for number in range(3):
            cv2.imwrite(str(folder / "shots" / f"{number}.png"), picture)
            video.write(picture)
    info = camera_info((700, 0, 319.5, 0, 700, 239.5, 0, 0, 1), (640, 480))
    write_mcap(folder / "run.mcap", [(INFO_TOPIC, CAMERA_INFO, START_NS, info), *frames([picture, picture])])
    with Session.create(folder / "dockpose-sessions" / "tank") as session:
        for taped_cm in (110.0, 110.1, 109.9):
            session.take(picture, estimate(picture, CAMERA, DOCK), "tank", measured_z_cm=taped_cm)
    return folder
