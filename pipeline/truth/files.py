"""Trajectories from the files of the systems that measure them: read, turned into metres, seconds and quaternions."""

from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from dockpose.camera.files import split_name
from dockpose.files import FileError, read_small
from dockpose.sources.kinds import Kind, kind_of
from dockpose.text import kind_in_words, shown
from dockpose.truth.bags import bodies_in
from dockpose.truth.forms import Layout, layout_of, rows_of
from dockpose.truth.trajectory import GAP, Trajectory

_MOST_BYTES = 2_000_000_000
_MOST_S, _MOST_M = 1e11, 1e5  # of a time and a place that are believed
_OFF = 0.02  # by which a quaternion's length and a matrix's determinant may be off, by how many places are written
_BLANK = frozenset(("", "-", "-nan", "-nan(ind)", "nan(ind)", "-1.#IND", "1.#QNAN", "NA", "N/A", "null"))
_TURNS = {
    **{"quat": ("qx", "qy", "qz", "qw"), "rotvec": ("vx", "vy", "vz"), "euler": ("ex", "ey", "ez")},
    "matrix": tuple(f"r{number}" for number in range(9)),
}


def read_trajectory(source: str | Path, *, columns: str | None = None, topic: str | None = None) -> Trajectory:
    """Read where a tracked body was, by what stands in a file: TUM, EuRoC, Motive, Qualisys, Vicon, a table or a bag.

    Parameters
    ----------
    source : str or Path
        The file; with ``#NAME`` behind it one of several bodies, or frames of a bag, in it.
    columns : str, optional
        Of a table the columns' names, or numbers from 1, as ``time=T,x=X,y=Y,z=Z``, and ``qx`` to ``qw``; units as in
        ``x=X:mm``.
    topic : str, optional
        Of a bag the topic with the poses.

    Returns
    -------
    Trajectory
        The poses in the order of their times, with a sentence on each thing that was left out or assumed.

    Raises
    ------
    FileError
        If the file cannot be read or has no such body; the text names what there is.
    """
    path, wanted = split_name(source)
    try:
        if kind_of(str(path)) is Kind.BAG:
            bodies, notes = bodies_in(path, topic)
            name = _one_of(bodies, wanted)
            return _cleaned(path, name, np.array(bodies[name], float), notes)
        data = read_small(path, _MOST_BYTES)
        if (kind := kind_in_words(data)) is not None:
            raise ValueError(f"is {kind}")
        lines = data.decode("utf-8-sig", errors="replace").splitlines()
        layout = layout_of(lines, columns)
        name = _one_of(layout.bodies, wanted)
        return _cleaned(path, name, _measured(lines, layout, layout.bodies[name]), [*layout.notes])
    except ValueError as error:
        raise FileError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from error


def _one_of(bodies: Mapping[str, Any], wanted: str) -> str:
    """The body that is named, or the only one."""
    listed = ", ".join(shown(name) for name in islice(bodies, 30)) or "none"
    if (wanted and wanted not in bodies) or not bodies:
        raise ValueError(f"has no body {shown(wanted)}; it has {listed}")
    if not wanted and len(bodies) > 1:
        raise ValueError(f"has several bodies: {listed}; name one as FILE#NAME")
    return wanted or next(iter(bodies))


def _measured(lines: list[str], layout: Layout, columns: Mapping[str, int]) -> np.ndarray:
    """Time, place and quaternion of each row (N, 8), without a rotation (N, 4); NaN where a cell is blank."""
    kind, names = next((one for one in _TURNS.items() if set(one[1]) <= columns.keys()), ("", ()))
    if missing := [name for name in ("x", "y", "z") if name not in columns]:
        raise ValueError(f"has no {missing[0]} of that body")
    wanted, numbers, count = [columns[name] for name in ("time", "x", "y", "z", *names)], list[float](), 0
    blank = [""] * (max(wanted) + 1)
    for at, row in rows_of(lines, layout):
        cells = [*row, *blank, str(count)]  # the last is what a column of -1 is
        try:
            numbers += [float("nan") if cells[each].strip() in _BLANK else float(cells[each]) for each in wanted]
        except ValueError:
            raise ValueError(f"line {at} has {shown([cells[each] for each in wanted])}, not numbers alone") from None
        count += 1
    values = np.array(numbers).reshape(count, len(wanted))
    values[~(np.abs(values) < 1e30)] = np.nan
    turns = np.radians(values[:, 4:] * layout.degree) if kind in ("rotvec", "euler") else values[:, 4:]
    return np.column_stack([values[:, 0] * layout.second, values[:, 1:4] * layout.metre, _turned(kind, turns, layout)])


def _turned(kind: str, turns: np.ndarray, layout: Layout) -> np.ndarray:
    """Quaternions (N, 4) of rotations; NaN where there is none, as of zeros where a system lost the body."""
    from scipy.spatial.transform import Rotation  # takes a third of a second to import

    found, size = np.full((len(turns), 4), np.nan), np.where(np.isfinite(turns).all(axis=1), 1.0, 0.0)
    if kind == "matrix":
        turns = turns.clip(-9, 9).reshape(-1, 3, 3).swapaxes(1, 2)
        size *= np.linalg.det(np.nan_to_num(turns))
    elif kind == "quat":
        size *= np.linalg.norm(np.nan_to_num(turns), axis=1)
    elif kind == "euler":
        turns = turns[:, ["XYZ".index(axis) for axis in layout.order]]
    is_one = np.abs(size - 1) < _OFF
    if kind and is_one.any():
        how = (layout.order,) if kind == "euler" else ()
        found[is_one] = getattr(Rotation, f"from_{kind}")(*how, turns[is_one]).as_quat()
    return found if kind else found[:, :0]


def _cleaned(path: Path, name: str, values: np.ndarray, notes: list[str]) -> Trajectory:
    """The trajectory without rows that are none, in order; each kind of those is counted in a sentence."""
    values = values.reshape(len(values), -1)
    sizes = np.abs(values[:, :4]) / [_MOST_S, _MOST_M, _MOST_M, _MOST_M]
    is_told, is_turned = (sizes < 1).all(axis=1), np.isfinite(values[:, 4:]).all(axis=1)
    whole = values[is_told & is_turned]
    order = np.argsort(whole[:, 0], kind="stable")
    is_new = np.diff(whole[order, 0], prepend=-np.inf) > 0
    kept = whole[order][is_new]
    for number, what in (
        (np.sum(~is_told), "without a time or a place, or with one beyond belief, left out"),
        (np.sum(is_told & ~is_turned), "whose rotation is none, as a quaternion of zero, left out"),
        (np.sum(np.diff(whole[:, 0]) < 0), "with a time before that of the row above, put in order"),
        (np.sum(~is_new), "with the time of another, left out"),
    ):
        notes += [f"{number} of {len(values)} rows {what}"] if number else []
    if len(kept) < 2:
        raise ValueError("; ".join([f"has {len(kept)} poses that can be used, where two are needed", *notes]))
    steps_s = np.diff(kept[:, 0])
    if len(gaps := np.flatnonzero(steps_s > GAP * np.median(steps_s))):
        at = gaps[np.argmax(steps_s[gaps])]
        longest = f"the longest of {steps_s[at]:.3g} s after {kept[at, 0]:.3f} s"
        notes.append(f"{len(gaps)} gaps of more than {GAP:g} times the usual interval, {longest}")
    has_turns = values.shape[1] > 4
    notes += [] if has_turns else ["it has no attitude, but places alone"]
    called = f"{path.name}#{name}" if name else path.name
    return Trajectory(called, kept[:, 0], kept[:, 1:4], kept[:, 4:] if has_turns else None, tuple(notes))
