"""Which changes are drawn, and which are none that anybody could tell."""

import pytest

pytest.importorskip("cosmic_ray")
from tests.bench.mutants.changes import changes_to, mutated

pytestmark = pytest.mark.extra

CODE = '''
_ROUNDS, _OTHER = 6, 3
_STEPS = 4
_MOST = 4
_NEAR = 0.25


def settle(x: int = 2, *, lights: float | None = None) -> float:
    """Text."""
    assert x > 1
    for _ in range(_STEPS):
        if x < _NEAR:
            break
    for _ in range(_MOST):
        x = 3 * x
    for one, two in zip([x], [x], strict=True):
        if one == two:
            continue
    raise ValueError(f"{x * 2}")
'''


def drawn(code):
    """The lines that come of changes, without the spaces that some of these make."""
    lines = code.splitlines()
    for mutant in changes_to(code, "some.py"):
        after = mutated(code, mutant).splitlines()
        for line, changed in zip(lines, after, strict=True):
            if line != changed:
                yield "".join(changed.split())


def test_numbers_comparisons_and_loops_are_changed():
    assert {"_MOST=5", "_MOST=3", "_ROUNDS,_OTHER=7,3", "_NEAR=1.25", "ifx>=_NEAR:", "x=4*x", "x=3/x"} <= set(
        drawn(CODE)
    )
    assert {"for_in[]:", "ifone!=two:", "break", "defsettle(x:int=3,*,lights:float|None=None)->float:"} <= set(
        drawn(CODE)
    )


@pytest.mark.parametrize(
    "change",
    [
        "assertx>2",
        "assertnotx>1",
        "defsettle(x:int=2,/,lights:float|None=None)->float:",
        "defsettle(x:int=2,*,lights:float&None=None)->float:",
        'raiseValueError(f"{x/2}")',
        "forone,twoinzip([x],[x],strict=False):",
        "_STEPS=5",
        "_STEPS=3",
        "continue",
        "ifx<=_NEAR:",
    ],
)
def test_what_is_an_error_at_once_or_does_nothing_is_not_drawn(change):
    assert change not in set(drawn(CODE))


@pytest.mark.parametrize(
    ("line", "is_drawn"),
    [
        ("x_px < 0.3", False),
        ("x_px < 2 * _NEAR", True),  # a half, which two that are alike have
        ("x_px < 3 * _NEAR", False),
        ("chance > math.log(_NEAR)", False),
        ("x_px < 3", True),
        ("0 < x_px < 0.3", True),
        ("count / 4 < _NEAR", True),  # one of four
        ("x_px < y_px", True),
        ("x_px < far(_NEAR)", True),
    ],
)
def test_a_bound_s_very_value_matters_but_to_what_is_measured(line, is_drawn):
    loose = line.replace(" <", " <=", 1).replace(" >", " >=", 1).replace(" ", "")
    assert any(loose in changed for changed in drawn(f"_NEAR = 0.25\nis_near = {line}\n")) == is_drawn
