"""How the code is laid out: which folder imports which, how long files are, and what is documented."""

import ast
import functools
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import viser

ROOT = Path(__file__).resolve().parents[2]
HOUSES = ("app", "pipeline")
OURSELVES = ("self", "cls")
VISERS_PAGE = re.compile(
    r"mantine-[\w-]+|tabler-[\w-]+|data-dock[\w-]*|data-scrollarea[\w-]*|file_upload_|#root\b|#webgl-[\w-]+|"
    r"""\[role=["']?(?:tab|dialog|listbox)"""
)

# What each part of the library may import beside itself, in the order in which the data flows.
LIBRARY: dict[str, set[str]] = {
    "text": set(),
    "checks": {"text"},
    "palette": set(),
    "compiled": set(),
    "files": {"text", "checks"},
}
for _name in (
    "camera",
    "dock",
    "pixels",
    "thresholds",
    "lights",
    "settings",
    "pose",
    "vehicle",
    "guidance",
    "sidecar",
    "estimate",
    "tracking",
    "labels",
):
    LIBRARY[_name] = set(LIBRARY)
LIBRARY["simulate"] = {"text", "checks", "files", "camera", "dock", "lights.ellipse", "pose"}
# A simulated course that is steered by what is seen needs the estimate.
LIBRARY["sources"] = {"text", "checks", "files", "camera", "dock", "simulate", "estimate"}
LIBRARY["study"] = {*LIBRARY} - {"sources"}
LIBRARY["truth"] = set(LIBRARY) - {"simulate"}
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
    paths = [path for house in HOUSES for path in files(house)]
    every = {(path, imported) for path in paths for imported in imports_of(path)}
    return [(str(path.relative_to(ROOT)), one) for path, one in every if not is_allowed(module_name(path), one)]


def circles(house: str) -> list[set[str]]:
    """Files that import each other by way of whichever others, as sets of the names of modules."""
    every = {module_name(path): path for path in files(house)}
    known = {
        name: {every_one for one in imports_of(path) if (every_one := _module(one, every))}
        for name, path in every.items()
    }
    reached = {name: _reached(name, known) for name in known}
    found = {frozenset(one for one in reached[name] if name in reached[one]) for name in known}
    return [set(one) for one in found if one]


def _module(imported: str, every: dict[str, Path]) -> str:
    """The module that an import names, or that has the value which it names; "" for one of the other house."""
    return next((name for name in (imported, imported.rpartition(".")[0]) if name in every), "")


def _reached(begin: str, known: dict[str, set[str]]) -> set[str]:
    found, waiting = set[str](), [*known[begin]]
    while waiting:
        if (name := waiting.pop()) not in found:
            found.add(name)
            waiting += known[name]
    return found


def is_allowed(name: str, imported: str) -> bool:
    """Whether a file of either house may import that."""
    here, there = name.split(".")[1:], imported.split(".")[1:]
    if here[:1] == ["app"]:
        if there[:1] != ["app"]:
            return True
        return len(here) > 1 and len(there) > 1 and (here[1] == there[1] or floor(there[1]) < floor(here[1]))
    if there[:1] == ["app"]:
        return False
    if not here or here[0] == there[0]:  # the package itself gathers what is public
        return True
    return any(there[: len(allowed.split("."))] == allowed.split(".") for allowed in LIBRARY[here[0]])


def floor(name: str) -> int:
    return next(index for index, floor in enumerate(FLOORS) if name in floor)


def with_sections(house: str) -> dict[str, list[str]]:
    """By file, the names that are not public, and whose docstrings have sections of parameters or attributes."""
    public = _public()
    found: dict[str, list[str]] = {}
    for path in files(house):
        for name, text in _docstrings(path):
            if f"{module_name(path)}.{name}" not in public and re.search(r"^(Parameters|Attributes)\n-", text, re.M):
                found.setdefault(str(path.relative_to(ROOT)), []).append(name)
    return found


def _public() -> set[str]:
    """Full names of all that users may use, and of the classes that theirs are derived from."""
    from tests.pipeline.test_docstrings import PUBLIC

    classes = [one for value in PUBLIC.values() if inspect.isclass(value) for one in value.__mro__]
    return {*PUBLIC, *(f"{one.__module__}.{one.__qualname__}" for one in classes)}


def _docstrings(path: Path) -> Iterator[tuple[str, str]]:
    """Each docstring of a file's classes and functions, by the name of the class or function of the file's own."""
    for top in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(top, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            for node in ast.walk(top):
                if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                    yield top.name, ast.get_docstring(node) or ""


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


def touches_private_viser(text: str) -> list[str]:
    """What Python code imports or reads that is private in viser: a module, or an attribute of another object."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "viser":
            found += [f"{node.module}.{one.name}" for one in node.names]
        elif isinstance(node, ast.Import):
            found += [one.name for one in node.names if one.name.startswith("viser.")]
        elif isinstance(node, ast.Attribute) and not (isinstance(node.value, ast.Name) and node.value.id in OURSELVES):
            found += [f"._{node.attr[1:]}"] if node.attr in _private_names_of_viser() else []
        elif isinstance(node, ast.Constant) and node.value in _private_names_of_viser():  # for getattr, setattr
            found.append(str(node.value))
    return [name for name in found if re.search(r"\b_|\binfra\b", name)]


@functools.cache
def _private_names_of_viser() -> frozenset[str]:
    sources = (path.read_text(encoding="utf-8") for path in Path(viser.__file__).parent.rglob("*.py"))
    return frozenset(name for text in sources for name in re.findall(r"(?:\.|def )(_[a-z]\w*)", text))


def names_of_visers_page(text: str) -> list[str]:
    """Classes, ids and roles by which a script or a style sheet picks parts of the page that viser and Mantine made."""
    return VISERS_PAGE.findall(text)
