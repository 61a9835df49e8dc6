"""Inputs drawn at random: seeds with bytes changed, cut, repeated and put together, and words of files."""

import random
import struct
from collections.abc import Sequence

# Numbers and words at which readers go wrong; those of YAML and JSON among them.
WORDS = (
    *(b"0", b"-1", b"1e308", b"-1e308", b"1e-308", b"nan", b".nan", b"inf", b"-.inf", b"null", b"~", b"true", b"''"),
    *(b"99999999999999999999", b"1" * 5000, b"9" * 23, b"0x7fffffff", b"4294967296", b"-0.0", b"2026-02-30", b"1:2:3"),
    *(b"[]", b"{}", b"[[", b"{{", b"&a", b"*a", b"<<: *a", b"!!int ", b"!!bool x", b"!!binary x", b"!!set", b"? "),
    *(b"\n", b"\r\n", b"\t", b"\x00", b"\xff\xfe", b"\xed\xa0\x80", b"\x1b[31m", b'"', b"'", b"\\", b"- ", b": ", b"#"),
    *(b"[" * 500, b"{a: " * 200, b"a: " * 50, b",", b"%YAML:1.0\n", b"---\n", b"\xe2\x80\xae", b"../", b"/dev/zero"),
)
_SIZES = (0, 1, 255, 256, 65535, 65536, 2**24, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1)
_LARGEST = 60_000  # bytes; larger inputs are drawn too seldom to matter


def mutated(rng: random.Random, seeds: Sequence[bytes]) -> bytes:
    """Return one of the seeds with one to a few changes, or now and then none of its bytes."""
    if rng.random() < 0.01:
        return rng.randbytes(rng.choice((0, 1, 7, 100, 3000)))
    data = bytearray(rng.choice(seeds))
    for _ in range(1 + int(rng.expovariate(0.5))):
        rng.choice(_CHANGES)(rng, data, seeds)
    return bytes(data[:_LARGEST])


def _at(rng: random.Random, data: bytearray) -> int:
    # Heads matter most.
    return min(int(rng.random() ** rng.choice((1, 3)) * (len(data) + 1)), len(data))


def _flip(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    if data:
        data[min(_at(rng, data), len(data) - 1)] ^= 1 << rng.randrange(8)


def _set(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    if data:
        data[min(_at(rng, data), len(data) - 1)] = rng.choice((0, 255, 127, 128, rng.randrange(256)))


def _number(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    start, width = _at(rng, data), rng.choice((1, 2, 4, 8))
    value = rng.choice(_SIZES) & (2 ** (8 * width) - 1)
    data[start : start + width] = struct.pack(rng.choice("<>") + "BHIQ"[(1, 2, 4, 8).index(width)], value)


def _word(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    start = _at(rng, data)
    data[start : start + rng.choice((0, 0, 1, 4))] = rng.choice(WORDS)


def _value(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    """Put a word in the place of what stands after a colon, a comma or a bracket."""
    places = [place for place, byte in enumerate(data[:20_000]) if byte in b":,["]
    if places:
        start = rng.choice(places) + 1
        end = next((place for place in range(start, len(data)) if data[place] in b",\n]}"), len(data))
        data[start:end] = b" " + rng.choice(WORDS)


def _cut(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    start = _at(rng, data)
    del data[start : start + rng.choice((1, 2, 8, 100, len(data)))]


def _repeat(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    start, length = _at(rng, data), rng.choice((1, 4, 30, 300))
    data[start:start] = data[start : start + length] * rng.choice((1, 2, 20))


def _splice(rng: random.Random, data: bytearray, seeds: Sequence[bytes]) -> None:
    other = rng.choice(seeds)
    start, theirs = _at(rng, data), rng.randrange(len(other) + 1)
    data[start:] = other[theirs:]


_CHANGES = (_flip, _flip, _set, _number, _word, _value, _value, _cut, _repeat, _splice)
