"""Files that survive a power cut, written whole or not at all; and YAML read within limits, each fault a sentence."""

import contextlib
import copy
import errno
import functools
import os
import re
import stat
import threading
from pathlib import Path
from typing import Any

import yaml
from dockpose.text import InputError, kind_in_words, shown

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

# On macOS fsync leaves the data in the drive's own memory.
_FULL_SYNC = getattr(fcntl, "F_FULLFSYNC", None)
TEMPORARY_ENDING = ".part"


def write_whole(path: Path, data: bytes) -> None:
    """Replace a file in one step, under a temporary name first; it keeps its mode, and its owner where it may."""
    if path.is_symlink():
        path = path.resolve()
    if path.exists() and not path.is_file():  # as /dev/stdout
        path.write_bytes(data)
        return
    temporary = path.with_name(f".{path.name[:50]}.{os.getpid()}-{threading.get_native_id()}{TEMPORARY_ENDING}")
    try:
        with open(temporary, "wb") as file:
            _take_after(path, file.fileno())
            file.write(data)
            file.flush()
            _sync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        remove(temporary)
        raise


def _take_after(path: Path, descriptor: int) -> None:
    """Give an open file the owner, as far as that may be, and the mode of the one at the path, if there is one."""
    if os.name == "nt" or not path.exists():
        return
    there = path.stat()
    with contextlib.suppress(OSError):  # another user's
        os.fchown(descriptor, there.st_uid, there.st_gid)
    with contextlib.suppress(OSError):  # a file system without modes
        os.fchmod(descriptor, stat.S_IMODE(there.st_mode))


class GrowingFile:
    """A file that grows by whole pieces, and is cut back to the last of them where it cannot be written."""

    def __init__(self, path: Path) -> None:
        self.path, self._whole_bytes = path, 0
        self._file = path.open("wb", buffering=0)

    def write(self, data: bytes) -> int:
        """Write all of the data at once, and return its length. Raises OSError where that cannot be done."""
        left = memoryview(data)
        while left:  # the system may take it in pieces
            left = left[self._file.write(left) :]
        return len(data)

    def tell(self) -> int:
        """Return the place."""
        return self._file.tell()

    def flush(self) -> None:
        """Do nothing: all is written at once."""

    def mark(self) -> None:
        """What is written so far is whole."""
        if self.path.is_file():
            self._whole_bytes = os.fstat(self._file.fileno()).st_size  # a muxer may be at its beginning

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def cut(self) -> str:
        """Close the file, which could not be written; only what is whole stays. Returns what that is, in words."""
        self._file.close()
        if not self.path.is_file():
            return ""
        if self._whole_bytes == 0:
            remove(self.path)
            return "; nothing of it is kept"
        os.truncate(self.path, self._whole_bytes)
        return "; what was written before is kept"


def sync_folder(folder: Path) -> None:
    """Flush a folder's names to the disk. Windows does so by itself and offers no call for it."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        _sync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some network folders cannot
            raise
    finally:
        os.close(descriptor)


def remove(path: Path) -> None:
    """Remove a file if possible."""
    with contextlib.suppress(OSError):
        path.unlink()


def remove_temporaries(folder: Path) -> None:
    """Remove the temporary files of a program that was stopped while writing."""
    for path in folder.glob(f".*{TEMPORARY_ENDING}"):
        remove(path)


def _sync(descriptor: int) -> None:
    if _FULL_SYNC is not None and fcntl is not None:
        with contextlib.suppress(OSError):
            fcntl.fcntl(descriptor, _FULL_SYNC)
            return
    os.fsync(descriptor)


# A camera file with all of a calibration's corners, as OpenCV's own program writes it, has some 200 kB.
MOST_BYTES = 300_000
_MOST_NODES = 20_000  # keys and values, with those of aliases counted wherever they are repeated
_DEEPEST = 30
_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0)
_LONGEST = 300  # characters of what YAML says of a fault


class FileError(InputError):
    """A file that cannot be used; the text names the file, the key and the fault."""


class NotYamlError(FileError):
    """Text that is no YAML."""


class PlainTextError(FileError):
    """YAML that is one text, without keys."""


class _Reader(yaml.SafeLoader):
    """Safe YAML within limits, that refuses a key given twice, and knows OpenCV's matrices."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = self._count = 0
        self._sizes: dict[int, int] = {}  # nodes in each node that is done, by its identity

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Read one node with all that is in it."""
        is_alias = self.check_event(yaml.AliasEvent)
        mark = self.peek_event().start_mark
        if self._depth >= _DEEPEST:
            raise yaml.MarkedYAMLError(problem=f"more than {_DEEPEST} levels of nesting", problem_mark=mark)
        self._depth, self._count = self._depth + 1, self._count + 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        if is_alias and id(node) not in self._sizes:
            raise yaml.MarkedYAMLError(problem="a value that contains itself", problem_mark=mark)
        if not is_alias and node is not None:
            _check_keys(node)
            self._sizes[id(node)] = 1 + sum(self._sizes[id(child)] for child in _children(node))
        if max(self._count, self._sizes[id(node)]) > _MOST_NODES:
            raise yaml.MarkedYAMLError(problem=f"more than {_MOST_NODES:,} values", problem_mark=mark)
        return node

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Return the Python value of a node."""
        try:
            return super().construct_object(node, deep)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            kind = node.tag.rpartition(":")[2]
            value = shown(node.value) if isinstance(node, yaml.ScalarNode) else "it"
            raise yaml.MarkedYAMLError(problem=f"{value} is no {kind}", problem_mark=node.start_mark) from error


def _check_keys(node: yaml.Node) -> None:
    """Refuse a key that is given twice: nobody could know which of its values counts."""
    seen = set()
    for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
        if isinstance(key, yaml.ScalarNode):
            if key.value in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"the key {shown(key.value)} is there twice", problem_mark=key.start_mark
                )
            seen.add(key.value)


def _children(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [each for pair in node.value for each in pair]
    return node.value if isinstance(node, yaml.SequenceNode) else []


_Reader.add_constructor("tag:yaml.org,2002:opencv-matrix", _Reader.construct_yaml_map)


class _Writer(yaml.SafeDumper):
    """Quotes text that the reader would take for a number."""


# Numbers as YAML 1.2 has them: to YAML 1.1, which PyYAML reads, 0700 is 448, 1:30 is 90, and 7e2 is text.
_RESOLVERS = {
    first: [each for each in found if not each[0].endswith((":int", ":float"))]
    for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Reader.yaml_implicit_resolvers = _Writer.yaml_implicit_resolvers = _RESOLVERS
_FLOAT = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
for _kind, _form in (("int", r"[-+]?(?:0|[1-9][0-9]*)"), ("float", _FLOAT)):
    _Reader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(f"(?:{_form})$"), list("-+.0123456789"))


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Read a YAML file of at most 0.3 MB, 20,000 values and 30 levels, whose top level is a mapping; or FileError."""
    return parse_yaml(read_small(path, MOST_BYTES), str(path))


@functools.lru_cache(maxsize=1)  # what stands beside a picture is asked for camera, dock and lights, each by itself
def _content_of(text: str) -> Any:
    return yaml.load(text, Loader=_Reader)


def parse_yaml(data: bytes, name: str) -> dict[str, Any]:
    """Return the keys and values of YAML text, as :func:`read_yaml` does; ``name`` stands for it in messages."""
    if (kind := kind_in_words(data)) is not None:
        raise FileError(f"{name}: is {kind}")
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        raise FileError(f"{name}: is not a text file") from error
    if text.startswith("%YAML:"):  # OpenCV's own spelling of the YAML directive
        text = text.partition("\n")[2]
    try:
        content = copy.deepcopy(_content_of(text))
    except yaml.YAMLError as error:
        where = getattr(error, "problem_mark", None)
        line = "" if where is None else f", line {where.line + 1}"
        problem = getattr(error, "problem", None) or f"{error}".partition("\n")[0]
        raise NotYamlError(f"{name}: is not valid YAML{line} ({problem[:_LONGEST]})") from error
    except (ArithmeticError, ValueError) as error:  # as for the character \UFFFFFFFF
        raise NotYamlError(f"{name}: is not valid YAML ({shown(str(error))})") from error
    if not isinstance(content, dict):
        top = "" if content is None else f"; its top is {type(content).__name__}"
        raise (PlainTextError if isinstance(content, str) else FileError)(f"{name}: holds no keys{top}")
    strange = next((key for key in content if not isinstance(key, str)), None)
    if strange is not None:
        raise FileError(f"{name}: has the key {shown(strange)}; keys must be text")
    return content


def read_small(path: str | Path, most_bytes: int, *, is_cut: bool = False) -> bytes:
    """Return the contents of a regular file of at most so many bytes, or, cut, of a larger one, one more than those."""
    try:
        # A pipe, which could keep us waiting for ever, is opened at once, even where nobody writes to it.
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | _WITHOUT_WAITING)) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise FileError(f"{path}: is not a regular file")
            data = file.read(most_bytes + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from error
    if len(data) > most_bytes and not is_cut:
        kind = kind_in_words(data)
        told = f"; it is {kind}" if kind else ""
        raise FileError(f"{path}: has more than the {most_bytes / 1e6:g} MB that are read{told}")
    return data


def to_yaml(content: dict[str, Any]) -> str:
    """YAML text of plain Python values, with keys in the given order and floats exact."""
    return yaml.dump(content, Dumper=_Writer, sort_keys=False, default_flow_style=None, width=100, allow_unicode=True)
