"""A receiver of MAVLink in another process, which tells each message as JSON, and asks for the time if told to."""

import contextlib
import json
import subprocess
import sys
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
def receiving() -> Iterator[Received]:
    command = [sys.executable, "-m", "tests.support.mavlink"]
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
    has_asked = False
    while True:
        message = link.recv_match(blocking=True)
        if message is None:
            continue
        if not has_asked:
            link.mav.timesync_send(0, 1234567890)
            has_asked = True
        about = {"system": message.get_srcSystem(), "component": message.get_srcComponent()}
        print(json.dumps(message.to_dict() | about), flush=True)


if __name__ == "__main__":
    main()
