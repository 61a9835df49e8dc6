"""Run all that is slow, part by part: ``make nightly``, or ``make nightly PART="real page"`` for some of it."""

import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LOGS = ROOT / "build" / "nightly"
# What each part is called, its target in the Makefile, and what it tries.
PARTS = {
    "slow": ("test-slow", "the slow tests, and those that need large packages"),
    "real": ("real", "photographs and pictures by other programs"),
    "page": ("test-page", "the whole page in a browser"),
    "mutants": ("mutants", "changes to the code that tests should tell"),
    "benches": ("benches", "the benches on which README and notes rest, whose figures are floors"),
    "oldest": ("test-oldest", "the oldest version of each dependency"),
    "pythons": ("test-pythons", "the other Pythons"),
    "docs": ("docs", "the documentation, built"),
    "release": ("try-release", "wheel and source, in fresh environments"),
    "newcomer": ("newcomer", "the README, to the letter"),
}
_LAST_LINES = 30  # of a part that failed


class Outcome(NamedTuple):
    """What came of a part."""

    part: str
    has_passed: bool
    took_s: float
    last_line: str


def main(names: list[str]) -> int:
    """Run the parts of these names, or all. Returns 1 where one fails, 2 where there is none of a name."""
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        print(f"there is no part {unknown[0]!r}; there are {', '.join(PARTS)}")
        return 2
    LOGS.mkdir(parents=True, exist_ok=True)
    outcomes: list[Outcome] = []
    try:
        for part in names or PARTS:
            outcomes.append(run(part))
    except KeyboardInterrupt:
        print("\nstopped")
    print(f"\n{table(outcomes)}")
    left = len(names or PARTS) - len(outcomes)
    failed = [one.part for one in outcomes if not one.has_passed]
    print(f"failed: {', '.join(failed) or 'none'}" + (f"; not run: {left}" if left else ""))
    return 1 if failed or left else 0


def run(part: str) -> Outcome:
    """Run one part, whose output goes to a file; print how it ended, and of a failure the last lines."""
    target, about = PARTS[part]
    log = LOGS / f"{part}.txt"
    print(f"{part}: {about} (make {target}; {log.relative_to(ROOT)})", flush=True)
    began_s = time.monotonic()
    with log.open("w", encoding="utf-8") as file:
        done = subprocess.run(
            ["make", "--no-print-directory", target], cwd=ROOT, stdout=file, stderr=subprocess.STDOUT, check=False
        )
    lines = [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
    outcome = Outcome(part, done.returncode == 0, time.monotonic() - began_s, lines[-1].strip("= ") if lines else "")
    if not outcome.has_passed:
        print("\n".join(f"  {line}" for line in lines[-_LAST_LINES:]))
    print(f"{part}: {'passed' if outcome.has_passed else 'FAILED'} in {outcome.took_s / 60:.1f} min", flush=True)
    return outcome


def table(outcomes: list[Outcome]) -> str:
    """The outcomes as a table in Markdown."""
    rows = [
        f"| {one.part} | {'passed' if one.has_passed else 'FAILED'} | {one.took_s / 60:.1f} | {one.last_line} |"
        for one in outcomes
    ]
    return "\n".join(["| part | result | min | last line |", "| --- | --- | --- | --- |", *rows])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
