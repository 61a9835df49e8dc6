"""What is met in tanks and at sea, a kind a test: ``-k mirror`` and ``python -m tests.bench.seen mirror`` run some."""

from __future__ import annotations

from multiprocessing import get_context

import pytest

from tests.bench.seen import KINDS, MOST_GOOD_ONES, head, ratios, row, run


@pytest.fixture(scope="module")
def pool():
    with get_context("spawn").Pool(2) as pool:
        print(f"\n{head()}")
        yield pool


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_seen(kind, pool):
    results = pool.map(run, [(kind, seed) for seed in range(KINDS[kind].pictures)], chunksize=2)
    print(f"\r{row(kind, results)}", flush=True)
    missed = KINDS[kind].misses(results)
    assert not missed


def test_many_lamps_take_no_longer_than_a_few_good_pictures():
    print()
    found = ratios()
    for name, ratio in found.items():
        print(f"{name:28} {ratio:6.1f} of a good picture's time (asked {MOST_GOOD_ONES:g})")
    assert max(found.values()) <= MOST_GOOD_ONES
