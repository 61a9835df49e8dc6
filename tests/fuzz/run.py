"""Runs targets on drawn inputs in a process of its own, and judges what comes of each."""

import hashlib
import json
import random
import re
import resource
import time
import traceback
import warnings
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tests.fuzz.mutate import mutated
from tests.fuzz.targets import TARGETS, Target

MOST_S, MOST_MB = 2.0, 500.0
CORPUS = Path(__file__).parent / "corpus"


@dataclass
class Outcome:
    """What became of the inputs of one target.

    Attributes
    ----------
    inputs, taken, refused : int
        How many were drawn, and of these taken and refused.
    escapes : dict of str to str
        Where something else came out: the place in the code, and the name of the input's file.
    slowest_s : float
        Of one input.
    peak_mb : float
        By how much the memory grew at most.
    """

    inputs: int = 0
    taken: int = 0
    refused: int = 0
    escapes: dict[str, str] = field(default_factory=dict)
    slowest_s: float = 0.0
    peak_mb: float = 0.0


def judge(target: Target, data: bytes, most_s: float = MOST_S) -> str | None:
    """Give one input to a target; None where it was taken, empty where it was refused well, else what is wrong.

    An input that takes long is given twice, since loops that were not needed before are compiled on first use.
    """
    return _judged(target, data, most_s)[0]


def _judged(target: Target, data: bytes, most_s: float = MOST_S) -> tuple[str | None, float]:
    """See :func:`judge`; and how many seconds the input took."""
    wrong, took_s = _judged_once(target, data)
    if not wrong and took_s > most_s:
        wrong, took_s = _judged_once(target, data)
    return (f"took {took_s:.1f} s" if not wrong and took_s > most_s else wrong), took_s


def _judged_once(target: Target, data: bytes) -> tuple[str | None, float]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        start_s = time.process_time()
        try:
            target.take(data)
        except ValueError as error:
            wrong = _wrong_with(str(error), error)
        except MemoryError as error:
            wrong = f"MemoryError {error}"
        except Exception as error:  # anything else has escaped
            wrong = f"{type(error).__name__} at {_where(error)}: {error}"[:300]
        else:
            wrong = None
        return wrong, time.process_time() - start_s


def _wrong_with(message: str, error: ValueError) -> str:
    """What is wrong with the text of a refusal; empty where it is one short line of ours."""
    if "\n" in message or re.search(r"[\x00-\x1f\x7f]", message):
        return f"a refusal of several lines at {_where(error)}: {message[:100]!r}"
    if len(message) > 1000:
        return f"a refusal of {len(message)} characters at {_where(error)}"
    if not type(error).__module__.startswith("dockpose.") and not _is_raised_by_us(error):
        return f"{type(error).__name__} from the depths at {_where(error)}: {message[:100]}"
    return ""


def _is_raised_by_us(error: ValueError) -> bool:
    """Whether a statement of ours raises it on purpose, and not what the statement calls or unpacks."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return _is_ours(last) and (last.line or "").startswith("raise ")


def _is_ours(frame: traceback.FrameSummary) -> bool:
    return "/app/" in frame.filename or "/pipeline/" in frame.filename


def _where(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if _is_ours(frame)]
    last = (ours or frames)[-1]
    return f"{Path(last.filename).name}:{last.lineno}"


def attack(name: str, inputs: int, seed: int, current: Path, found: Path) -> Outcome:
    """Draw so many inputs for a target; the one in hand is kept in ``current``, those that escape in ``found``."""
    target, outcome = TARGETS[name], Outcome()
    seeds = [*target.seeds(), *(path.read_bytes() for path in corpus_of(name))]
    rng = random.Random(f"{name} {seed}")
    for data in seeds[:3]:
        judge(target, data)
    before_mb = _peak_mb()
    for _ in range(inputs):
        data = mutated(rng, seeds)
        current.write_bytes(data)
        wrong, took_s = _judged(target, data)
        outcome.slowest_s = max(outcome.slowest_s, took_s)
        outcome.inputs += 1
        outcome.taken += wrong is None
        outcome.refused += wrong == ""
        if wrong:
            _keep(outcome, wrong, data, found / name.replace(" ", "_"))
    outcome.peak_mb = _peak_mb() - before_mb
    if outcome.peak_mb > MOST_MB:
        outcome.escapes[f"the memory grew by {outcome.peak_mb:.0f} MB"] = ""
    return outcome


def corpus_of(name: str) -> list[Path]:
    """Files of the inputs that were once found to go wrong for a target."""
    return sorted((CORPUS / name.replace(" ", "_")).glob("*"))


def _keep(outcome: Outcome, wrong: str, data: bytes, folder: Path) -> None:
    if wrong in outcome.escapes or len(outcome.escapes) >= 50:
        return
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / hashlib.sha256(data).hexdigest()[:12]
    path.write_bytes(data)
    outcome.escapes[wrong] = str(path)


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def total_of(outcomes: list[Outcome]) -> Outcome:
    """Several outcomes of one target as one."""
    total = Outcome()
    counts = Counter()
    for each in outcomes:
        counts.update({name: getattr(each, name) for name in ("inputs", "taken", "refused")})
        total.escapes |= each.escapes
        total.slowest_s, total.peak_mb = max(total.slowest_s, each.slowest_s), max(total.peak_mb, each.peak_mb)
    total.inputs, total.taken, total.refused = counts["inputs"], counts["taken"], counts["refused"]
    return total


def to_json(outcome: Outcome) -> str:
    """An outcome as a line."""
    return json.dumps(asdict(outcome))


def from_json(line: str) -> Outcome:
    """The outcome of a line."""
    return Outcome(**json.loads(line))
