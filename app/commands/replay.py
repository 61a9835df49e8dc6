"""``dockpose estimate --session FOLDER``: a session's frames estimated again, and what came out differently."""

import argparse
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, put, say
from dockpose.app.errors import UserError, blaming
from dockpose.app.experiment import Row, SessionRecord, read_session
from dockpose.app.resources import versions
from dockpose.camera.image import decode, read_picture_file

_OWN = ("camera", "dock_diameter", "lights", "method", "level", "min_area", "mask", "rate", "rotate", "dock", "vehicle")
_WRITTEN = ("json", "csv", "annotate", "out", "rerun", "record")
_MOST_NUMBERS = 4  # of a row that are listed one by one


def run_session(arguments: argparse.Namespace) -> int:
    """Run ``dockpose estimate --session``; returns the exit status. Raises UserError for what does not go with it."""
    if arguments.sources:
        raise UserError(f"--session {arguments.session} takes the place of SOURCE ({arguments.sources[0]}); give one")
    for name in (*_OWN, *_WRITTEN):
        value = getattr(arguments, name, None)
        if value not in (None, []) and (name, value) != ("rotate", 0):
            option = name.replace("_", "-")
            raise UserError(f"--{option} does not go with --session, which has each frame's own and writes nothing")
    return replay_session(arguments.session)


def replay_session(folder: Path) -> int:
    """Estimate every frame of a session with its own camera, dock and settings, and print what differs."""
    with blaming("--session "):
        record = read_session(folder)
    changed = unreadable = 0
    for row in record.rows:
        try:
            sentence = _replayed(record, row)
        except ValueError as error:
            unreadable += 1
            say(f"row {row.number}: {error}")
            continue
        if sentence:
            changed += 1
            put(f"row {row.number}: {sentence}")
    same = len(record.rows) - changed - unreadable
    rest = f", {changed} differ{'s' if changed == 1 else ''}" if changed else ""
    rest += f", {unreadable} cannot be read" if unreadable else ""
    put(f"{folder}: {same} of {len(record.rows)} rows give the same numbers{rest}.")
    return EXIT_SOME_UNREADABLE if unreadable else EXIT_ALL_READ


def _replayed(record: SessionRecord, row: Row) -> str:
    """Which numbers of a row differ and why; empty where none does."""
    from dockpose.app.processing.replay import (  # what the page is made of takes a while to import
        differences,
        estimate_again,
    )

    line = record.line(row)
    path = record.folder / row.file
    data = read_picture_file(path)
    name = str(path.with_suffix(".json"))
    try:
        found = differences(line, estimate_again(decode(data, str(path)), line))
    except ValueError as error:
        raise ValueError(str(error) if str(path) in str(error) else f"{name}: {error}") from error
    if not found:
        return ""
    told = [f"{name} {_short(stored)} is now {_short(new)}" for name, stored, new in found[:_MOST_NUMBERS]]
    if len(found) > _MOST_NUMBERS:
        told.append(f"and {len(found) - _MOST_NUMBERS} more")
    picture_changed = hashlib.sha256(data).hexdigest() != row.sha256
    return f"{', '.join(told)} ({why_different(line.get('program'), picture_changed)})"


def why_different(program: Any, picture_changed: bool) -> str:
    """What a difference comes from: the picture, or the versions that a frame's JSON names and those of today."""
    reasons = ["the picture's file was changed"] if picture_changed else []
    now = versions()
    before = program if isinstance(program, Mapping) else {}
    if not before:
        reasons.append("the versions that it was taken with are not known")
    reasons += [
        f"{name} was {before[name]}, is {now[name]}" for name in now if before.get(name, now[name]) != now[name]
    ]
    return (
        "; ".join(reasons)
        or "program, libraries and picture are the same: the frame's JSON was changed, or the "
        "processor rounds otherwise"
    )


def _short(value: Any) -> str:
    return repr(value) if isinstance(value, (int, float, str)) else "nothing" if value is None else "something else"
