"""The pictures and videos of a folder on this machine; no name that a browser sends leads out of it."""

from functools import lru_cache
from pathlib import Path

from dockpose.app.errors import UserError
from dockpose.sources import BAG_ENDINGS, PICTURE_ENDINGS, VIDEO_ENDINGS, Kind, kind_of, numeric

_OF_PAGES = (".tif", ".tiff", ".gif", ".webp")  # as a rule; those of a single picture are left out
_DEEPEST, _MOST_FOLDERS, _MOST_FILES = 4, 200, 5000


def step(names: list[str], name: str, by: int) -> str | None:
    """The name so many places further; None beyond the ends, or where the name is not there."""
    if name not in names or not 0 <= names.index(name) + by < len(names):
        return None
    return names[names.index(name) + by]


def below(root: Path, relative: str) -> Path:
    """The path of what is below a root folder."""
    try:
        path = (root / relative).resolve(strict=True)
    except (OSError, ValueError, RuntimeError) as error:
        raise UserError(f"{relative} is not in the folder.") from error
    if not path.is_relative_to(root.resolve()):
        raise UserError(f"{relative} is not below the folder that was given at the start.")
    return path


def folders_below(root: Path) -> list[str]:
    """The root itself, as ".", and the folders below it, four deep, that do not lead out of it."""
    found, level = ["."], ["."]
    for _ in range(_DEEPEST):
        level = [name for above in level for name in _inside(root, above) if (root / name).is_dir()]
        found += sorted(level)
    return found[:_MOST_FOLDERS]


def pictures_in(root: Path, folder: str) -> list[str]:
    """Names, relative to the root, of the pictures of one folder, frame2 before frame10."""
    return _files_in(root, [folder], PICTURE_ENDINGS)


def videos_below(root: Path) -> list[str]:
    """Names, relative to the root, of the videos, bags and pictures of several pages in it and below it."""
    names = _files_in(root, folders_below(root), (*VIDEO_ENDINGS, *BAG_ENDINGS, *_OF_PAGES))
    return [name for name in names if not name.lower().endswith(_OF_PAGES) or _has_pages(root / name)]


def _has_pages(path: Path) -> bool:
    try:
        about = path.stat()
    except OSError:  # gone meanwhile
        return False
    return _looked_at(str(path), about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=_MOST_FILES)
def _looked_at(path: str, _mtime_ns: int, _size: int) -> bool:
    """Whether a file, as it was then, has several pages; the page lists a folder often, and each look opens a file."""
    return kind_of(path) is Kind.PAGES


def _files_in(root: Path, folders: list[str], endings: tuple[str, ...]) -> list[str]:
    names = [name for folder in folders for name in _inside(root, folder) if Path(name).suffix.lower() in endings]
    files = [name for name in names if (root / name).is_file()]
    return sorted(files, key=lambda name: numeric(Path(name)))[:_MOST_FILES]


def _inside(root: Path, folder: str) -> list[str]:
    """What is in a folder and not hidden, relative to the root, without links that lead out of it."""
    found = []
    for entry in below(root, folder).iterdir():
        name = (Path(folder) / entry.name).as_posix()
        try:
            below(root, name)
        except UserError:
            continue
        if not entry.name.startswith("."):
            found.append(name)
    return found
