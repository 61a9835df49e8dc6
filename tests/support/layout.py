"""Figures of how the code is laid out: which folder imports which, how much is where, and what is documented."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HOUSES = ("app", "pipeline")

# What each part of the library may import beside itself, in the order in which the data flows.
LIBRARY: dict[str, set[str]] = {"checks": set(), "palette": set()}
for _name in ("camera", "dock", "thresholds", "lights", "settings", "pose", "estimate", "tracking"):
    LIBRARY[_name] = set(LIBRARY)
LIBRARY["simulate"] = {"checks", "camera", "dock", "lights.ellipse", "pose"}
# A simulated course that is steered by what is seen needs the estimate.
LIBRARY["sources"] = {"checks", "camera", "dock", "simulate", "estimate"}
LIBRARY["study"] = {*LIBRARY} - {"sources"}
LIBRARY["paper"] = {*LIBRARY} - {"sources"}

# The floors of the app, from the ground up: a folder may import those below it, and the library.
FLOORS = (
    {"errors", "resources"},
    {"inputs", "drawing"},
    {"state", "experiment"},
    {"processing"},
    {"export"},
    {"web"},
    {"commands"},
    {"cli"},
)


def files(house: str) -> list[Path]:
    return sorted((ROOT / house).rglob("*.py"))


def folders(house: str) -> list[Path]:
    return [path for path in (ROOT / house, *sorted((ROOT / house).rglob("*"))) if is_folder(path)]


def is_folder(path: Path) -> bool:
    return path.is_dir() and "__pycache__" not in path.parts


def entries(folder: Path) -> int:
    """What there is to read in a folder; py.typed is an empty mark."""
    return sum(path.name not in ("__pycache__", "py.typed") for path in folder.iterdir())


def lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def module_name(path: Path) -> str:
    """Name under which a file of the checkout is installed."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = ("dockpose", *(parts if parts[0] == "app" else parts[1:]))
    return ".".join(parts).removesuffix(".__init__")


def imports_of(path: Path) -> Iterator[str]:
    """Full names of all that a file imports of dockpose, wherever in the file."""
    package = module_name(path).split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "dockpose")
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            if module.split(".")[0] == "dockpose":
                # "from dockpose import X" and "from dockpose.app import state" name a part as well as a value.
                yield from (f"{module}.{alias.name}" for alias in node.names)


def wrong_imports() -> list[tuple[str, str]]:
    """File and import of each that goes against the order."""
    wrong = []
    for path in (*files("app"), *files("pipeline")):
        name = module_name(path)
        for imported in imports_of(path):
            if not (is_allowed_in_app if path.is_relative_to(ROOT / "app") else is_allowed_in_library)(name, imported):
                wrong.append((str(path.relative_to(ROOT)), imported))
    return sorted(set(wrong))


def is_allowed_in_library(name: str, imported: str) -> bool:
    here, there = name.split(".")[1:], imported.split(".")[1:]
    if there[:1] == ["app"]:
        return False
    if not here or here[0] == there[0]:  # the package itself gathers what is public
        return True
    return any(there[: len(allowed.split("."))] == allowed.split(".") for allowed in LIBRARY[here[0]])


def is_allowed_in_app(name: str, imported: str) -> bool:
    here, there = name.split(".")[2:], imported.split(".")[1:]
    if there[:1] != ["app"]:
        return True
    if not here or len(there) < 2:
        return False
    return here[0] == there[1] or floor(there[1]) < floor(here[0])


def floor(name: str) -> int:
    return next(index for index, floor in enumerate(FLOORS) if name in floor)


def undescribed(house: str) -> dict[str, list[str]]:
    """By folder, the documented parameters and attributes without a description, as numpydoc reads them."""
    missing: dict[str, list[str]] = {}
    for path in files(house):
        folder = str(path.parent.relative_to(ROOT))
        for name, text in _docstrings(path):
            for parameter in _parameters(text):
                if not "".join(parameter.desc).strip():
                    missing.setdefault(folder, []).append(f"{path.name}: {name}: {parameter.name}")
    return missing


def described(house: str) -> tuple[int, int]:
    """How many documented parameters and attributes have a description, and how many there are."""
    found = [p for path in files(house) for _, text in _docstrings(path) for p in _parameters(text)]
    return sum(bool("".join(one.desc).strip()) for one in found), len(found)


def _parameters(text: str) -> list:
    from numpydoc.docscrape import NumpyDocString

    read = NumpyDocString(text)
    return [*read["Parameters"], *read["Attributes"], *read["Other Parameters"]]


def _docstrings(path: Path) -> Iterator[tuple[str, str]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            text = ast.get_docstring(node, clean=True)
            if text and "----" in text:
                yield node.name, inspect.cleandoc(text)


def has_docstring(folder: Path) -> bool:
    init = folder / "__init__.py"
    return bool(init.exists() and ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))))


def packages() -> list[str]:
    """Names of all packages of the checkout, as they are installed."""
    inits = [path for house in HOUSES for path in (ROOT / house).rglob("__init__.py")]
    return sorted(module_name(path) for path in inits)


def tests_without_subject() -> list[str]:
    """Test files of tests/app and tests/pipeline that stand where no file or folder of that name stands."""
    homeless = []
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        place = path.relative_to(ROOT / "tests")
        if place.parts[0] not in HOUSES:
            continue
        subject = ROOT / place.parent / place.name.removeprefix("test_")
        if not (subject.exists() or subject.with_suffix("").is_dir()):
            homeless.append(str(place))
    return homeless
