"""Settings in files: those that people save and load, and those restored at the next start."""

import contextlib
import hashlib
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose import Camera, Dock, Settings, estimate
from dockpose.app.errors import UserError
from dockpose.app.inputs.received import read_sent
from dockpose.app.state.camera import with_own_camera, with_own_dock
from dockpose.app.state.tank import Tank, make_private, write_whole
from dockpose.app.state.view import MeasuredPose, View, open_source, with_sample, with_upload
from dockpose.files import FileError, read_yaml, to_yaml
from dockpose.lights.by_hand import ByHand

_EVERY_S = 2.0
_PICTURE, _MOST_VALUES = "last-picture.png", 30_000_000
_MOST_LIT = 200  # pictures whose lights are remembered


class SettingsFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a settings file holds; what it leaves out stays as it is."""

    settings: Settings | None = None
    camera: Camera | None = None
    dock: Dock | None = None
    source: str = ""  # which picture they were of
    # And what was measured of it and set in it, which is of no other.
    measured: MeasuredPose | None = None
    lights_px: tuple[tuple[float, float], ...] = ()
    snap: bool | tuple[bool, ...] = False


class Remembered(msgspec.Struct, frozen=True):
    """What the next start restores."""

    settings: Settings = Settings()
    dark: bool | None = None  # None as long as the page follows the browser's system
    tank: Tank = Tank()
    sample: str | None = None  # name of the last picture where it was a sample
    upload: str | None = None  # its name where it was sent; the pixels are kept beside
    lights: dict[str, ByHand] = {}  # that were set in pictures, the newest last, by a digest of the pixels


def with_settings_file(view: View, data: bytes, name: str) -> View:
    """Take settings, camera and dock from a file that a browser sent; camera and dock are My tank's from then on."""
    content = read_sent(data, name, _read_settings)
    if content.camera is not None:
        view = with_own_camera(view, content.camera, name)
    if content.dock is not None:
        view = with_own_dock(view, content.dock)
    return view if content.settings is None else replace(view, settings=content.settings)


def with_last_settings(view: View, settings: Settings) -> View:
    """Search with the settings of the last run, unless only the default ones show a dock, which a note then says."""
    last, default = replace(view, settings=settings), replace(view, settings=Settings())
    if settings == default.settings or _shows_dock(last) or not _shows_dock(default):
        return last
    how = f"a fixed level of {settings.level}" if settings.method == "fixed" else f"the method {settings.method}"
    sentence = (
        f"The last settings ({how}, groups of {settings.min_area_px} px or more) show no dock in this picture, so the "
        "default ones are back."
    )
    return replace(default, note=sentence)


def _shows_dock(view: View) -> bool:
    return estimate(view.image, view.camera, view.dock, view.settings).status == "ok"


class Memory:
    """The last settings, kept in a folder of the user's; files that cannot be read or written are ignored."""

    def __init__(self, folder: Path | None) -> None:
        self._path = None if folder is None else folder / "last.yaml"
        self._written_s = -_EVERY_S
        self._pictured: np.ndarray | None = None
        if self._path is not None and folder is not None and folder.is_dir():
            with contextlib.suppress(OSError):
                make_private(folder, self._path.name, _PICTURE)
        self.now = self._kept = self._read()

    def change(self, **changes: Any) -> None:
        """Remember something else, and write it down unless that was done just now."""
        self.now = msgspec.structs.replace(self.now, **changes)
        if time.monotonic() - self._written_s > _EVERY_S:
            self.write()

    def keep_picture(self, view: View) -> None:
        """Remember which picture is shown; of an uploaded one its pixels, unless they are very many."""
        if view.image is self._pictured or self._path is None:
            return
        self._pictured = view.image
        if view.list_name == "samples":
            self.change(sample=view.sample, upload=None)
            with contextlib.suppress(UserError):
                self._delete_picture()
        elif view.list_name == "uploads" and view.image.size <= _MOST_VALUES:
            with contextlib.suppress(OSError):
                write_whole(self._path.with_name(_PICTURE), cv2.imencode(".png", view.image)[1].tobytes())
                self.change(sample=None, upload=view.item)

    def keep_lights(self, view: View) -> None:
        """Remember at once which lights are set in a picture, or that none are any more."""
        key = _digest(view.image)
        lights = {one: kept for one, kept in self.now.lights.items() if one != key}
        if view.set_lights is not None:
            lights[key] = view.set_lights
        if lights != self.now.lights:
            self.change(lights=dict([*lights.items()][-_MOST_LIT:]))
            self.write()

    def with_lights(self, view: View) -> View:
        """Return the view with the lights that were set in its picture, if any were and none came with it."""
        if view.set_lights is not None or not self.now.lights or view.list_name == "sequence":
            return view
        return replace(view, set_lights=self.now.lights.get(_digest(view.image)))

    def forget_picture(self) -> None:
        """Delete the uploaded picture that was kept. Raises UserError where that fails."""
        self.change(upload=None)
        self.write()
        self._delete_picture()

    def _delete_picture(self) -> None:
        if self._path is not None:
            path = self._path.with_name(_PICTURE)
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                raise UserError(f"{path}: the last picture cannot be deleted ({error.strerror or error})") from error

    def last_view(self, tank: Tank) -> View | None:
        """The picture of the last run with My tank; None where there was none that can be had again."""
        with contextlib.suppress(OSError, ValueError):
            start = open_source(None, None, None, tank)
            if self.now.sample is not None:
                return with_sample(start, self.now.sample)
            if self.now.upload is not None and self._path is not None:
                return with_upload(start, self._path.with_name(_PICTURE).read_bytes(), self.now.upload)
        return None

    def write(self) -> None:
        """Write down what changed."""
        if self._path is None or self.now == self._kept:
            return
        self._written_s = time.monotonic()
        with contextlib.suppress(OSError):
            write_whole(self._path, to_yaml(msgspec.to_builtins(self.now)))
            self._kept = self.now

    def _read(self) -> Remembered:
        if self._path is None:
            return Remembered()
        try:
            kept = msgspec.convert(read_yaml(self._path), Remembered)
        except (ValueError, RecursionError):
            return Remembered()
        # Masks belong to the picture that they were drawn in.
        return msgspec.structs.replace(kept, settings=msgspec.structs.replace(kept.settings, masks=()))


def _digest(image: np.ndarray) -> str:
    return hashlib.blake2b(np.ascontiguousarray(image).data, digest_size=12).hexdigest()


def config_folder() -> Path | None:
    """Where this system's users keep the settings of programs; None where that is not known."""
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "win32":
        return Path(os.environ.get("APPDATA") or home / "AppData" / "Roaming") / "dockpose"
    if sys.platform == "darwin":
        return home / "Library" / "Application Support" / "dockpose"
    return Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config") / "dockpose"


def _read_settings(path: Path) -> SettingsFile:
    try:
        return msgspec.convert(read_yaml(path), SettingsFile)
    except msgspec.ValidationError as error:
        raise FileError(f"{path}: {error}") from error
