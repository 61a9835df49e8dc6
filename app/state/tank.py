"""My tank: the camera and the dock that belong to the operator, under a name, and the file that keeps several."""

import contextlib
import os
import stat
from pathlib import Path

import msgspec
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.files import read_yaml, to_yaml

UNNAMED = "My tank"
MOST_TANKS, LONGEST_NAME = 50, 40
_ASSUMED_DOCK = Dock(diameter=0.30)


class Tank(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The operator's camera, None until one is known, and dock, whose diameter is assumed until somebody gives it."""

    name: str = ""
    camera: Camera | None = None
    dock: Dock = _ASSUMED_DOCK
    knows_diameter: bool = False  # whether somebody has given the dock's diameter, be it the one that is assumed
    fx_per_fy: float | None = None  # as the camera was given, once a person has changed it

    def with_given(self, camera: Camera | None, dock: Dock | None) -> "Tank":
        """The tank with a camera and a dock that were given at the start, None for its own."""
        knows_diameter = self.knows_diameter or dock is not None
        lens = {} if camera is None else {"camera": camera, "fx_per_fy": None}
        return msgspec.structs.replace(self, **lens, dock=dock or self.dock, knows_diameter=knows_diameter)


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    tanks: tuple[Tank, ...] = ()


def tank_words(tank: Tank) -> str:
    """Return name, focal length, size, diameter and lights in one line."""
    camera, dock = tank.camera, tank.dock
    lens = "no camera yet"
    if camera is not None:
        port = "" if camera.port is None else " behind a flat port"
        lens = f"fx {camera.fx:.1f} px at {camera.width} × {camera.height}{port}"
    ring = f"{100 * dock.diameter:g} cm{'' if tank.knows_diameter else ' assumed'}"
    lights = "" if dock.lights is None else f", {dock.lights} lights"
    return f"{tank.name or UNNAMED}: {lens}, dock {ring}{lights}"


class Tanks:
    """The saved tanks, in a folder of the user's; None keeps them only while the program runs."""

    def __init__(self, folder: Path | None) -> None:
        self._path = None if folder is None else folder / "tanks.yaml"
        self._tanks: dict[str, Tank] = {}
        self.trouble = ""
        if self._path is not None and self._path.exists():
            try:
                kept = msgspec.convert(read_yaml(self._path), _File)
                self._tanks = {tank.name: tank for tank in kept.tanks}
            except (ValueError, RecursionError) as error:
                self.trouble = f"The saved tanks cannot be read ({error}); {self._path} is kept as it is."

    def names(self) -> list[str]:
        """Names of the saved tanks, in the order of the alphabet."""
        return sorted(self._tanks, key=str.casefold)

    def get(self, name: str) -> Tank:
        """Return the tank saved under that name. Raises UserError where there is none."""
        if name not in self._tanks:
            raise UserError(f"There is no tank called {name!r}.")
        return self._tanks[name]

    def is_saved(self, tank: Tank) -> bool:
        """Whether a tank is as it was saved under its name."""
        return self._tanks.get(tank.name) == tank

    def save(self, tank: Tank, name: str) -> Tank:
        """Save a tank under a name, replacing the one of that name; it is on the disk when this returns."""
        name = " ".join("".join(letter for letter in name if letter.isprintable()).split())
        if not name or len(name) > LONGEST_NAME:
            raise UserError(f"A tank needs a name of 1 to {LONGEST_NAME} letters.")
        if name not in self._tanks and len(self._tanks) >= MOST_TANKS:
            raise UserError(f"There are {MOST_TANKS} tanks already; forget one first.")
        named = msgspec.structs.replace(tank, name=name)
        self._keep(self._tanks | {name: named})
        return named

    def forget(self, name: str) -> None:
        """Forget the tank of that name. Raises UserError where there is none, or the file cannot be written."""
        self.get(name)
        self._keep({one: tank for one, tank in self._tanks.items() if one != name})

    def _keep(self, tanks: dict[str, Tank]) -> None:
        if self.trouble:
            raise UserError(self.trouble)
        if self._path is not None:
            text = to_yaml(msgspec.to_builtins(_File(tuple(tanks.values()))))
            try:
                write_whole(self._path, text)
            except OSError as error:
                raise UserError(f"{self._path}: the tanks cannot be saved ({error.strerror or error})") from error
        self._tanks = tanks


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file for its owner alone beside its place, flush it to the disk, and only then put it there, whole."""
    make_private(path.parent)
    beside = path.with_suffix(".new")
    beside.unlink(missing_ok=True)
    with open(beside, "xb", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
        file.write(content.encode() if isinstance(content, str) else content)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)


def make_private(folder: Path, *names: str) -> None:
    """Make a folder, and its files of these names, open to their owner alone; what is there already likewise."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    for path in (folder, *(folder / name for name in names)):
        with contextlib.suppress(OSError):  # not there, another's, or on a disk without owners
            path.chmod(stat.S_IMODE(path.stat().st_mode) & 0o700)
