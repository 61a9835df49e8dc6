"""The files of a bag, opened by their first bytes, and expanded where they were compressed as a whole."""

import contextlib
import tempfile
from pathlib import Path

from dockpose.files import FileError, read_yaml
from dockpose.sources.bags import storage
from dockpose.sources.bags.sqlite_file import SqliteFile
from dockpose.sources.bags.storage import BAG_METADATA, Storage
from dockpose.sources.frames import SourceError
from dockpose.sources.pictures import numeric

_MOST_TIMES = 1000  # that a file expands by, beyond the size of a chunk; dark pictures reach some hundreds
_PART_BYTES = 1 << 20


def opened_files(source: str) -> tuple[list[Storage], str, contextlib.ExitStack]:
    """The files of a bag, by what it shows that its recorder was killed, and what closes them."""
    path = Path(source)
    try:
        import mcap.records  # noqa: F401
        import rosbags.typesys  # noqa: F401
    except ImportError as error:
        needed = "needs the packages that read bags: pip install 'dockpose[ros]'"
        raise SourceError(f"{source}: {needed}") from error
    path = path.parent if path.name == BAG_METADATA else path
    paths, unfinished = [path], ""
    if path.is_dir() and not (path / BAG_METADATA).is_file():
        unfinished = f"as it has no {BAG_METADATA}"
        paths = sorted(filter(storage.is_rosbag2_file, path.iterdir()), key=numeric)
    elif path.is_dir():
        paths = _described(path)
    if not paths:
        raise SourceError(f"{path}: the bag has no files")
    with contextlib.ExitStack() as stack:
        return [_opened(each, stack) for each in paths], unfinished, stack.pop_all()


def _opened(path: Path, stack: contextlib.ExitStack) -> Storage:
    from dockpose.sources.bags.chunked import McapFile, Ros1File

    try:
        storage.check_regular(path)
        if path.stat().st_size == 0:
            raise SourceError("the file is empty (0 bytes)")
        if is_packed := storage.head_of(path).startswith(storage.ZSTD_BEGINS) or path.suffix.lower() == ".zstd":
            path = _unpacked(path, Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="dockpose-"))))
        ending = storage.ending_of(storage.head_of(path))
        if ending is None and is_packed:
            raise SourceError("is compressed by zstd, and what is in it is no bag")
        ending = ending or path.suffix.lower()  # whose reader says what is amiss
        if ending == ".db3":
            file: Storage = SqliteFile(path)
        else:
            file = McapFile(path) if ending == ".mcap" else Ros1File(path)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror or error})") from error
    except SourceError as error:
        raise SourceError(f"{path}: {error}") from error
    stack.callback(file.close)
    return file


def _unpacked(path: Path, folder: Path) -> Path:
    """Expand a file that was compressed as a whole into a folder."""
    import zstandard

    unpacked = folder / path.stem
    most = storage.MOST_BYTES + _MOST_TIMES * path.stat().st_size
    too_much = SourceError(f"expands to more than {_MOST_TIMES} times its size, as no bag does")
    try:
        with path.open("rb") as file, unpacked.open("wb") as target:
            if zstandard.frame_content_size(file.read(32)) > most:  # as far as the file says
                raise too_much
            file.seek(0)
            reader = zstandard.ZstdDecompressor().stream_reader(file)
            while part := reader.read(_PART_BYTES):
                target.write(part)
                if target.tell() > most:
                    raise too_much
    except zstandard.ZstdError as error:
        raise SourceError(f"is damaged: {error}") from error
    return unpacked


def _described(folder: Path) -> list[Path]:
    """The files that a folder's metadata.yaml names."""
    try:
        content = read_yaml(folder / BAG_METADATA)
    except FileError as error:
        raise SourceError(str(error)) from error
    about = content.get("rosbag2_bagfile_information")
    if not isinstance(about, dict) or not isinstance(about.get("relative_file_paths"), list):
        raise SourceError(f"{folder / BAG_METADATA}: describes no bag: it names no relative_file_paths")
    paths = list(dict.fromkeys(folder / Path(str(name)).name for name in about["relative_file_paths"]))
    missing = [str(path) for path in paths if not path.is_file()]
    if missing:
        raise SourceError(f"{folder}: the bag's {', '.join(missing)} is not there")
    if about.get("compression_format") not in (None, "", "zstd"):
        raise SourceError(f"{folder}: is compressed by {about['compression_format']!r}; zstd is read")
    return paths
