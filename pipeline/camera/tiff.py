"""TIFF files page by page, each with its tags said so plainly that every reader gives the same pixels."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np

_HEADS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_MAX_PAGES, _MAX_TAGS = 100_000, 4096
# Struct's letters of the types that the tags below have (TIFF 6.0, section 2; BigTIFF adds those of 8 bytes).
_TYPES = {1: "B", 2: "s", 3: "H", 4: "I", 5: "II", 6: "b", 7: "s", 8: "h", 9: "i", 11: "f", 12: "d", 16: "Q", 18: "Q"}
_KIND, _WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC, _FILL_ORDER = 254, 256, 257, 258, 259, 262, 266
_STRIPS, _ORIENTATION, _SAMPLES, _ROWS, _STRIP_BYTES, _PLANAR = 273, 274, 277, 278, 279, 284
_TILES, _TILE_BYTES, _EXTRA, _FORMAT = 324, 325, 338, 339
# Of those that say how pixels are stored: T4Options, T6Options, Predictor, ColorMap, TileWidth, TileLength, JPEGTables,
# and YCbCr's three.
_STORED = (_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC, _FILL_ORDER, _SAMPLES, _ROWS, _EXTRA, _FORMAT)
_STORED += (292, 293, 317, 320, 322, 323, 347, 529, 530, 531, 532)
_WHITE_IS_0, _RGB, _SEPARATE, _ASSOCIATED, _UNASSOCIATED = 0, 2, 2, 1, 2
_NO_PICTURE = 1 | 4  # bits of the page's kind: a smaller version of another page, or its mask

Tags = dict[int, tuple[int, Any]]  # type, and numbers or bytes


def is_tiff(data: Any) -> bool:
    """Whether bytes begin like a TIFF."""
    return data[:4] in _HEADS


@dataclass(frozen=True)
class Page:
    """One picture of a TIFF: the file's bytes, or a map of them, in which order they are, and its tags."""

    data: Any
    order: str
    tags: Tags

    def number(self, tag: int, default: int) -> int:
        """First number of a tag."""
        values = self.tags.get(tag, (0, (default,)))[1]
        if not values or not isinstance(values[0], int):
            raise ValueError(f"tag {tag} of the TIFF is damaged")
        return values[0]

    @property
    def size(self) -> tuple[int, int, int]:
        """Width and height in pixels, and bytes of a decoded pixel: its colours, and its opacity."""
        sample_bytes = (self.number(_BITS, 1) + 7) // 8
        return self.number(_WIDTH, 0), self.number(_HEIGHT, 0), self.number(_SAMPLES, 1) * sample_bytes

    @property
    def orientation(self) -> int:
        """EXIF's number of how it lies, 1 for upright."""
        return self.number(_ORIENTATION, 1)

    def decoded(self, decode: Callable[[bytes], np.ndarray | None]) -> np.ndarray:
        """Its pixels, (H, W), (H, W, 3) BGR or (H, W, 4) BGRA; ``decode`` reads a file of one page. Or ValueError."""
        samples, bits, photometric = (self.number(tag, 1) for tag in (_SAMPLES, _BITS, _PHOTOMETRIC))
        is_inverted = photometric == _WHITE_IS_0 and bits >= 8
        if (is_inverted and bits not in (8, 16)) or (samples == 2):
            what = "grey with opacity" if samples == 2 else f"of {bits} bits with white as 0"
            raise ValueError(f"is a TIFF {what}, which is not read; save it as grey of 8 or 16 bits")
        plain = {tag: self.tags[tag] for tag in _STORED if tag in self.tags}
        if is_inverted:
            plain[_PHOTOMETRIC] = (3, (1,))
        if _EXTRA in plain:
            plain[_EXTRA] = (3, (_ASSOCIATED,) * len(plain[_EXTRA][1]))  # else libtiff applies it, to 8 bits alone
        chunks = self._chunks()
        if samples > 1 and self.number(_PLANAR, 1) == _SEPARATE:
            pixels = self._of_planes(plain, chunks, decode)
        else:
            pixels = _one(plain, chunks, self.order, decode)
        if is_inverted:
            pixels = np.iinfo(pixels.dtype).max - pixels
        opacity = self.number(_EXTRA, 0) if photometric == _RGB else 0
        if pixels.ndim == 3 and pixels.shape[2] == 4 and opacity != _UNASSOCIATED:
            pixels = np.ascontiguousarray(pixels[:, :, :3])  # on black already, or no opacity at all
        return pixels

    def _of_planes(self, plain: Tags, chunks: list[bytes], decode: Callable[[bytes], np.ndarray | None]) -> np.ndarray:
        """Pixels of a page that has each colour by itself, as a grey page of its own."""
        samples = self.number(_SAMPLES, 1)
        if self.number(_PHOTOMETRIC, 1) != _RGB or samples not in (3, 4) or len(chunks) % samples:
            raise ValueError("is a TIFF with separate planes that are not red, green and blue, which is not read")
        grey = {tag: value for tag, value in plain.items() if tag != _EXTRA}
        grey |= {_SAMPLES: (3, (1,)), _PHOTOMETRIC: (3, (1,))}
        for tag in (_BITS, _FORMAT):
            if tag in grey:
                grey[tag] = (3, grey[tag][1][:1])
        each = len(chunks) // samples
        planes = [_one(grey, chunks[i * each : (i + 1) * each], self.order, decode) for i in range(samples)]
        return np.dstack([planes[2], planes[1], planes[0], *planes[3:]])

    def _chunks(self) -> list[bytes]:
        """Its strips or tiles as they are stored."""
        places = self.tags.get(_TILES, self.tags.get(_STRIPS, (0, ())))[1]
        sizes = self.tags.get(_TILE_BYTES, self.tags.get(_STRIP_BYTES, (0, ())))[1]
        if not places or (sizes and len(sizes) < len(places)):
            raise ValueError("the TIFF's header is damaged: it does not say where its pixels are")
        whole = len(self.data)
        ends = [place + size for place, size in zip(places, sizes or [whole] * len(places), strict=False)]
        if max(places) >= whole or (sizes and max(ends) > whole):
            raise ValueError(f"the picture is cut short ({whole} bytes of {max(*ends, *places)})")
        return [bytes(self.data[place:end]) for place, end in zip(places, ends, strict=False)]


def pages(data: Any) -> list[Page]:
    """Pages of a TIFF or BigTIFF, but for smaller versions and masks; ValueError where its header is damaged."""
    found: list[Page] = []
    try:
        order = "<" if data[:2] == b"II" else ">"
        is_big, seen = struct.unpack(f"{order}H", data[2:4])[0] == 43, set[int]()
        (place,) = struct.unpack(f"{order}Q", data[8:16]) if is_big else struct.unpack(f"{order}I", data[4:8])
        while place and place not in seen and len(seen) < _MAX_PAGES:
            seen.add(place)
            tags, place = _directory(data, order, place, is_big)
            found.append(Page(data, order, tags))
    except struct.error as error:
        if not found:
            raise ValueError(f"the TIFF's header is damaged or cut short ({len(data)} bytes)") from error
    if not found:
        raise ValueError("the TIFF has no picture in it")
    return [page for page in found if not page.number(_KIND, 0) & _NO_PICTURE] or found[:1]


def _directory(data: Any, order: str, place: int, is_big: bool) -> tuple[Tags, int]:
    """Tags of a page, and where the next one's are; 0 after the last."""
    head, entry, number = ("Q", 20, "Q") if is_big else ("H", 12, "I")
    start, word = place + struct.calcsize(f"={head}"), struct.calcsize(f"={number}")
    (count,) = struct.unpack(f"{order}{head}", data[place:start])
    if count > _MAX_TAGS:
        raise struct.error
    tags: Tags = {}
    for at in range(start, start + entry * count, entry):
        tag, kind, length = struct.unpack(f"{order}HH{number}", data[at : at + 4 + word])
        letter = _TYPES.get(kind)
        if letter is None or tag not in (*_STORED, _KIND, _STRIPS, _STRIP_BYTES, _TILES, _TILE_BYTES, _PLANAR, 274):
            continue
        size = struct.calcsize(f"={letter}") * length
        if size > len(data):
            raise struct.error
        value = at + 4 + word
        if size > word:
            (value,) = struct.unpack(f"{order}{number}", data[value : value + word])
        form = f"{length}s" if letter == "s" else f"{length * len(letter)}{letter[0]}"
        tags[tag] = (kind, struct.unpack(f"{order}{form}", data[value : value + size]))
    after = start + entry * count
    (following,) = struct.unpack(f"{order}{number}", data[after : after + word])
    return tags, following


def _one(tags: Tags, chunks: Sequence[bytes], order: str, decode: Callable[[bytes], np.ndarray | None]) -> np.ndarray:
    """Pixels of a TIFF of one page that is put together from tags and strips or tiles."""
    is_tiled = 322 in tags
    filled = [chunk + bytes(len(chunk) % 2) for chunk in chunks]
    *places, at = accumulate(map(len, filled), initial=8)
    tags = tags | {
        _TILES if is_tiled else _STRIPS: (4, tuple(places)),
        _TILE_BYTES if is_tiled else _STRIP_BYTES: (4, tuple(map(len, chunks))),
    }
    entries, beyond = b"", b""
    behind = at + 2 + 12 * len(tags) + 4
    for tag, (kind, values) in sorted(tags.items()):
        kind = 4 if kind in (16, 18) else kind
        letter = _TYPES[kind]
        form = f"{len(values[0])}s" if letter == "s" else f"{len(values)}{letter[0]}"
        value = struct.pack(f"{order}{form}", *values)
        count = len(values[0]) if letter == "s" else len(values) // len(letter)
        if len(value) > 4:
            place = struct.pack(f"{order}I", behind + len(beyond))
            value, beyond = place, beyond + value + bytes(len(value) % 2)
        entries += struct.pack(f"{order}HHI", tag, kind, count) + value.ljust(4, b"\0")
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}I", at)
    pixels = decode(head + b"".join(filled) + struct.pack(f"{order}H", len(tags)) + entries + bytes(4) + beyond)
    if pixels is None:
        raise ValueError("the picture is damaged or cut short, or of a kind of TIFF that is not read")
    return pixels
