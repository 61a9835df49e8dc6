import contextlib
import os
import struct
import sys
import threading
import time
from pathlib import Path

import pytest
from dockpose.app.processing import parallel
from dockpose.app.processing.parallel import workers


@pytest.mark.parametrize(("system", "processes"), [("win32", 61), ("linux", 64), ("darwin", 64)])
def test_windows_waits_for_no_more_processes_than_it_can(system, processes, monkeypatch):
    made = []

    class Pool:
        def __init__(self, jobs, **how):
            made.append(jobs)

        def shutdown(self, *words, **how):
            pass

    monkeypatch.setattr(parallel, "ProcessPoolExecutor", Pool)
    monkeypatch.setattr(parallel.sys, "platform", system)
    with workers(64):
        assert made == [processes]


def begin_a_result(sign):
    """Send the length of a result and its first byte, as where a worker is ended while it sends."""
    results = sys._getframe(1).f_locals["result_queue"]
    os.write(results._writer.fileno(), struct.pack("!i", 1000) + b"x")
    Path(sign).touch()
    time.sleep(600)


@pytest.mark.slow
def test_a_worker_that_is_ended_while_it_sends_holds_nobody_up(tmp_path):
    sign = tmp_path / "sent"

    def interrupted():
        with contextlib.suppress(KeyboardInterrupt), workers(1) as executor:
            executor.submit(begin_a_result, sign)
            while not sign.exists():
                time.sleep(0.01)
            raise KeyboardInterrupt

    thread = threading.Thread(target=interrupted, daemon=True)
    thread.start()
    thread.join(60)
    assert not thread.is_alive()
