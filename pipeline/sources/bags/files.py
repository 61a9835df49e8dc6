"""The files of a bag: one by itself, or those of a folder as rosbag2 writes it."""

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from dockpose.files.yaml_file import FileError, read_yaml
from dockpose.sources.bags.mcap_file import McapFile
from dockpose.sources.bags.ros1_file import Ros1File
from dockpose.sources.bags.sqlite_file import SqliteFile
from dockpose.sources.bags.storage import MOST_BYTES, Storage, expanded
from dockpose.sources.frames import SourceError
from dockpose.sources.names import BAG_METADATA, check_regular, is_rosbag2_file
from dockpose.sources.pictures import numeric

_PACKED = ".zstd"
_MOST_TIMES = 1000  # that a file expands by, beyond the size of a chunk; dark pictures reach some hundreds
_PART_BYTES = 1 << 20


class BagFiles:
    """The files of a bag, open."""

    def __init__(self, source: str) -> None:
        path = Path(source)
        self.storages: list[Storage] = []
        self.is_unfinished = False
        self._unpacked: tempfile.TemporaryDirectory[str] | None = None
        try:
            import mcap.records  # noqa: F401
            import rosbags.typesys  # noqa: F401
        except ImportError as error:
            needed = "needs the packages that read bags: pip install 'dockpose[ros]'"
            raise SourceError(f"{source}: {needed}") from error
        try:
            if path.is_dir():
                self._open_folder(path)
            else:
                self._open(path)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Release the files."""
        for storage in self.storages:
            storage.close()
        if self._unpacked is not None:
            self._unpacked.cleanup()

    def _open_folder(self, folder: Path) -> None:
        expand: Callable[[bytes], bytes] | None = None
        if (folder / BAG_METADATA).is_file():
            paths, is_by_message = _described(folder)
            expand = partial(expanded, "zstd") if is_by_message else None
        else:
            self.is_unfinished = True
            paths = sorted(filter(is_rosbag2_file, folder.iterdir()), key=numeric)
        for path in paths:
            self._open(path, expand)
        if not self.storages:
            raise SourceError(f"{folder}: the bag has no files")

    def _open(self, path: Path, expand: Callable[[bytes], bytes] | None = None) -> None:
        number = len(self.storages)
        try:
            check_regular(path)
            if path.stat().st_size == 0:
                raise SourceError("the file is empty (0 bytes)")
            if path.suffix.lower() == _PACKED:
                path = self._unpack(path)
            ending = path.suffix.lower()
            if ending == ".db3":
                self.storages.append(SqliteFile(path, number, expand))
            else:
                self.storages.append(McapFile(path, number) if ending == ".mcap" else Ros1File(path, number))
        except OSError as error:
            raise SourceError(f"{path}: cannot be read ({error.strerror or error})") from error
        except SourceError as error:
            raise SourceError(f"{path}: {error}") from error

    def _unpack(self, path: Path) -> Path:
        """Expand a file that was compressed as a whole, into a folder that is deleted at the end."""
        import zstandard

        if self._unpacked is None:
            self._unpacked = tempfile.TemporaryDirectory(prefix="dockpose-")
        whole = Path(self._unpacked.name) / path.stem
        most = MOST_BYTES + _MOST_TIMES * path.stat().st_size
        too_much = SourceError(f"expands to more than {_MOST_TIMES} times its size, as no bag does")
        try:
            with path.open("rb") as file, whole.open("wb") as target:
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
        return whole


def _described(folder: Path) -> tuple[list[Path], bool]:
    """The files that a folder's metadata.yaml names, and whether messages are compressed one by one."""
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
    return paths, str(about.get("compression_mode", "")).lower() == "message"
