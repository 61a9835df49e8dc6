"""``dockpose serve`` as a program of its own: its log and memory, and a browser beside it."""

import contextlib
import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

from tests.support.visitors import Visitor

PAGE = 2**20
_ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/\?token=\S+")


class Program:
    """A running page; it is ended with the context, at the latest after ``longest_s``."""

    def __init__(self, folder: Path, *arguments: str, longest_s: float = 600.0):
        self.folder = folder
        self.log, self.terminal = folder / "events.log", folder / "terminal.txt"
        command = [sys.executable, "-m", "dockpose.app.cli", "serve", "--port", "0", *arguments]
        command += ["--sessions", str(folder / "sessions"), "--log-file", str(self.log)]
        environment = os.environ | {"XDG_CONFIG_HOME": str(folder / "config"), "PYTHONUNBUFFERED": "1"}
        with self.terminal.open("wb") as errors:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors, env=environment
            )
        self._end = threading.Timer(longest_s, self.process.kill)
        self._end.daemon = True
        self._end.start()

    def __enter__(self):
        try:
            end_s = time.monotonic() + 60
            while len(found := _ADDRESS.findall(self.terminal.read_text())) < 1:
                assert self.process.poll() is None, self.terminal.read_text()
                assert time.monotonic() < end_s, "the page did not start"
                time.sleep(0.1)
            self.address = found[0]
            self.port = int(self.address.split(":")[2].split("/")[0])
            self.token = self.address.split("token=")[1]
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *error):
        self._end.cancel()
        self.process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(15)
        self.process.kill()
        self.process.wait()

    @property
    def memory_bytes(self) -> int:
        return int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def lines(self) -> list[str]:
        """All of its log so far."""
        return self.log.read_text().splitlines()


class Bystanders:
    """Two browsers: what one types, the other shows; how long that takes, again and again, in seconds.

    Where an attack types into the same box, ours is typed again; its time counts from the first.
    """

    def __init__(self, address: str, every_s: float = 0.1):
        self._one, self._other = Visitor(address), Visitor(address)
        for page in (self._one, self._other):
            assert page.until(lambda page: "Upload pictures" in page.buttons and page.is_replayed.is_set())
        self.took_s: list[float] = []
        self._every_s, self._is_over = every_s, threading.Event()
        self._thread = threading.Thread(target=self._type, daemon=True)
        self._thread.start()

    def close(self):
        self._is_over.set()
        self._thread.join(10)
        self._one.close()
        self._other.close()

    def slowest_s(self) -> float:
        """The slowest answer since this was asked last; at least one is waited for."""
        count = len(self.took_s)
        end_s = time.monotonic() + 15
        while len(self.took_s) == count and time.monotonic() < end_s:
            time.sleep(0.05)
        taken, self.took_s = self.took_s, []
        return max(taken, default=float("inf"))

    def _type(self):
        number = 0
        while not self._is_over.wait(self._every_s):
            number += 1
            began_s = time.monotonic()
            try:
                is_there = self._is_answered(f"note {number}")
            except Exception:  # it was closed: no answer ever
                self.took_s.append(float("inf"))
                return
            self.took_s.append(time.monotonic() - began_s if is_there else float("inf"))

    def _is_answered(self, text: str) -> bool:
        note, end_s = self._one.ids["Notes"], time.monotonic() + 10
        seen = self._other.values[note]
        self._one.set("Notes", text)
        while self._other.until(lambda page: page.values[note] != seen, end_s - time.monotonic()):  # noqa: B023
            seen = self._other.values[note]
            if seen == text:
                return True
            self._one.set("Notes", text)
        return False
