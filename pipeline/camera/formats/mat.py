"""MAT files of version 5 (MathWorks, "MAT-File Format"): SciPy's reader takes the process down where one is damaged."""

import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

_MATRIX, _COMPRESSED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TYPES |= {16: "u1", 17: "u2"}  # letters
_CELL, _STRUCT, _CHAR, _NUMBERS = 1, 2, 4, range(6, 16)
_EXPANDED_BYTES, _MOST_LEVELS = 20_000_000, 20


def mat_content(data: bytes) -> dict[str, Any]:
    """The variables of a MAT file by name, structs as mappings, arrays as lists; ValueError where it has none."""
    found: dict[str, Any] = {}
    order, left = ("<" if data[126:128] == b"IM" else ">"), _EXPANDED_BYTES
    try:
        for kind, content in _elements(memoryview(data)[128:], order):
            if kind == _COMPRESSED:
                expanded = zlib.decompressobj().decompress(content, left)
                left -= len(expanded)
                kind, content = next(_elements(memoryview(expanded), order), (0, memoryview(b"")))
            if kind == _MATRIX and left > 0:
                name, value = _matrix(content, order, _MOST_LEVELS)
                found[name] = value
    except (zlib.error, struct.error, ValueError, LookupError, OverflowError, TypeError):
        pass  # what came before may do
    if not found:
        raise ValueError("is a MAT file without a variable that can be read; save a struct, as of toStruct, with -v7")
    return found


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and content of each element in a row of them."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, at)
        if kind >> 16:  # up to four bytes stand in the head itself
            yield kind & 0xFFFF, data[at + 4 : at + 4 + min(4, kind >> 16)]
            at += 8
        else:
            yield kind, data[at + 8 : at + 8 + size]
            at += 8 + size + (0 if kind == _COMPRESSED else -size % 8)


def _array(element: tuple[int, memoryview], order: str) -> np.ndarray:
    return np.frombuffer(element[1], order + _TYPES[element[0]])


def _matrix(data: memoryview, order: str, levels: int) -> tuple[str, Any]:
    """Name and value of an array of any class; None for objects and what else is not read."""
    parts = list(_elements(data, order))
    if not parts or levels == 0:  # an empty array of a struct
        return "", None
    kind, shape, name = _array(parts[0], order)[0] & 0xFF, _array(parts[1], order), bytes(parts[2][1]).decode("latin-1")
    if kind == _CHAR:
        return name, "".join(map(chr, _array(parts[3], order).tolist()))
    if kind == _CELL:
        return name, [_matrix(each, order, levels - 1)[1] for _, each in parts[3:]]
    if kind == _STRUCT:
        length = int(_array(parts[3], order)[0])
        text = bytes(parts[4][1]).decode("latin-1")
        keys = [text[at : at + length].split("\0")[0] for at in range(0, len(text), max(1, length))]
        values = [_matrix(each, order, levels - 1)[1] for _, each in parts[5:]]
        rows = [dict(zip(keys, values[at:], strict=False)) for at in range(0, len(values), max(1, len(keys)))]
        return name, rows[0] if len(rows) == 1 else rows
    if kind not in _NUMBERS:
        return name, None
    return name, _array(parts[3], order).reshape(shape, order="F").squeeze().tolist()
