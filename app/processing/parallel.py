"""Processes that share out what takes minutes, as a study."""

import contextlib
import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor

_MOST_ON_WINDOWS = 61  # processes, for which Python can wait there


@contextlib.contextmanager
def workers(jobs: int) -> Iterator[Executor]:
    """Yield an executor of ``jobs`` processes."""
    jobs = min(jobs, _MOST_ON_WINDOWS) if sys.platform == "win32" else jobs
    context = multiprocessing.get_context("spawn")  # a fork would copy locks that other threads hold
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_leave_interrupts)
    try:
        yield pool
    except BaseException:  # nobody waits for what they are at, which may take minutes
        # Or the pool would wait for the rest of a result that is cut off.
        pool._result_queue._writer.close()  # pyright: ignore[reportAttributeAccessIssue]
        for process in list(pool._processes.values()):
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _leave_interrupts() -> None:
    """Leave Ctrl-C, and what packages cannot be loaded, to the program that hands out the work, and end with it."""
    logging.getLogger("dockpose").addHandler(logging.NullHandler())
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := multiprocessing.parent_process()) is not None:
        threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
