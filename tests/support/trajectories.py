"""Trajectories as each system writes them, by hand; docks and trajectories that were drawn, as files."""

import msgspec
import numpy as np
from dockpose.pose.circle import angles_of, rotation_from_angles
from dockpose.truth import DockTrack, Trajectory

TUM = """# timestamp tx ty tz qx qy qz qw
1305031098.6659 1.3563 0.6305 1.6380 0 0 0 1
1305031098.6758 1.3543 0.6306 1.6360 0 0 0.7071068 0.7071068
"""
EUROC = """#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],v_RS_R_x
1403636580838555648,4.688319,-1.786938,0.783338,1,0,0,0,-0.027876
1403636580843555328,4.688177,-1.786770,0.787350,0.7071068,0,0,0.7071068,-0.033272
"""
LEICA = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m]\n1000000000,1,2,3\n1500000000,4,5,6\n"
ABOUT = (
    "Format Version,1.23,Take Name,Tank,Take Notes,,Capture Frame Rate,100.000000,Export Frame Rate,100.000000,"
    "Capture Start Time,2026-03-02 02.11.03.123 PM,Total Frames in Take,4,Total Exported Frames,4,"
)
MOTIVE = f"""{ABOUT}Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global

,Type,{"Rigid Body," * 8}{"Rigid Body Marker," * 4}{"Rigid Body," * 8}{"Marker," * 2}Marker
,Name,{"Sub," * 8}{"Sub:Marker1," * 4}{"Dock," * 8}{"Loose," * 2}Loose
,ID,{"1," * 8}{"2," * 4}{"3," * 8}{"4," * 2}4
,,{"Rotation," * 4}{"Position," * 3}Mean Marker Error,{"Position," * 3}Marker Quality,{"Rotation," * 4}{"Position," * 3}
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,,X,Y,Z,W,X,Y,Z,,X,Y,Z
0,0.000000,0,0,0,1,1000,2000,3000,0.1,1,1,1,1,0,0,0.7071068,0.7071068,4000,0,0,0.2,9,9,9
1,0.010000,,,,,,,,,,,,,0,0,0.7071068,0.7071068,4000,0,0,0.2,9,9,9
2,0.020000,0,0,0.7071068,0.7071068,1002,2000,3000,0.1,1,1,1,1,0,0,0,0,0,0,0,0.2,9,9,9
"""
# The first row of a file that Qualisys made of a ship in a basin, with its angles of -0.656, 0.094 and 0.058 degrees.
SHIP = [1, 0.00099, -0.00165, -0.00101, 0.99993, -0.01145, 0.00164, 0.01145, 0.99993]
QUALISYS = "\n".join(
    "\t".join(map(str, row))
    for row in (
        *(("NO_OF_FRAMES", 3), ("NO_OF_CAMERAS", 4), ("NO_OF_BODIES", 2), ("FREQUENCY", 100), ("DESCRIPTION", "--")),
        ("TIME_STAMP", "2020-01-22, 17:47:17", 22107.99),
        *(("DATA_INCLUDED", "6D"), ("BODY_NAMES", "PSVH", "Gate")),
        (
            *("Frame", "Time"),
            *("PSVH X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{number}]" for number in range(9))),
            *("Gate X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{number}]" for number in range(9))),
        ),
        (1, 0.0, -194.91974, 2.2415, 0.99661, -0.6563, 0.09391, 0.05772, 4.98536, *SHIP, *[0.0] * 6, -1, *[0.0] * 9),
        (2, 0.01, 100, 0, 0, 0, 0, 90, 1, 0, 1, 0, -1, 0, 0, 0, 0, 1, 5, 6, 7, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1),
        (3, 0.02, 100, 0, 0, 0, 0, 90, 1, 0, 1, 0, -1, 0, 0, 0, 0, 1, 5, 6, 8, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1),
    )
)
SEGMENTS = """Segments
200
,,Sub:Sub,,,,,,Dock:Dock,,,,,
Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ,RX,RY,RZ,TX,TY,TZ
,,deg,deg,deg,mm,mm,mm,deg,deg,deg,mm,mm,mm
1,0,0,0,0,1000,2000,3000,0,0,0,1,1,1
2,0,0,0,90,1001,2000,3000,,,,,,
3,0,0,0,90,1002,2000,3000,0,0,0,1,1,1

Trajectories
200
,,Sub:Left,,
Frame,Sub Frame,X,Y,Z
,,mm,mm,mm
1,0,1,2,3
"""
OBJECTS = """Objects;;;;;;;;
100;;;;;;;;
;;Global Angle Sub;;;;;;
Frame;Sub Frame;RX;RY;RZ;RW;TX;TY;TZ
;;;;;;mm;mm;mm
10;0;0;0;0;1;10;20;30
11;0;0;0;0.7071068;0.7071068;11;20;30
"""
MARKERS = "Trajectories\n100\n,,Sub:Left,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n2,0,4,5,6\n"
TABLE = "stamp_ms;east [cm];north [cm];up [cm];note\n0;100;200;300;a\n500;100;200;301;b\n"
COLUMNS = "time=stamp_ms,x=east [cm],y=north [cm],z=up [cm]"
# Of each form columns, body and text.
FILES = (
    *(("", "", text) for text in (TUM, EUROC, LEICA, OBJECTS, MARKERS)),
    *(("", "Sub", MOTIVE), ("", "Gate", QUALISYS), ("", "Sub:Sub", SEGMENTS), (COLUMNS, "", TABLE)),
)


def known(numbers: np.ndarray | None) -> np.ndarray:
    """What a track or a trajectory need not have, but has here."""
    assert numbers is not None
    return numbers


def result_lines(results: DockTrack) -> str:
    """Docks as lines of schema 1, as far as a comparison reads them."""
    lines = []
    places = np.stack([results.positions_m, known(results.other_positions_m)], axis=1)
    normals = np.stack([results.normals, known(results.other_normals)], axis=1)
    for row, time_s in enumerate(results.times_s.tolist()):
        turned = rotation_from_angles(*angles_of(results.normals[row]))
        by = np.zeros((6, 5))
        by[:3, :3], by[3:, 3], by[4, 4] = np.eye(3), turned[:, 0], 1.0
        spread = by @ results.covariances[row] @ by.T
        candidates = [
            {"position_m": places[row, one].tolist(), "normal": normals[row, one].tolist(), "probability": 0.9}
            for one in (0, 1)
        ]
        candidates[0]["covariance_m_rad"] = spread.tolist()
        about = {"camera": results.camera, "dock": results.dock, "source": "film.mkv", "frame": row}
        line = {"schema": 1, "time_s": time_s, "candidates": candidates, "selected": 0, "sha256": None, **about}
        lines.append(msgspec.json.encode(line).decode())
    return "\n".join(lines) + "\n"


def tum_lines(truth: Trajectory) -> str:
    """A trajectory in TUM's form."""
    rows = np.column_stack([truth.times_s, truth.positions_m, known(truth.quaternions_xyzw)])
    return "".join(" ".join(f"{number:.9f}" for number in row) + "\n" for row in rows)
