"""Attack a running page and write what came of it into SECURITY.md: ``python -m tests.attack``.

With part of a name after it, only those attacks are made, and their rows replaced.

Exit status 1 where an attack was not refused, was not logged in a line, cost memory, or kept other browsers waiting.
"""

import gc
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from dockpose.sidecar import sample_path

from tests.attack import files, floods, messages, requests
from tests.attack.program import PAGE, Bystanders, Program

SECURITY = Path(__file__).resolve().parents[2] / "SECURITY.md"
BEGIN, END = "<!-- make security writes this table -->", "<!-- end of the table -->"
LONGEST_ANSWER_S = 0.25
MOST_MEMORY_BYTES = 8 * PAGE  # after an attack, above what was there before it
# Without a line in the log: these are no refusals.
QUIET = {"200 browsers that come and go", "100 requests that never end"}


@dataclass
class Outcome:
    """What came of an attack; ``faults`` is empty where all is as it should be."""

    name: str
    result: str
    lines: int
    memory_mb: float
    answer_ms: float
    faults: list[str]

    def row(self):
        said = "; ".join([self.result, *(f"**{fault}**" for fault in self.faults)])
        return f"| {self.name} | {said} | {self.lines} | {self.memory_mb:+.0f} MB | {self.answer_ms:.0f} ms |"


def tried(program, bystanders, number, name, attack):
    """Run one attack from an address of its own."""
    source = f"127.0.1.{number}"
    bystanders.slowest_s()
    before_lines, before_bytes = len(program.lines()), settled(program)
    faults = []
    try:
        result = attack(program, source)
    except Exception as error:
        result = "not as it should be"
        faults.append(f"{type(error).__name__}: {str(error)[:200]}")
    answer_s = bystanders.slowest_s()
    lines = [line for line in program.lines()[before_lines:] if " WARNING " in line or " ERROR " in line]
    grown = settled(program, before_bytes) - before_bytes
    for _ in range(3):
        if grown > MOST_MEMORY_BYTES and not faults:  # what was loaded or made once stays; what leaks grows again
            before_bytes = program.memory_bytes
            attack(program, source)
            grown = settled(program, before_bytes) - before_bytes
    if answer_s > LONGEST_ANSWER_S:
        faults.append("slow for others")
    if not lines and name not in QUIET:
        faults.append("not logged")
    if any("Traceback" in line for line in lines):
        faults.append("a traceback")
    if grown > MOST_MEMORY_BYTES:
        faults.append("memory stays")
    return Outcome(name, result, len(lines), grown / 1e6, 1000 * answer_s, faults)


def settled(program, at_most=0):
    """The program's memory once what is let go of is free again, which takes some seconds."""
    end_s = time.monotonic() + 8
    gc.collect()
    while (memory := program.memory_bytes) > at_most + MOST_MEMORY_BYTES and at_most and time.monotonic() < end_s:
        time.sleep(0.25)
    return memory


def attacked(folder: Path, only: str = "") -> list[Outcome]:
    """Start the page and try all attacks on it, or those whose names hold ``only``."""
    pictures = folder / "pictures"
    pictures.mkdir()
    shutil.copy(sample_path("plain"), pictures / "plain.png")
    limit = ("--upload-limit-mb", str(files.LIMIT_MB))
    outcomes = []
    with Program(folder, "--folder", str(pictures), *limit) as program:
        bystanders = Bystanders(program.address)
        messages.many_visits(program, "127.0.1.250")  # what is made once is there before memory is compared
        all_of_them = requests.ATTACKS | messages.ATTACKS | files.ATTACKS | floods.ATTACKS
        for number, (name, attack) in enumerate(all_of_them.items(), 1):
            if only in name:
                outcomes.append(tried(program, bystanders, number, name, attack))
                print(outcomes[-1].row(), flush=True)
        bystanders.close()
        for text in (program.log.read_text(), program.terminal.read_text().partition("(Ctrl+C stops it)")[2]):
            for line in text.splitlines():
                if program.token in line:
                    outcomes.append(Outcome("The log", "", 0, 0, 0, [f"it has a token: {line[:120]}"]))
    return outcomes


def table(outcomes) -> str:
    head = "| Attack | Result | Log lines | Memory kept | Slowest answer for others |\n|---|---|---|---|---|\n"
    return head + "\n".join(one.row() for one in outcomes)


def replaced(old: str, outcomes) -> str:
    """The table with the rows of some attacks made anew."""
    rows = {one.name: one.row() for one in outcomes}
    return "\n".join(rows.get(line.split("|")[1].strip(), line) for line in old.splitlines())


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        outcomes = attacked(Path(folder), *sys.argv[1:2])
    before, _, rest = SECURITY.read_text(encoding="utf-8").partition(BEGIN)
    old, _, after = rest.partition(END)
    made = replaced(old.strip(), outcomes) if sys.argv[1:] else table(outcomes)
    SECURITY.write_text(f"{before}{BEGIN}\n\n{made}\n\n{END}{after}", encoding="utf-8")
    faulty = [one for one in outcomes if one.faults]
    for one in faulty:
        print(f"{one.name}: {'; '.join(one.faults)}", file=sys.stderr)
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
