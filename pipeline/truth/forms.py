"""Forms of text in which measuring systems write trajectories: where each body's numbers stand, and in which units."""

import csv
import re
from collections.abc import Iterable, Iterator
from itertools import zip_longest
from typing import NamedTuple

from dockpose.text import shown

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_METRES = {"m": 1.0, "meters": 1.0, "cm": 0.01, "centimeters": 0.01, "mm": 0.001, "millimeters": 0.001}
_DEGREES = {"deg": 1.0, "rad": 57.29577951308232}
_POSE = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
_BLOCKS = ("Objects", "Segments", "Trajectories")  # of Vicon's, the first that is there
_TUM = "time=1:s,x=2:m,y=3:m,z=4:m,qx=5,qy=6,qz=7,qw=8"
Labels = Iterable[tuple[str, str]]  # of each column the body, and what it is of it; "" for what is not read


class Layout(NamedTuple):
    """Where the numbers of each body stand, and in what they are.

    A rotation from the body's axes to the world's is a quaternion qx to qw, a vector along its axis vx to vz, Euler
    angles ex to ez about the turned axes in an order, or a matrix r0 to r8, column by column.
    """

    bodies: dict[str, dict[str, int]]  # of each body the columns of time (-1: the row's number), x, y, z, and rotation
    first: int  # line of the first row, from 0
    separator: str | None  # None: spaces
    second: float  # what units are, in seconds, metres and degrees
    metre: float
    degree: float = 1.0
    order: str = "XYZ"
    notes: tuple[str, ...] = ()
    last: int | None = None


def layout_of(lines: list[str], columns: str | None) -> Layout:
    """The layout of a file by what stands in it, or by the names of columns. Raises ValueError where it is none."""
    first = next((line for line in lines if line.strip() and (line[0] != "#" or line.startswith("#timestamp"))), "")
    if columns is None and len(cells := first.split()) == len(_POSE) and all(map(_is_number, cells)):
        # TUM's: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
        columns = _TUM
    elif columns is None and first.startswith("#timestamp"):
        # EuRoC's, as `#timestamp [ns], p_RS_R_x [m], ..., q_RS_w [], ...`: doi 10.1177/0278364915620033
        found = [(re.match(r"([pq])_.*_([wxyz])\b", cell), cell) for cell in _cells(first, ",")]
        named = [f"{one[1].strip('p')}{one[2]}={cell}" for one, cell in found if one is not None]
        columns = ",".join(["time=1:ns", *named])
    if columns is not None:
        return _table(lines, columns)
    for begins, form in (("Format Version", _motive), ("NO_OF_FRAMES", _qualisys), ("FILE_VERSION", _qualisys)):
        if first.lstrip('"').startswith(begins):
            return form(lines)
    if first.strip(" ,;\t") in (*_BLOCKS, "Devices", "Joints", "Model Outputs", "Events"):
        return _vicon(lines)
    known = "TUM, EuRoC, Motive's CSV, Qualisys' TSV, Vicon's CSV, a bag"
    raise ValueError(
        f"begins with {shown(first[:40])}, as no trajectory that is known ({known}); of a table say --columns "
        "time=..,x=..,y=..,z=.. with the names of its columns"
    )


def _motive(lines: list[str]) -> Layout:
    """OptiTrack Motive's CSV of rigid bodies (https://docs.optitrack.com/motive/data-export/data-export-csv)."""
    head = _cells(lines[0], ",")
    about = dict(zip(head[::2], head[1::2], strict=False))
    at = next((at for at, line in enumerate(lines[:40]) if line.startswith("Frame,")), 0)
    above = [_cells(line, ",") for line in lines[1:at] if line.strip(", ")]
    if len(above) < 3:
        raise ValueError("is Motive's, without rows of names above one that begins with Frame; export the header")
    order = about.get("Rotation Type", "Quaternion")
    if order != "Quaternion" and sorted(order) != ["X", "Y", "Z"]:
        raise ValueError(f"has the rotation type {shown(order)}; Quaternion and orders of axes as XYZ are read")
    before = {"Position": "", "Rotation": "q" if order == "Quaternion" else "e"}
    labels = [
        (name, f"{before[what]}{axis.lower()}" if kind == "Rigid Body" and what in before else "")
        for kind, name, what, axis in zip_longest(above[0], above[1], above[-1], _cells(lines[at], ","), fillvalue="")
    ]
    metre, notes = _unit(about.get("Length Units", ""), _METRES, "meters", "lengths")
    if order != "Quaternion":
        notes += (f"angles are taken in degrees, about the turned axes in the order {order}",)
    space = about.get("Coordinate Space", "Global")
    notes += (f"its coordinate space is {shown(space)}, which is taken as one that stands still",) * (space != "Global")
    return Layout(_bodies(labels, 1), at + 1, ",", 1.0, metre, 1.0, order, notes)


def _qualisys(lines: list[str]) -> Layout:
    """Qualisys' TSV of bodies (6D) or markers, in mm (https://docs.qualisys.com/qtm, Motion data and 6DOF data)."""
    about = {name: rest.strip() for name, _, rest in (line.partition("\t") for line in lines[:100])}
    names = iter((about.get("BODY_NAMES") or about.get("MARKER_NAMES") or "").split("\t"))
    heads = (at for at, line in enumerate(lines[:100]) if re.match(r"(Frame\t)?(Time\t)?([^\t]* )?X\t", line))
    if (at := next(heads, None)) is None:
        raise ValueError("is Qualisys', without a row of its columns' names; export the header")
    head, name, labels = [cell.rpartition(" ")[2] for cell in lines[at].split("\t")], "", list[tuple[str, str]]()
    known = {"X": "x", "Y": "y", "Z": "z"} | {f"Rot[{number}]": f"r{number}" for number in range(9)}
    for cell in head:
        name = next(names, f"{name} again") if cell == "X" else name
        labels.append((name, known.get(cell, "")))
    if "Time" in head:
        return Layout(_bodies(labels, head.index("Time")), at + 1, "\t", 1.0, 0.001)
    rate_hz, note = _rate(about.get("FREQUENCY", "")), "its rows have no times, which are taken from its frequency"
    return Layout(_bodies(labels, -1), at + 1, "\t", 1 / rate_hz, 0.001, notes=(note,))


def _vicon(lines: list[str]) -> Layout:
    """Vicon's CSV of objects, segments or trajectories (https://help.vicon.com, Export ASCII and Exporting to CSV)."""
    blocks = {line.strip(" ,;\t"): at for at, line in enumerate(lines) if line[:1].isalpha()}
    at = next((blocks[name] for name in _BLOCKS if name in blocks), len(lines))
    if len(lines) < at + 5:
        raise ValueError(f"is Vicon's, without a block of {', '.join(_BLOCKS)}")
    separator = max("\t;,", key=lines[at + 3].count)
    names, axes, units = (_cells(line, separator) for line in lines[at + 2 : at + 5])
    turn, name, labels = "q" if "RW" in axes else "v", "", list[tuple[str, str]]()
    known = {f"{kind}{axis}": axis.lower() for kind in ("", "T") for axis in "XYZ"}
    known |= {f"R{axis}": f"{turn}{axis.lower()}" for axis in "XYZW"}
    for called, axis in zip_longest(names, axes, fillvalue=""):
        name = called.removeprefix("Global Angle ") or name
        labels.append((name, known.get(axis, "")))
    unit = dict(zip(axes, units, strict=False))
    metre, notes = _unit(unit.get("TX", unit.get("X", "")), _METRES, "mm", "lengths")
    degree, more = _unit(unit.get("RX", "") if turn == "v" else "deg", _DEGREES, "deg", "angles")
    if "RX" in axes and turn == "v":
        notes += (*more, "RX, RY, RZ are taken as a vector along the axis of rotation, as long as its angle")
    last = next((row for row in range(at + 5, len(lines)) if not lines[row].strip(" ,;\t")), None)
    second = 1 / _rate(lines[at + 1].strip(" ,;\t"))
    return Layout(_bodies(labels, 0), at + 5, separator, second, metre, degree, notes=notes, last=last)


def _table(lines: list[str], columns: str) -> Layout:
    """A table with columns named as time=T,x=X, or told by their numbers from 1; a unit may follow, as x=X:mm."""
    named = {name: called for name, _, called in (part.strip().partition("=") for part in columns.split(","))}
    if wrong := [name for name in {**named, **dict.fromkeys(_POSE[:4])} if name not in _POSE or not named.get(name)]:
        needed = "time, x, y, z are needed, and of a quaternion qx, qy, qz, qw"
        raise ValueError(f"columns {shown(columns)}: {shown(wrong[0])} cannot be read; {needed}")
    is_numbered = all(called.partition(":")[0].isdecimal() for called in named.values())
    first = next((at for at, line in enumerate(lines) if line.strip() and not (is_numbered and line[0] == "#")), 0)
    line = lines[first].lstrip("# ") if lines else ""
    separator = max("\t;,", key=line.count) if re.search("[\t;,]", line) else None
    head, places, units = _cells(line, separator), dict[str, int](), dict[str, str]()
    has_head = not all(map(_is_number, head))
    head = [str(column) for column, _ in enumerate(head, 1)] if is_numbered else head
    for name, called in named.items():
        plain, _, unit = (called, "", "") if called in head else called.partition(":")
        if plain not in head and not (plain.isdecimal() and 0 < int(plain[:6]) <= len(head)):
            raise ValueError(f"there is no column {shown(plain)}; there are {shown(', '.join(head))}")
        places[name] = head.index(plain) if plain in head else int(plain[:6]) - 1
        after = re.search(r"[\[(_ ]([a-z]+)[\])]?$", plain)
        units[name] = unit or (after[1] if after and after[1] in (_SECONDS if name == "time" else _METRES) else "")
    if units["x"] != units["y"] or units["x"] != units["z"]:
        raise ValueError(f"has x, y, z in {', '.join(shown(units[name]) for name in 'xyz')}; they must be in one unit")
    second, notes = _unit(units["time"], _SECONDS, "s", "times")
    metre, more = _unit(units["x"], _METRES, "m", "lengths")
    notes += (*more, "axes are taken as right-handed") if columns != _TUM else ()
    return Layout({"": places}, first + has_head, separator, second, metre, notes=notes)


def _cells(line: str, separator: str | None) -> list[str]:
    try:
        cells = line.split() if separator is None else next(csv.reader([line], delimiter=separator))
        return [cell.strip() for cell in cells]
    except (csv.Error, StopIteration) as error:
        raise ValueError(f"has the line {shown(line[:40])}, which is no row of a table") from error


def _bodies(labels: Labels, time: int) -> dict[str, dict[str, int]]:
    bodies = dict[str, dict[str, int]]()
    for column, (name, what) in enumerate(labels):
        if what:
            bodies.setdefault(name, {"time": time}).setdefault(what, column)
    return bodies


def _unit(text: str, units: dict[str, float], otherwise: str, what: str) -> tuple[float, tuple[str, ...]]:
    """What a unit is in ours, and a sentence where none is named."""
    if text and text.lower() not in units:
        raise ValueError(f"has {what} in {shown(text)}; units that are read are {', '.join(units)}")
    return units[text.lower() or otherwise], () if text else (f"{what} are taken in {otherwise}, as it does not say",)


def _rate(text: str) -> float:
    if not _is_number(text) or not 1e-3 < float(text) < 1e6:
        raise ValueError(f"has {shown(text)} as its frames a second")
    return float(text)


def _is_number(text: str) -> bool:
    try:
        return bool(float(text) or True)
    except ValueError:
        return False


def rows_of(lines: list[str], layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Each row of numbers with its line, from 1."""
    part = (line for line in lines[layout.first : layout.last])
    rows = map(str.split, part) if layout.separator is None else csv.reader(part, delimiter=layout.separator)
    try:
        for at, row in enumerate(rows, layout.first + 1):
            if any(row) and row[0][:1] != "#":
                yield at, row
    except csv.Error as error:
        raise ValueError(f"has a line that is no row of a table ({error})") from error
