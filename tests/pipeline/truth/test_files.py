"""Trajectories as each system writes them, with numbers known by hand, and a bad file beside each."""

import numpy as np
import pytest
from dockpose.files import FileError
from dockpose.truth import read_trajectory

from tests.support import bags
from tests.support.trajectories import (
    COLUMNS,
    EUROC,
    LEICA,
    MARKERS,
    MOTIVE,
    OBJECTS,
    QUALISYS,
    SEGMENTS,
    TABLE,
    TUM,
    known,
)

HALF = 0.5**0.5
UPRIGHT, QUARTER = [0, 0, 0, 1], [0, 0, HALF, HALF]  # the latter a quarter turn about z


@pytest.fixture
def write(tmp_path):
    def made(text, name="anything.txt"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    return made


GOOD = {
    "TUM": (TUM, "", None, [1305031098.6659, 1305031098.6758], [1.3563, 0.6305, 1.638], [UPRIGHT, QUARTER]),
    "EuRoC": (
        EUROC,
        "",
        None,
        [1403636580.838555, 1403636580.843555],
        [4.688319, -1.786938, 0.783338],
        [UPRIGHT, QUARTER],
    ),
    "EuRoC without attitude": (LEICA, "", None, [1, 1.5], [1, 2, 3], None),
    "Motive": (MOTIVE, "#Sub", None, [0, 0.02], [1, 2, 3], [UPRIGHT, QUARTER]),
    "Motive, the other body": (MOTIVE, "#Dock", None, [0, 0.01], [4, 0, 0], [QUARTER, QUARTER]),
    "Qualisys, the other body": (QUALISYS, "#Gate", None, [0.01, 0.02], [0.005, 0.006, 0.007], [UPRIGHT, UPRIGHT]),
    "Vicon's segments": (SEGMENTS, "#Sub:Sub", None, [0.005, 0.01, 0.015], [1, 2, 3], [UPRIGHT, QUARTER, QUARTER]),
    "Vicon's other segment": (SEGMENTS, "#Dock:Dock", None, [0.005, 0.015], [0.001, 0.001, 0.001], [UPRIGHT, UPRIGHT]),
    "Vicon's objects": (OBJECTS, "", None, [0.1, 0.11], [0.01, 0.02, 0.03], [UPRIGHT, QUARTER]),
    "Vicon's markers": (MARKERS, "", None, [0.01, 0.02], [0.001, 0.002, 0.003], None),
    "a table": (TABLE, "", COLUMNS, [0, 0.5], [1, 2, 3], None),
    "a table by numbers": (
        "0 1 2 3\n1 4 5 6\n",
        "",
        "time=1:ms,x=2:mm,y=3:mm,z=4:mm",
        [0, 0.001],
        [0.001, 0.002, 0.003],
        None,
    ),
}


@pytest.mark.parametrize(("text", "body", "columns", "times_s", "place_m", "turns"), GOOD.values(), ids=GOOD)
def test_forms(write, text, body, columns, times_s, place_m, turns):
    found = read_trajectory(f"{write(text)}{body}", columns=columns)
    np.testing.assert_allclose(found.times_s, times_s, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.positions_m[0], place_m, atol=1e-9)
    if turns is None:
        assert found.quaternions_xyzw is None
        assert "it has no attitude, but places alone" in found.notes
    else:
        np.testing.assert_allclose(known(found.quaternions_xyzw), turns, atol=1e-6)


def test_euler_angles_of_motive_are_about_the_turned_axes(write):
    """By hand: 90 degrees about x, then 90 about the new y (the world's z) takes the body's x to the world's y."""
    text = MOTIVE.replace("Rotation Type,Quaternion", "Rotation Type,XYZ").replace("0,0,0,1,1000", "90,90,0,,1000")
    found = read_trajectory(f"{write(text.replace('0,0,0.7071068,0.7071068,1002', '0,0,90,,1002'))}#Sub")
    np.testing.assert_allclose(known(found.quaternions_xyzw), [[0.5, 0.5, 0.5, 0.5], QUARTER], atol=1e-6)
    assert "angles are taken in degrees, about the turned axes in the order XYZ" in found.notes


def test_the_matrix_of_qualisys_stands_column_by_column(write):
    """Its own small angles say so: a vector along the axis of -0.656, 0.094, 0.058 degrees, half of it in x, y, z."""
    found = read_trajectory(f"{write(QUALISYS)}#PSVH")
    np.testing.assert_allclose(found.positions_m[0], [-0.19491974, 0.0022415, 0.00099661], atol=1e-9)
    half = np.radians([-0.6563, 0.09391, 0.05772]) / 2
    np.testing.assert_allclose(known(found.quaternions_xyzw)[0, :3], half, atol=2e-5)
    np.testing.assert_allclose(known(found.quaternions_xyzw)[1], QUARTER, atol=1e-6)


def test_bodies_are_listed_where_it_is_open_which(write):
    with pytest.raises(FileError, match=r"has several bodies: 'Sub', 'Dock'; name one as FILE#NAME"):
        read_trajectory(write(MOTIVE))
    with pytest.raises(FileError, match=r"has no body 'Boat'; it has 'PSVH', 'Gate'"):
        read_trajectory(f"{write(QUALISYS)}#Boat")


def test_units_that_are_assumed_are_said(write):
    found = read_trajectory(f"{write(MOTIVE.replace('Length Units,Millimeters,', ''))}#Sub")
    assert "lengths are taken in meters, as it does not say" in found.notes
    assert found.positions_m[0, 2] == 3000
    found = read_trajectory(write("a b c d\n0 1 2 3\n1 2 3 4\n"), columns="time=a,x=b,y=c,z=d")
    assert {"times are taken in s, as it does not say", "axes are taken as right-handed"} <= set(found.notes)
    said = "RX, RY, RZ are taken as a vector along the axis of rotation, as long as its angle"
    assert said in read_trajectory(f"{write(SEGMENTS)}#Sub:Sub").notes


def test_what_is_left_out_is_counted(write):
    rows: list[tuple[object, ...]] = [(0.01 * number, number, 0, 0, 0, 0, 0, 1) for number in range(100)]
    rows[3] = (0.03, "nan", 0, 0, 0, 0, 0, 1)
    rows[5] = (0.05, 1e9, 0, 0, 0, 0, 0, 1)
    rows[10], rows[11] = rows[11], rows[10]
    rows[20] = (0.2, 20, 0, 0, 0, 0, 0, 0)
    rows[30] = (0.29, *rows[30][1:])
    found = read_trajectory(write("\n".join(" ".join(map(str, row)) for row in rows[:50] + rows[60:])))
    assert found.notes == (
        "2 of 90 rows without a time or a place, or with one beyond belief, left out",
        "1 of 90 rows whose rotation is none, as a quaternion of zero, left out",
        "1 of 90 rows with a time before that of the row above, put in order",
        "1 of 90 rows with the time of another, left out",
        "1 gaps of more than 5 times the usual interval, the longest of 0.11 s after 0.490 s",
    )
    assert len(found.times_s) == 86
    assert (np.diff(found.times_s) > 0).all()
    assert found.positions_m[np.searchsorted(found.times_s, 0.0999), 0] == 10


def test_a_clean_file_has_nothing_to_say(write):
    assert read_trajectory(write(TUM)).notes == ()


BAD = {
    "nothing": ("", None, "begins with '', as no trajectory that is known"),
    "words": ("Dear all,\nsee attached\n", None, "begins with 'Dear all,'"),
    "a table without its columns": (TABLE, None, "of a table say --columns"),
    "a picture": ("\x89PNG\r\n", None, None),
    "one row": ("1 0 0 0 0 0 0 1\n", None, "has 1 poses that can be used, where two are needed"),
    "a word among numbers": (
        TUM.replace("1.3543", "east"),
        None,
        r"line 3 has \['1305031098.6758', 'east', .*not numbers",
    ),
    "all quaternions zero": ("1 0 0 0 0 0 0 0\n2 0 0 0 0 0 0 0\n", None, "2 of 2 rows whose rotation is none"),
    "no column of that name": (
        TABLE,
        COLUMNS.replace("up", "down"),
        r"there is no column 'down \[cm\]'; there are 'stamp_ms",
    ),
    "no z": (TABLE, "time=stamp_ms,x=2,y=3", "'z' cannot be read; time, x, y, z are needed"),
    "an unknown name": (TABLE, f"{COLUMNS},roll=5", "'roll' cannot be read"),
    "an unknown unit": (
        "a b c d\n0 1 2 3\n",
        "time=a,x=b:inch,y=c:inch,z=d:inch",
        "has lengths in 'inch'; units that are read are m,",
    ),
    "two units": (
        "a b c d\n0 1 2 3\n",
        "time=a,x=b:m,y=c:mm,z=d:m",
        "has x, y, z in 'm', 'mm', 'm'; they must be in one",
    ),
    "Motive in feet": (MOTIVE.replace("Millimeters", "Feet"), None, "has lengths in 'Feet'"),
    "Motive turned otherwise": (MOTIVE.replace("Quaternion", "Gibbs"), None, "has the rotation type 'Gibbs'"),
    "Motive without names": ("\n".join(MOTIVE.splitlines()[:1] + MOTIVE.splitlines()[6:]), None, "export the header"),
    "Motive of markers alone": (MOTIVE.replace("Rigid Body,", "Bone,"), None, "has no body ''; it has none"),
    "Qualisys without names": (QUALISYS.replace("PSVH X", "PSVH"), None, "without a row of its columns' names"),
    "Vicon without a rate": (SEGMENTS.replace("200", "fast"), None, "has 'fast' as its frames a second"),
    "Vicon's devices alone": ("Devices\n1000\n,,Force\n", None, "is Vicon's, without a block of Objects"),
}


@pytest.mark.parametrize(("text", "columns", "words"), BAD.values(), ids=BAD)
def test_bad_files_are_one_sentence(write, text, columns, words):
    path = write(text)
    with pytest.raises(FileError, match=words) as caught:
        read_trajectory(path, columns=columns)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_what_is_no_file(tmp_path):
    with pytest.raises(FileError, match="No such file"):
        read_trajectory(tmp_path / "none.csv")
    with pytest.raises(FileError, match="Is a directory"):
        read_trajectory(tmp_path)


def pose(store, number, body="sub"):
    types = store.types
    point = {"x": float(number), "y": 2.0, "z": 3.0}
    turn = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=HALF, w=HALF)
    head = bags.header(store, bags.START_NS + number * bags.PERIOD_NS)
    head.frame_id = "world"
    placed = types["geometry_msgs/msg/Pose"](position=types["geometry_msgs/msg/Point"](**point), orientation=turn)
    moved = types["geometry_msgs/msg/Transform"](translation=types["geometry_msgs/msg/Vector3"](**point), rotation=turn)
    stamped = types["geometry_msgs/msg/TransformStamped"](header=head, child_frame_id=body, transform=moved)
    covered = types["geometry_msgs/msg/PoseWithCovariance"](pose=placed, covariance=np.zeros(36))
    zero = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    twist = types["geometry_msgs/msg/TwistWithCovariance"](
        twist=types["geometry_msgs/msg/Twist"](linear=zero, angular=zero), covariance=np.zeros(36)
    )
    made = {
        "geometry_msgs/msg/PoseStamped": {"header": head, "pose": placed},
        "geometry_msgs/msg/PoseWithCovarianceStamped": {"header": head, "pose": covered},
        "nav_msgs/msg/Odometry": {"header": head, "child_frame_id": body, "pose": covered, "twist": twist},
        "geometry_msgs/msg/TransformStamped": vars(stamped),
        "tf2_msgs/msg/TFMessage": {"transforms": [stamped]},
    }
    return {kind: types[kind](**fields) for kind, fields in made.items() if kind in types}


def entries(store, kind, bodies=("sub",), topic="/truth"):
    return [
        (topic, kind, bags.START_NS + number, pose(store, number, body)[kind]) for number in range(4) for body in bodies
    ]


WRITERS = {
    "ROS 1": (bags.ROS1, lambda folder, made: bags.write_rosbag1(folder / "run.bag", made)),
    "SQLite": (bags.ROS2, lambda folder, made: bags.write_rosbag2(folder / "run", made)),
    "MCAP": (bags.ROS2, lambda folder, made: bags.write_mcap(folder / "named.csv", made)),
}
KINDS = list(pose(bags.ROS2, 0))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("writer", WRITERS)
def test_bags(tmp_path, writer, kind):
    store, write = WRITERS[writer]
    if kind not in store.types:
        register_tf(store)
    found = read_trajectory(write(tmp_path, entries(store, kind)))
    np.testing.assert_allclose(found.times_s, bags.START_NS / 1e9 + 0.1 * np.arange(4), rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.positions_m, [[number, 2, 3] for number in range(4)])
    np.testing.assert_allclose(known(found.quaternions_xyzw), [QUARTER] * 4, atol=1e-9)
    assert found.notes == ()


def register_tf(store):
    from rosbags.typesys import get_types_from_msg

    definition = "geometry_msgs/TransformStamped[] transforms\n"
    store.register(get_types_from_msg(definition, "tf2_msgs/msg/TFMessage"))


def test_frames_of_a_bag_are_told_by_their_names(tmp_path):
    made = entries(bags.ROS2, "tf2_msgs/msg/TFMessage", ("sub", "base/link"), "/tf")
    path = bags.write_mcap(tmp_path / "run.mcap", made)
    with pytest.raises(FileError, match=r"has several bodies: 'sub', 'base/link'; name one as FILE#NAME"):
        read_trajectory(path)
    assert len(read_trajectory(f"{path}#base/link").times_s) == 4


def test_topics_of_a_bag_are_listed_where_it_is_open_which(tmp_path):
    made = entries(bags.ROS2, KINDS[0], topic="/one") + entries(bags.ROS2, KINDS[2], topic="/two")
    path = bags.write_mcap(tmp_path / "run.mcap", [*made, ("/words", bags.STRING, 1, bags.text("hello"))])
    with pytest.raises(
        FileError, match=r"which topic\? those with poses are /one, /two of /one, /two, /words; say --topic"
    ):
        read_trajectory(path)
    with pytest.raises(FileError, match=r"has no poses on /words; those with poses are /one, /two"):
        read_trajectory(path, topic="/words")
    assert len(read_trajectory(path, topic="two").times_s) == 4


def test_a_bag_that_breaks_off_is_read_as_far_as_it_goes(tmp_path):
    path = bags.write_mcap(tmp_path / "run.mcap", entries(bags.ROS2, KINDS[0], topic="/one") * 200, chunk_size=1000)
    path.write_bytes(path.read_bytes()[:-3000])
    assert len(read_trajectory(path).times_s) == 4


def test_our_own_results_are_no_truth(write):
    with pytest.raises(FileError, match="a file of results by estimate --json"):
        read_trajectory(write('{"schema":1,"source":"a"}\n'))
    with pytest.raises(FileError, match="poses, as estimate --tum writes them"):
        read_trajectory(write("# time_s x_m y_m z_m qx qy qz qw\n0 0 0 1 0 0 0 1\n"))


def test_half_a_million_rows_of_a_table(write):
    """An hour at 100 Hz must come whole, and in one piece of memory that is not many times the file's."""
    times = np.arange(360_000) / 100
    text = "".join(f"{time:.2f} {time:.3f} 2 3 0 0 0 1\n" for time in times)
    found = read_trajectory(write(text))
    np.testing.assert_allclose(found.times_s, times)
    np.testing.assert_allclose(found.positions_m[:, 0], times)
