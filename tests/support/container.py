"""The Dockerfile as instructions, where no Docker is."""

import json
import shlex
from dataclasses import dataclass
from pathlib import Path

DOCKERFILE = Path(__file__).resolve().parents[2] / "Dockerfile"


@dataclass(frozen=True)
class Instruction:
    """One instruction of a stage, counted from 0, and its text on one line."""

    stage: int
    name: str
    text: str

    @property
    def words(self) -> list[str]:
        """Its words, those of the JSON form included."""
        start = self.text.find("[")
        return json.loads(self.text[start:]) if start >= 0 else shlex.split(self.text)


def instructions() -> list[Instruction]:
    """All instructions, in order."""
    lines = [line for line in DOCKERFILE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    found, stage = [], -1
    for line in "\n".join(lines).replace("\\\n", " ").splitlines():
        name, _, text = line.strip().partition(" ")
        stage += name == "FROM"
        if name:
            found.append(Instruction(stage, name, " ".join(text.split()) if "[" not in text else text.strip()))
    return found


def of(name: str, stage: int) -> list[Instruction]:
    """The instructions of a name in a stage."""
    return [one for one in instructions() if (one.name, one.stage) == (name, stage)]


def environment(stage: int) -> dict[str, str]:
    """The variables that a stage sets."""
    return dict(word.split("=", 1) for one in of("ENV", stage) for word in one.words)
