"""The paper's figures made twice from one seed: the same byte for byte, small, and within their budget of computing."""

import time
from dataclasses import replace
from pathlib import Path

from dockpose.app.export.parts import Part, make_part

FIGURES = tuple(f"figure_{number}" for number in (3, 5, 6, 7, 8, 14, 15, 16)) + ("literal_hats",)
MOST_S, MOST_BYTES = 150.0, 2_000_000


def written(part: Part, folder: Path) -> dict[str, bytes]:
    """The bytes of all files of a part."""
    folder.mkdir()
    part.write(folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_figures_are_the_same_again_small_and_made_in_time(tmp_path):
    seconds, size = 0.0, 0
    print(f"\n{'part':16}{'s of one core':>14}{'kB in the page':>16}")
    for key in FIGURES:
        start = time.process_time()
        part = make_part(key, 2016)
        taken = time.process_time() - start
        inline = sum(len(str(plot.inline)) for plot in part.plots)
        print(f"{key:16}{taken:14.1f}{inline / 1000:16.0f}", flush=True)
        again = make_part(key, 2016)
        assert replace(again, tables=()) == replace(part, tables=())
        assert written(again, tmp_path / f"{key}_again") == written(part, tmp_path / key)
        seconds, size = seconds + taken, size + inline
    print(f"{'together':16}{seconds:14.1f}{size / 1000:16.0f}")
    assert seconds < MOST_S
    assert size < MOST_BYTES
