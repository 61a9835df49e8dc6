"""Which changes to the code there are, by Cosmic Ray's operators, and which lines must run for a test to tell."""

import ast
import importlib.util
import re
from collections.abc import Iterator
from functools import cache
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from typing import Any, NamedTuple

import parso.python.tree  # noqa: F401  # pyright: ignore[reportMissingImports]  # which the operators take for loaded
from cosmic_ray.ast import ast_nodes, get_ast  # pyright: ignore[reportMissingImports]
from cosmic_ray.mutating import mutate_code  # pyright: ignore[reportMissingImports]
from cosmic_ray.plugins import get_operator  # pyright: ignore[reportMissingImports]

from tests.bench.mutants.same import is_same

PACKAGES = ("estimate", "lights", "pose", "thresholds", "tracking")
# Those that make what a person might have written; most others end in an error at once, which would flatter.
OPERATORS = (
    *(f"ReplaceBinaryOperator_{pair}" for pair in (
        "Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Div", "Mod_FloorDiv", "Pow_Mul",
        "BitAnd_BitOr", "BitOr_BitAnd",
    )),
    *(f"ReplaceComparisonOperator_{pair}" for pair in (
        "Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt", "Lt_GtE", "Gt_LtE", "Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is"
    )),
    "ReplaceUnaryOperator_USub_UAdd", "ReplaceUnaryOperator_Delete_Not", "ReplaceUnaryOperator_Delete_Invert",
    "AddNot", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "NumberReplacer", "ZeroIterationForLoop",
)  # fmt: skip


class Mutant(NamedTuple):
    """A change to a line of a file."""

    file: str
    line: int
    column: int
    operator: str
    occurrence: int


def all_mutants(root: Path) -> Iterator[Mutant]:
    """Every change to the packages that may matter, file by file."""
    for package in PACKAGES:
        for path in sorted((root / "pipeline" / package).rglob("*.py")):
            yield from changes_to(path.read_text(encoding="utf-8"), path.relative_to(root).as_posix())


def changes_to(source: str, file: str) -> Iterator[Mutant]:
    """Every change to a file that may matter."""
    nodes = list(ast_nodes(get_ast(source)))
    for name in OPERATORS:
        operator = _operator(name)
        places = ((node, start) for node in nodes for start, _ in operator.mutation_positions(node))
        for occurrence, (node, start) in enumerate(places):
            if not is_same(node, name):
                yield Mutant(file, start[0], start[1], name, occurrence)


def mutated(source: str, mutant: Mutant) -> str:
    """The file's text with the change."""
    text = mutate_code(source, _operator(mutant.operator), mutant.occurrence)
    assert text is not None
    return text


@cache
def _operator(name: str) -> Any:
    return get_operator(f"core/{name}")()


def kind_of(mutant: Mutant) -> str:
    """Whether it changes code, or loops that tests see only as plain Python."""
    return "loops" if lines_of(mutant)[0] else "code"


@cache
def lines_of(mutant: Mutant) -> tuple[bool, set[int]]:
    """Lines of which one runs where the statement at a line does, and whether they are a compiled loop's.

    Of what runs when the file is loaded: the lines that mention the name, or all.
    """
    source, line = Path(mutant.file).read_text(encoding="utf-8"), mutant.line
    tree = ast.parse(source)
    around = [node for node in ast.walk(tree) if isinstance(node, ast.stmt) and node.lineno <= line <= _last(node)]
    functions = [node for node in around if isinstance(node, ast.FunctionDef)]
    is_loop = any("compiled" in ast.unparse(one) for node in functions for one in node.decorator_list)
    inner = max(around, key=lambda node: (node.lineno, -_last(node)))
    if functions and inner not in functions:
        body = getattr(inner, "body", None)
        return is_loop, set(range(inner.lineno, (body[0].lineno if body else _last(inner) + 1)))
    if functions:
        return is_loop, set(range(functions[-1].body[0].lineno, _last(functions[-1]) + 1))
    names = [node.id for node in ast.walk(inner) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    used = {
        number
        for number, text in enumerate(source.splitlines(), 1)
        if any(re.search(rf"\b{name}\b", text) for name in names)
        and number not in range(inner.lineno, _last(inner) + 1)
    }
    return "@compiled" in source, used or set(range(1, len(source.splitlines()) + 1))


def _last(node: ast.stmt) -> int:
    return node.end_lineno or node.lineno


class Mutated(SourceFileLoader):
    """Loads one module from a text, and leaves nothing on the disk."""

    def __init__(self, path: Path, text: str) -> None:
        parts = path.with_suffix("").parts
        self.name = ".".join(["dockpose", *parts[parts.index("pipeline") + 1 :]]).removesuffix(".__init__")
        super().__init__(self.name, str(path))
        self._text = text

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """The module's spec, where it is asked for."""
        return importlib.util.spec_from_file_location(name, self.path, loader=self) if name == self.name else None

    def get_data(self, path: Any) -> bytes:
        """The text instead of the file's."""
        return self._text.encode()

    def path_stats(self, path: Any) -> Any:
        """No times, so that no bytecode is read or kept."""
        raise OSError
