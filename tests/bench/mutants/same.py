"""Kinds of changes that nobody could tell, or that end in an error at once: they are not drawn, but others instead."""

import ast
import math
import re
from functools import cache
from pathlib import Path
from typing import Any

import parso.python.tree  # noqa: F401  # pyright: ignore[reportMissingImports]  # which the operators take for loaded
from cosmic_ray.ast import ast_nodes, get_ast  # pyright: ignore[reportMissingImports]

# A share of a count may well be its bound's very value, as 0.8 of ten lights is, and so may a grey level or an area.
_COUNTED = re.compile(r"count|len\(|sum\(|share|fill|lights|sides|area|level|[Nn]umber|/")
_CONSTANT = re.compile(r"^(_?[A-Z][A-Z0-9_]*) = ([\d.e+-]+)\b", re.MULTILINE)
_STRICTNESS = re.compile(r"_(Lt_LtE|LtE_Lt|Gt_GtE|GtE_Gt)$")


def is_same(node: Any, operator: str) -> bool:
    """Whether an operator's change to a node of the code is of one of these kinds."""
    return _is_idle(node) or _is_fine_tuning(node) or _is_of_rounds(node) or _is_of_a_bound(node, operator)


def _is_idle(node: Any) -> bool:
    """Part of an annotation, a decorator, a text, a signature's star, or of what holds in any case (assert, strict)."""
    if node.type == "assert_stmt" or node.parent.type == "parameters":
        return True
    while (parent := node.parent) is not None:
        if parent.type in ("fstring", "decorator", "import_from", "assert_stmt"):
            return True
        if parent.type in ("param", "funcdef", "lambdef") and node is parent.annotation:
            return True
        if parent.type == "tfpdef" or (parent.type == "annassign" and node is parent.children[1]):
            return True
        if parent.type == "argument" and parent.get_code().strip() == "strict=True":
            return True
        node = parent
    return False


def _is_fine_tuning(node: Any) -> bool:
    """A number so large that one more or less, as the operator makes it, is less than a tenth of it."""
    return node.type == "number" and abs(ast.literal_eval(node.value)) > 10


def _is_of_rounds(node: Any) -> bool:
    """One round more or less of those in which the same is done until nothing changes, or those left: only time."""
    loop = node
    while loop is not None and loop.type not in ("for_stmt", "while_stmt"):
        loop = loop.parent
    is_rounds = loop is not None and _limit(loop) is not None
    if node.type == "keyword" and node.value == "break":
        return is_rounds
    if node.type != "number":
        return False
    code = node.get_root_node().get_code()
    named = re.match(r"(_?[A-Z]\w*) = [\d]+$", node.parent.get_code().strip())
    return named is not None and len(re.findall(rf"\b{named[1]}\b", code)) == 2 and named[1] in _limits(code)


def _limit(loop: Any) -> str | None:
    """The name of the number of rounds or steps of a loop that does not tell them apart, and may end before."""
    text = re.match(
        r"for _ in range\((\w*(?i:rounds|steps))\):.*\b(break|return)\b", loop.get_code().strip(), re.DOTALL
    )
    return text and text[1]


@cache
def _limits(code: str) -> set[str | None]:
    return {_limit(node) for node in ast_nodes(get_ast(code)) if node.type == "for_stmt"}


def _is_of_a_bound(node: Any, operator: str) -> bool:
    """``<`` for ``<=`` where what is measured is held against a fraction, which it meets with chance nought.

    Not against a half, which is what two that are alike have.
    """
    if node.type != "comparison" or len(node.children) != 3 or not _STRICTNESS.search(operator):
        return False
    for measured, bound in (node.children[::2], node.children[:-4:-2]):
        value = _constant(bound.get_code().strip(), node.get_root_node().get_code())
        if value is not None and 2 * value % 1 and not _COUNTED.search(measured.get_code()):
            return True
    return False


def _constant(text: str, code: str) -> float | None:
    """Value of an expression of numbers and of names that have them; None of any other."""
    named = _constants() | dict(_CONSTANT.findall(code))
    text = re.sub(r"\b_?[A-Z][A-Z0-9_]*\b", lambda name: named.get(name[0], name[0]), text)
    if re.sub(r"math\.(log|sqrt|tau|pi)\b|[-+*/().\de ]", "", text):
        return None
    return float(eval(text, {"math": math}))  # of numbers alone


@cache
def _constants() -> dict[str, str]:
    """Those of all files."""
    return dict(
        found for path in sorted(Path("pipeline").rglob("*.py")) for found in _CONSTANT.findall(path.read_text())
    )
