"""Kill programs that take frames at random moments, and count what is lost."""

import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from tests.support.forked import forked
from tests.support.taking import faults, take_until_killed

PER_SESSION = 10  # kills, after which a new session is begun, so that its making is interrupted too


@dataclass
class Kills:
    """What came of killing: counts, and which confirmed rows and files were lost."""

    kills: int = 0
    confirmed: int = 0
    lost: int = 0
    unreadable: int = 0
    while_writing: int = 0


def kill_often(folder: Path, kills: int, seed: int, longest_s: float = 0.2) -> Kills:
    """Start a program and kill it within so many seconds, again and again on the same few sessions."""
    context = forked()
    rng, told = np.random.default_rng(seed), Kills()
    confirmed: set[int] = set()
    for number in range(kills):
        session = folder / f"session {number // PER_SESSION}"
        if number % PER_SESSION == 0:
            confirmed = set()
        ours, theirs = context.Pipe(duplex=False)
        program = context.Process(target=take_until_killed, args=(str(session), theirs), daemon=True)
        program.start()
        theirs.close()
        assert ours.recv_bytes() == b"0"  # kills are to fall on its work, not on its start
        time.sleep(rng.uniform(0, longest_s))
        program.kill()
        program.join()
        confirmed |= _received(ours)
        told.while_writing += any(session.rglob("*.part"))
        lost, unreadable = faults(session, confirmed)
        told.kills += 1
        told.lost += len(lost)
        told.unreadable += len(unreadable)
        if number % PER_SESSION == PER_SESSION - 1 or number == kills - 1:
            told.confirmed += len(confirmed)
    return told


def _received(connection: Connection) -> set[int]:
    numbers = set()
    with connection:
        try:
            while True:
                numbers.add(int(connection.recv_bytes()))
        except EOFError:
            return numbers
