"""Pictures put together from packets: those alone of which nothing is missing."""

from typing import NamedTuple

from dockpose.sources.rtp.packets import Packet
from dockpose.sources.rtp.payload import Payload


class Whole(NamedTuple):
    """A picture whose packets all came, and all of those that it depends on."""

    data: bytes
    is_key: bool  # whether decoding can begin with it
    begins: bool  # whether it does, there being nothing before it, or not all
    sent_s: float  # by the sender's clock


class Assembly:
    """A picture is left out if a packet of it is lost, and those after it until the next that begins by itself.

    What a decoder makes up for lost packets looks like a picture, and has lights where they were before.
    """

    def __init__(self, payload: Payload) -> None:
        self._payload = payload
        self.left_out = 0
        self._ticks = 0
        self._before: int | None = None  # stamp of the packet before
        self._is_open = False
        # Nobody knows how many packets were before the first.
        self._needs_key, self._is_damaged = True, not payload.is_each_whole

    def take(self, packet: Packet, is_after_gap: bool) -> list[Whole]:
        """Take the next packet; returns what is whole with it."""
        whole: list[Whole] = []
        if self._is_open and packet.stamp != self._before:  # its last packet is lost, or is not marked as the last
            self._is_damaged |= is_after_gap
            whole += self._finished()
        self._is_damaged |= is_after_gap and not self._payload.is_each_whole  # which notices what is missing
        step = 0 if self._before is None else (packet.stamp - self._before + 2**31) % 2**32 - 2**31
        self._ticks, self._before, self._is_open = self._ticks + step, packet.stamp, True
        if not self._is_damaged:
            try:
                self._payload.add(packet.payload)
            except ValueError:
                self._is_damaged = True
        return whole + (self._finished() if packet.is_last else [])

    def spoil(self) -> None:
        """Begin anew with the next picture that begins by itself, since one could not be decoded."""
        self.left_out += 1
        self._needs_key = True

    def _finished(self) -> list[Whole]:
        """The picture that is open, if it is whole."""
        is_damaged, self._is_damaged, self._is_open = self._is_damaged, False, False
        try:
            data, is_key = (b"", False) if is_damaged else self._payload.finish()
        except ValueError:
            is_damaged, data, is_key = True, b"", False
        self._payload.begin()
        self._needs_key |= is_damaged
        if self._needs_key and not is_key:
            self.left_out += 1
            return []
        begins, self._needs_key = self._needs_key, False
        return [Whole(data, is_key, begins, self._ticks / self._payload.clock_hz)]
