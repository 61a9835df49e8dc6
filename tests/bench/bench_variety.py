"""Rings under trouble of many kinds, such as motion blur, bands, torches and text, each with and without the ring."""

from collections import Counter
from multiprocessing import Pool

from tests.bench.variety import KINDS, run

PICTURES = 100  # of each kind, with the ring and without
ASKED_RIGHT, MOST_SURE, MOST_SEEN = 0.95, 0.001, 0.005
WORDS = ("right", "undecided", "refused", "wrong", "sure")


def test_rings_of_every_kind_are_found_and_their_strewn_lamps_refused():
    print(f"\n{PICTURES} pictures of each kind: what came of the ring, and rings seen where its lamps are strewn")
    print(f"{'':18}" + "".join(f"{word:>11}" for word in WORDS) + f"{'strewn ok':>11}{'sure':>6}")
    short, sure, seen, falsely_sure = [], 0, 0, 0
    with Pool(2) as pool:
        for kind in KINDS:
            found = pool.map(run, [(kind, seed, True) for seed in range(PICTURES)], chunksize=5)
            strewn = pool.map(run, [(kind, seed, False) for seed in range(PICTURES)], chunksize=5)
            counts = Counter(outcome for outcome, _, _, _ in found)
            ok = [chance for _, status, _, chance in strewn if status == "ok"]
            certain = sum(chance >= 0.95 for chance in ok)
            row = "".join(f"{counts[word]:11}" for word in WORDS)
            print(f"{kind:18}{row}{len(ok):11}{certain:6}", flush=True)
            # Undecided is right where the pose that is seen as the likelier is not, and says so.
            if counts["right"] + counts["undecided"] < ASKED_RIGHT * PICTURES:
                short.append(kind)
            sure, seen, falsely_sure = sure + counts["sure"], seen + len(ok), falsely_sure + certain
    pictures = len(KINDS) * PICTURES
    assert not short
    assert seen <= MOST_SEEN * pictures
    assert sure + falsely_sure <= MOST_SURE * 2 * pictures
