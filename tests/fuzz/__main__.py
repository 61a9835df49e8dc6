"""Draws inputs for every target, and prints what became of them: ``python -m tests.fuzz --inputs 1000000``.

An input escapes where anything but a ValueError with one short sentence comes out, a number of a result is not finite,
it takes more than 2 s, or the memory grows by more than 500 MB. Each target runs in processes of its own, so that one
that crashes is seen: its last input is kept. Escapes are kept in ``build/fuzz``; what is mended moves to the corpus.
"""

import argparse
import importlib.util
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.fuzz.run import Outcome, attack, from_json, to_json, total_of
from tests.fuzz.targets import TARGETS, in_order

FOUND = Path("build/fuzz")
# Readers in Python: of what compiled code does, coverage sees nothing.
GUIDED = ("camera", "dock", "session", "json lines", "sidecar")
_AT_ONCE = 20_000  # inputs of one process
_MOST_S = 1800.0  # of one process


def main() -> int:
    """Run; the exit status is 1 where an input escaped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=1_000_000, help="how many in all (default: %(default)s)")
    parser.add_argument("--only", choices=TARGETS, help="one target alone, with all of the inputs")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once (default: %(default)s)")
    parser.add_argument("--guided", type=int, default=0, help="inputs of each reader, guided by coverage")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker is not None:
        print(to_json(attack(arguments.only, arguments.inputs, arguments.seed, arguments.worker, FOUND)))
        return 0
    wanted = [(arguments.only, arguments.inputs)] if arguments.only else list(in_order(arguments.inputs))
    parts = [
        (name, min(_AT_ONCE, inputs - start), 1000 * arguments.seed + number)
        for name, inputs in wanted
        for number, start in enumerate(range(0, inputs, _AT_ONCE))
    ]
    outcomes = []
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for (name, _, _), outcome in zip(parts, pool.map(lambda part: _in_process(*part), parts), strict=True):
            outcomes.append(outcome)
            told = f"{name}, {outcome.inputs} inputs, {len(outcome.escapes)} escapes"
            print(f"{len(outcomes)} of {len(parts)} parts: {told}", file=sys.stderr, flush=True)
    if arguments.guided and importlib.util.find_spec("atheris") is None:
        print("Inputs guided by coverage are left out: there is no atheris for this Python.")
    elif arguments.guided:
        parts += [(name, arguments.guided, -1) for name in GUIDED]
        outcomes += [_guided(name, arguments.guided) for name in GUIDED]
    each_part = list(zip(parts, outcomes, strict=True))
    return _report([(name, total_of([one for part, one in each_part if part[0] == name])) for name, _ in wanted])


def _in_process(name: str, inputs: int, seed: int) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        current = Path(folder) / "current"
        command = [sys.executable, "-m", "tests.fuzz", "--only", name, "--inputs", str(inputs), "--seed", str(seed)]
        try:
            done = subprocess.run([*command, "--worker", current], capture_output=True, text=True, timeout=_MOST_S)
            if done.returncode == 0:
                return from_json(done.stdout.splitlines()[-1])
            why = f"the process ended with {done.returncode}: {done.stderr.strip().splitlines()[-1:]}"
        except subprocess.TimeoutExpired:
            why = f"the process did not end within {_MOST_S:.0f} s"
        kept = FOUND / name.replace(" ", "_") / f"crash-{seed}"
        kept.parent.mkdir(parents=True, exist_ok=True)
        if current.exists():
            kept.write_bytes(current.read_bytes())
        return Outcome(escapes={why: str(kept)})


def _guided(name: str, inputs: int) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        counted = Path(folder) / "counted"
        command = [sys.executable, "-m", "tests.fuzz.guided", name, "--inputs", str(inputs), "--counted", str(counted)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=_MOST_S)
        outcome = Outcome(inputs=int(counted.read_text()) if counted.exists() else 0)
        if done.returncode != 0:
            told = [line for line in done.stderr.splitlines() if "Error" in line] or done.stderr.splitlines()[-1:]
            outcome.escapes[f"guided by coverage: {told[-1] if told else done.returncode}"] = f"{FOUND}/crash-*"
        return outcome


def _report(outcomes: list[tuple[str, Outcome]]) -> int:
    print(f"{'target':16} {'inputs':>9} {'taken':>9} {'refused':>9} {'escapes':>8} {'slowest s':>10} {'memory MB':>10}")
    for name, each in [*outcomes, ("in all", total_of([outcome for _, outcome in outcomes]))]:
        numbers = f"{each.inputs:>9,} {each.taken:>9,} {each.refused:>9,} {len(each.escapes):>8}"
        print(f"{name:16} {numbers} {each.slowest_s:>10.2f} {each.peak_mb:>10.0f}")
    for name, each in outcomes:
        for wrong, path in each.escapes.items():
            print(f"{name}: {wrong} ({path})")
    return int(any(each.escapes for _, each in outcomes))


if __name__ == "__main__":
    sys.exit(main())
