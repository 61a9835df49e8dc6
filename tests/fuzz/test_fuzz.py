"""What was once found to go wrong, and a few inputs of each target: nothing but a refusal may come out."""

import dataclasses
import math
import random

import pytest
from dockpose import estimate

from tests.fuzz.mutate import mutated
from tests.fuzz.run import MOST_S, Outcome, attack, corpus_of, judge
from tests.fuzz.seeds import ring_picture
from tests.fuzz.targets import CAMERA, DOCK, TARGETS, LieError, Target, check

FEW = 40


@pytest.mark.parametrize("name", TARGETS)
def test_what_was_found_once_is_refused_or_taken(name):
    for path in corpus_of(name):
        assert not judge(TARGETS[name], path.read_bytes()), path


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(TARGETS) - {"own files", "array"}))  # the slow ones are left to make fuzz
def test_a_few_inputs_of_each_target(name):
    seeds, rng = TARGETS[name].seeds(), random.Random(name)
    for number in range(FEW):
        data = mutated(rng, seeds)
        wrong = judge(TARGETS[name], data)
        assert not wrong, f"input {number}: {wrong}"


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_the_seeds_are_taken(name):
    for data in TARGETS[name].seeds():
        wrong = judge(TARGETS[name], data)
        assert wrong is None or name in ("array", "numbers", "search settings"), wrong


def raising(error):
    def take(data):
        raise error

    return Target(take, lambda: [b"seed"], 1.0)


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (KeyError("x"), "KeyError"),
        (ValueError("two\nlines"), "several lines"),
        (ValueError("\x1b[31m"), "several lines"),
        (ValueError("x" * 2000), "2000 characters"),
        (ValueError("not enough values to unpack"), "ValueError from the depths"),  # here no code of ours raises it
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"), "UnicodeDecodeError from the depths"),
        (LieError("not finite"), "LieError"),
        (MemoryError(), "MemoryError"),
        (RuntimeWarning("overflow"), "RuntimeWarning"),
    ],
)
def test_an_escape_is_seen(error, why):
    assert why in (judge(raising(error), b"") or "")


def test_an_escape_is_counted_and_kept(tmp_path, monkeypatch):
    monkeypatch.setitem(TARGETS, "broken", raising(KeyError("x")))
    outcome = attack("broken", 5, 0, tmp_path / "current", tmp_path / "found")
    assert (outcome.inputs, outcome.taken, outcome.refused, len(outcome.escapes)) == (5, 0, 0, 1)
    assert len(list((tmp_path / "found" / "broken").iterdir())) == 1
    assert Outcome().slowest_s <= MOST_S


def test_a_number_that_is_not_finite_is_a_lie():
    found = estimate(ring_picture(), CAMERA, DOCK)
    check(found)
    with pytest.raises(LieError, match="not finite"):
        check(dataclasses.replace(found, detection=math.nan))
