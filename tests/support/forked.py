"""Processes that have the program imported when they begin."""

import multiprocessing
import os
import signal
import sys
from dataclasses import dataclass
from multiprocessing import forkserver
from pathlib import Path
from unittest.mock import patch

# Threads are not there any more in a process that was forked, which would wait for them.
_ONE_THREAD = dict.fromkeys(("OPENCV_FOR_THREADS_NUM", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
_IMPORTED = ["dockpose.app.commands.estimate", "tests.support.taking", __name__]


def forked():
    """What makes such processes: all tests of one process share the server that they are forked from."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_IMPORTED)
    with patch.dict(os.environ, _ONE_THREAD):
        forkserver.ensure_running()
    return context


@dataclass(frozen=True)
class Done:
    """How a command ended, and what it wrote to standard error."""

    returncode: int | None
    stderr: str


def run_on_full_disk(limit_bytes: int, folder: Path, *words: str) -> Done:
    """Run a command of the program where no file may grow beyond some bytes, as on a disk that fills up."""
    context = forked()
    ours, theirs = context.Pipe(duplex=False)
    program = context.Process(target=_run, args=(limit_bytes, str(folder), words, theirs))
    program.start()
    theirs.close()
    with ours, open(ours.fileno(), encoding="utf-8", closefd=False) as said:
        told = said.read()
    program.join(120)
    return Done(program.exitcode, told)


def _run(limit_bytes: int, folder: str, words: tuple[str, ...], connection) -> None:
    import resource  # not on each system

    from dockpose.app.cli import _loaded, main

    _loaded(words[0])  # the disk fills while it works, not while it is loaded
    os.chdir(folder)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(connection.fileno(), 2)
    connection.close()
    sys.stdout, sys.stderr = (open(standard, "w", closefd=False) for standard in (1, 2))  # noqa: SIM115
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes))
    raise SystemExit(main(list(words)))
