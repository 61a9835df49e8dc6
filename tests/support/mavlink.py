"""A receiver of MAVLink in another process, which tells each message as JSON, and may speak as an autopilot."""

import contextlib
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

from tests.support.layout import ROOT


class Received:
    """The messages of a receiver, as they come."""

    def __init__(self, process: subprocess.Popen[str], port: int) -> None:
        self._process, self.port = process, port
        self.address = f"udpout:127.0.0.1:{port}"

    def next(self, *kinds: str) -> dict[str, Any]:
        """Wait for the next message of these kinds; of any where none is named."""
        assert self._process.stdout is not None
        while line := self._process.stdout.readline():
            message = json.loads(line)
            if not kinds or message["mavpackettype"] in kinds:
                return message
        raise AssertionError("the receiver ended")


@contextlib.contextmanager
def receiving(*attitude: float) -> Iterator[Received]:
    """A receiver; with a roll and a pitch it is an ArduPilot, whose heartbeat and ATTITUDE come ten times a second."""
    command = [sys.executable, "-m", "tests.support.mavlink", *map(str, attitude)]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield Received(process, int(process.stdout.readline()))
    finally:
        process.kill()
        process.communicate()


def main() -> None:
    import os

    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil  # pyright: ignore[reportMissingImports]

    link: Any = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="ardupilotmega")
    print(link.port.getsockname()[1], flush=True)
    has_asked, attitude, due_s = False, [float(word) for word in sys.argv[1:]], 0.0
    while True:
        message = link.recv_match(blocking=True, timeout=0.1 if attitude else None)
        if attitude and has_asked and time.monotonic() > due_s:
            due_s = time.monotonic() + 0.1
            link.mav.srcSystem = link.mav.srcComponent = 1
            link.mav.heartbeat_send(12, 3, 0, 0, 4)
            link.mav.attitude_send(0, *attitude, 0.0, 0.0, 0.0, 0.0)
        if message is None:
            continue
        if not has_asked:
            link.mav.timesync_send(0, 1234567890)
            has_asked = True
        about = {"at_s": time.time(), "system": message.get_srcSystem(), "component": message.get_srcComponent()}
        print(json.dumps(message.to_dict() | about), flush=True)


if __name__ == "__main__":
    main()
