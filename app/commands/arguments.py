"""Arguments that several commands share, and what is made of them; where events go, with nothing secret in them."""

import argparse
import contextlib
import logging
import math
import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from dockpose import Camera, Dock, Settings, Vehicle, load_vehicle
from dockpose.app.commands.console import say
from dockpose.app.errors import UserError, blaming, unwritable, writing
from dockpose.app.experiment.record import files_of_session, is_session
from dockpose.app.inputs.protected import Protected, files_of
from dockpose.app.inputs.sequences import capture_from
from dockpose.app.resources import read_toml
from dockpose.camera.files import NoSizeError, load_camera, split_name
from dockpose.lights.masks import Mask, check_masks
from dockpose.sidecar import load_dock, sample_source
from dockpose.sources import CaptureSettings, Kind, kind_of
from dockpose.text import printable, without_secrets

LARGEST_M = 5.0  # of a bare number, above which it is asked whether centimetres were meant
_METRES = {"": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001}
# Of all commands, the options that write, and those that name one file to read.
WRITTEN = ("json", "csv", "tum", "annotate", "out", "out_camera", "out_vehicle", "report", "record", "log_file")
READ = ("camera", "dock", "vehicle", "scene", "lights_at", "truth", "mount")
_TYPES = {
    **{"int": int, "float": float, "path": Path, "sample": sample_source},
    "sample_path": lambda text: Path(sample_source(text)),
}


def add_command(parser: argparse.ArgumentParser, name: str, known: Mapping[str, Any]) -> None:
    """Add a command's options by ``static/options.toml``; ``known`` has what code knows: by option, and "words"."""
    about = read_toml("options.toml")["commands"][name]
    for table in about["options"]:
        is_exclusive = table in about.get("exclusive", ())
        _add_options(parser.add_mutually_exclusive_group() if is_exclusive else parser, table, known)
    for title, tables in {**about.get("groups", {}), "events": ["events"]}.items():
        group = parser.add_argument_group(title)
        for table in tables:
            _add_options(group, table, known)


def _add_options(to: argparse._ActionsContainer, table: str, known: Mapping[str, Any]) -> None:
    for name, about in read_toml("options.toml")[table].items():
        more = about | known.get(name.lstrip("-"), {})
        if "type" in about:
            more["type"] = _TYPES[about["type"]]
        to.add_argument(name, **more | {"help": " ".join(about["help"].split()).format(**known.get("words", {}))})


def protect(arguments: argparse.Namespace) -> None:
    """Keep a command's outputs from its inputs and from each other, before anything is opened."""
    values = [(name, getattr(arguments, name, None)) for name in WRITTEN]
    outputs = [(f"--{name.replace('_', '-')}", str(value)) for name, value in values if value is not None]
    arguments.protected = Protected(outputs, _read_by(arguments) if outputs else ())


def _read_by(arguments: argparse.Namespace) -> Iterator[Path]:
    """Files that a command reads, as far as its words tell."""
    given = {name: value for name, value in vars(arguments).items() if value is not None}
    yield from (split_name(given[name])[0] for name in READ if name in given)
    for source in [*given.get("sources", ()), *(given[name] for name in ("source", "session") if name in given)]:
        yield from files_of_session(Path(source)) if is_session(Path(source)) else files_of(source)
    for session in given["sessions"].glob("*") if "sessions" in given else ():
        yield from files_of_session(session)


def is_split(arguments: argparse.Namespace) -> bool:
    """Whether pictures, or chunks of frames, go to other processes."""
    return arguments.jobs > 1


def check_least(arguments: argparse.Namespace, **least: int) -> None:
    """Raise UserError where a number is below its least."""
    for name, value in least.items():
        if getattr(arguments, name) < value:
            raise UserError(f"--{name.replace('_', '-')} is {getattr(arguments, name)}; it must be at least {value}")


def camera_of(arguments: argparse.Namespace, tell: Callable[[str], None] = say) -> Camera | None:
    """The camera that was named, or None; where its file says no size, that of the first picture. Raises UserError."""
    path, text = arguments.camera, getattr(arguments, "camera_size", None)
    size = (
        None if text is None else two_numbers(f"--camera-size {text}", text, "width x height in pixels, as 1920x1080")
    )
    if path is None:
        return None
    with blaming("--camera: "):
        try:
            camera = load_camera(path, size=size, tell=tell)
        except NoSizeError:
            if (size := _size_of_first(arguments)) is None:
                raise
            tell(f"{path}: does not say for which pictures it is; it is taken for these, {size[0]} x {size[1]}")
            camera = load_camera(path, size=size, tell=tell)
    if size is not None and (camera.width, camera.height) != size:
        raise UserError(f"--camera-size {text}: {path} is for {camera.width} x {camera.height} pixels; leave it out")
    return camera


def _size_of_first(arguments: argparse.Namespace) -> tuple[int, int] | None:
    """Width and height of the first picture or frame of the first source; None where none can be had at once."""
    given = vars(arguments)
    source = given.get("source") or next(iter(given.get("sources") or ()), None)
    if source is not None and kind_of(source) not in (Kind.CAMERA, Kind.STREAM):
        from dockpose.sources import open_frames

        with contextlib.suppress(ValueError), open_frames(source, topic=given.get("topic")) as frames:
            for frame in frames:
                return frame.image.shape[1], frame.image.shape[0]
    return None


def two_numbers(argument: str, text: str, wanted: str) -> tuple[int, int]:
    """Read two whole numbers, as 10x7."""
    match = re.fullmatch(r"(\d{1,9})\s*[xX×*]\s*(\d{1,9})", text.strip())
    if match is None:
        raise UserError(f"{argument}: must be {wanted}")
    return int(match[1]), int(match[2])


def vehicle_of(arguments: argparse.Namespace) -> Vehicle | None:
    """The vehicle that was named, for the pictures as they are turned. Raises UserError where its file is wrong."""
    if arguments.vehicle is None:
        return None
    with blaming("--vehicle: "):
        return load_vehicle(arguments.vehicle).rotated(getattr(arguments, "rotate", 0))


def dock_of(arguments: argparse.Namespace) -> Dock | None:
    """The dock that was described; None where none was. Raises UserError for an impossible one."""
    if getattr(arguments, "dock", None) is not None:  # which no budget takes, whose lights are evenly spaced
        if arguments.dock_diameter is not None or arguments.lights is not None:
            raise UserError(f"--dock {arguments.dock} says it all; it does not go with --dock-diameter or --lights")
        with blaming("--dock: "):
            return load_dock(arguments.dock)
    if arguments.dock_diameter is None:
        if arguments.lights is not None:
            raise UserError(f"--lights {arguments.lights} needs --dock-diameter beside it")
        return None
    diameter_m = metres(arguments.dock_diameter)
    with blaming("--dock-diameter, --lights: "):
        return Dock(diameter_m, arguments.lights)


def turned(arguments: argparse.Namespace) -> dict[str, int]:
    """What a line of JSON says of ``--rotate``; nothing where it was not given."""
    return {"rotate_deg": arguments.rotate} if arguments.rotate else {}


def capture_of(arguments: argparse.Namespace, sources: Sequence[str]) -> CaptureSettings:
    """What a camera is asked for. Raises UserError for what no camera can give, and where no source is a camera."""
    names = {"exposure": "--exposure", "gain": "--gain", "rate_hz": "--fps", "format": "--format"}
    given = {name: getattr(arguments, option.lstrip("-")) for name, option in names.items()}
    capture = capture_from(given, names)
    named = [names[one] for one, value in given.items() if value is not None]
    if named and not any(kind_of(source) is Kind.CAMERA for source in sources):
        what = f"{sources[0]} is not a camera" if sources else "no source is given"
        raise UserError(f"{named[0]} is for a camera, as 0 or /dev/video0; {what}")
    return capture


def check_recording(path: Path, sources: Sequence[str]) -> None:
    """Raise UserError where ``--record`` has nothing to record, or no name for it."""
    from dockpose.app.export.recording import check_name

    if len(sources) != 1 or kind_of(sources[0]) not in (Kind.CAMERA, Kind.STREAM):
        what = "give one camera or stream alone" if len(sources) != 1 else f"{sources[0]} is neither camera nor stream"
        raise UserError(f"--record {path} keeps what a camera or stream gives; {what}")
    with blaming("--record "):
        check_name(path)


def metres(text: str) -> float:
    """Read a dock's diameter: "0.3", "30cm", "300 mm"."""
    match = re.fullmatch(r"\s*([-+.\w]*?)\s*(mm|cm|m|)\s*", text)
    try:
        number = float(match[1]) if match else float(text)
    except ValueError as error:
        raise UserError(f"--dock-diameter {text}: must be a length in metres, as 0.30, or with its unit") from error
    unit = match[2] if match else ""
    if not unit and LARGEST_M < number < math.inf:
        raise UserError(
            f"--dock-diameter {text}: is that in centimetres? A bare number is in metres; "
            f"write {number / 100:g}, or {number:g}m if the dock is that large"
        )
    return number * _METRES[unit]


def masks_of(arguments: argparse.Namespace) -> tuple[Mask, ...]:
    """The masks that were given. Raises UserError for one that is not four numbers."""
    masks = []
    for text in arguments.mask:
        try:
            x, y, width, height = (float(number) for number in text.split(","))
            check_masks([(x, y, width, height)])
        except ValueError as error:
            wanted = "left, top, width and height in pixels, as 440,10,190,30, the sizes above 0"
            raise UserError(f"--mask {text} must be {wanted}") from error
        masks.append((x, y, width, height))
    return tuple(masks)


def settings_of(arguments: argparse.Namespace) -> Settings:
    """The settings by ``--method``, ``--level``, ``--min-area`` and ``--mask``. Raises UserError for wrong ones."""
    masks = masks_of(arguments)
    least = Settings().min_area_px if arguments.min_area is None else arguments.min_area
    if least < 1:
        raise UserError(f"--min-area is {least}; it must be at least 1 pixel")
    if arguments.level is None:
        if arguments.method == "fixed":
            raise UserError("--method fixed needs --level N beside it")
        return Settings(method=arguments.method or "hats", min_area_px=least, masks=masks)
    if arguments.method not in (None, "fixed"):
        raise UserError(f"--level {arguments.level} is a fixed level; it does not go with --method {arguments.method}")
    with blaming("--"):
        return Settings(method="fixed", level=arguments.level, min_area_px=least, masks=masks)


@contextlib.contextmanager
def logged(arguments: argparse.Namespace) -> Iterator[None]:
    """Write events where the arguments of a command say, and nowhere by default, while the context lasts."""
    level, path = getattr(arguments, "log_level", None), getattr(arguments, "log_file", None)
    handler: logging.Handler = logging.NullHandler()
    if path is not None:
        with writing(f"--log-file {path}"):
            handler = logging.FileHandler(path, encoding="utf-8")
    elif level is not None:
        handler = logging.StreamHandler(sys.stderr)
        handler.addFilter(lambda record: not getattr(record, "is_said", False))  # is on standard error already
    handler.setFormatter(OneLine("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    failures = list[BaseException | None]()
    handler.handleError = lambda record: failures.append(sys.exc_info()[1])
    logger = logging.getLogger("dockpose")
    before = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel((level or "info").upper())
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.level, logger.propagate = before
        with contextlib.suppress(OSError):
            handler.close()
    if path is not None and failures and isinstance(failures[0], OSError):
        raise unwritable(f"--log-file {path}", failures[0], "events are missing in it")


@contextlib.contextmanager
def warned() -> Iterator[None]:
    """Write warnings of the server and of libraries to standard error meanwhile, unless events go there anyway."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(logging.WARNING)
    handler.setFormatter(OneLine("dockpose: %(message)s"))
    handler.handleError = lambda record: None
    is_there = any(type(one) is logging.StreamHandler for one in logging.getLogger("dockpose").handlers)
    loggers = [logging.getLogger(name) for name in ("py.warnings", *([] if is_there else ["dockpose.server"]))]
    for logger in loggers:
        logger.addHandler(handler)
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for logger in loggers:
            logger.removeHandler(handler)


class OneLine(logging.Formatter):
    """An event as one line: time of day (UTC), level, logger, text; control characters are spelt out."""

    converter = time.gmtime
    default_time_format = "%Y-%m-%dT%H:%M:%S"
    default_msec_format = "%s.%03dZ"

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of an event, a traceback included, without its end."""
        return printable(without_secrets(super().format(record)))
