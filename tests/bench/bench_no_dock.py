"""Pictures without a dock: how often one is seen all the same, by kind and by number of lights."""

from multiprocessing import Pool

import numpy as np
from dockpose import Camera, Dock, estimate

from tests.bench.undocked import ALL, KINDS, picture

TOLD = (*range(4, 17), None)
PICTURES, TOLD_EACH = 112, 5  # of each kind, and how many of the numbers are told for each: 40 pictures a cell
MOST_OK, SURE = 0.005, 0.95
# Of each kind, of an unknown number: 1,008. None is asked for; a cable that happens to bend round to twelve of fifteen
# places of a ring is one.
PICTURES_UNKNOWN, SEED, MOST_SURE = 72, 10_000, 1


def seen_in(job: tuple[str, int]) -> list[float]:
    """For each number of lights: NaN where it was not told, -1 where no dock is seen, else the chosen one's chance."""
    kind, seed = job
    image = picture(kind, seed)
    height, width = image.shape
    focal = width * float(np.exp(np.random.default_rng(seed).uniform(np.log(0.6), np.log(2.0))))
    camera = Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)
    probabilities = [float("nan")] * len(TOLD)
    for step in range(TOLD_EACH):
        number = (seed + 3 * step) % len(TOLD)
        found = estimate(image, camera, Dock(0.30, TOLD[number]))
        chosen = found.selected
        probabilities[number] = -1.0 if found.status != "ok" or chosen is None else chosen.probability or 0.0
    return probabilities


def test_no_dock_is_seen_where_there_is_none():
    jobs = [(kind, seed) for kind in KINDS for seed in range(PICTURES)]
    with Pool(2) as pool:
        found = np.array(pool.map(seen_in, jobs, chunksize=5)).reshape(len(KINDS), PICTURES, len(TOLD))
    told = np.isfinite(found)
    seen, sure = told & (found >= 0), told & (found >= SURE)
    print(f'\nPictures without a dock, {PICTURES} of each kind: "ok", in brackets with p >= {SURE}; in %')
    print(f"{'N told':8}" + "".join(f"{lights or 'none':>13}" for lights in TOLD) + f"{'all':>13}")
    for number, kind in enumerate([*KINDS, "all"]):
        which = slice(None) if kind == "all" else slice(number, number + 1)
        cells = [*(slice(column, column + 1) for column in range(len(TOLD))), slice(None)]
        asked = [told[which, :, cell].sum() for cell in cells]
        shares = [
            [100 * part[which, :, cell].sum() / n for part in (seen, sure)]
            for cell, n in zip(cells, asked, strict=True)
        ]
        print(f"{kind:8}" + "".join(f"{ok:6.1f} ({certain:4.1f})" for ok, certain in shares))
    assert seen.sum() / told.sum() <= MOST_OK
    # A kind alone has 560 answers, of which three are 0.5 %; of so few there may be twice as many by chance.
    assert (seen.sum(axis=(1, 2)) / told.sum(axis=(1, 2))).max() <= 2 * MOST_OK


def sure_of(job: tuple[str, int]) -> float | None:
    """How sure a dock of an unknown number of lights is of a pose that is seen; None where none is seen."""
    kind, seed = job
    image = picture(kind, seed)
    height, width = image.shape
    focal = width * float(np.exp(np.random.default_rng(seed).uniform(np.log(0.6), np.log(2.0))))
    found = estimate(image, Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height), Dock(0.30))
    if found.selected is None:
        return None
    return (found.selected.probability or 0.0) * (found.detection or 0.0)


def test_of_an_unknown_number_nothing_is_surely_a_dock_where_there_is_none():
    jobs = [(kind, SEED + seed) for kind in ALL for seed in range(PICTURES_UNKNOWN)]
    with Pool(2) as pool:
        found = dict(zip(jobs, pool.map(sure_of, jobs, chunksize=5), strict=True))
    sure = [job for job, probability in found.items() if (probability or 0.0) >= SURE]
    print(f"\nPictures without a dock, number unknown: {len(jobs)}, of each kind seen, and sure:")
    for kind in ALL:
        of = [found[job] for job in jobs if job[0] == kind]
        certain = [seed for one, seed in sure if one == kind]
        print(f"{kind:12} {sum(each is not None for each in of):4} {len(certain):4}  {certain or ''}")
    assert len(sure) <= MOST_SURE
