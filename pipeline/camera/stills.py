"""What files of stills say that OpenCV leaves out; and what else a file is, by its first bytes."""

import re

import numpy as np
from dockpose.text import ARCHIVES, ELSEWHERE, kind_in_words

# Other programs' files by their first bytes: what to convert, and what else there is.
_RAW = "a raw picture of a camera"
_CONVERTED = {
    f"{_RAW} (ORF, Olympus)": (b"IIRO", b"IIRS", b"MMOR"),
    f"{_RAW} (RW2, Panasonic)": (b"IIU\0",),
    f"{_RAW} (RAF, Fujifilm)": (b"FUJIFILMCCD-RAW",),
    f"{_RAW} (CR3, Canon)": (b"ftypcrx ",),
    "a HEIC picture": (b"ftyphei", b"ftyphev", b"ftypmif1", b"ftypmsf1"),
    "an AVIF picture": (b"ftypavi",),
    "a JPEG 2000 picture": (b"\0\0\0\x0cjP  ", b"\xff\x4f\xff\x51"),
    "a JPEG XL picture": (b"\0\0\0\x0cJXL ", b"\xff\x0a"),
    "an SVG drawing": (b"<svg",),
    "a PDF document": (b"%PDF",),
    "a NumPy array": (b"\x93NUMPY",),
    "an HDF5 file": (b"\x89HDF",),
}
_PCAP = (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\x0a\x0d\x0d\x0a")
_TLOG = "a log of telemetry (MAVLink's tlog), which has no pictures; open the camera's recording"
_OTHERS = {
    "an archive; unpack it": (b"PK\3\4", *ARCHIVES),
    "the log of a bag; open the .db3 beside it": (b"\x37\x7f\x06\x82", b"\x37\x7f\x06\x83"),
    "a playlist; open a file or an address that it names": (b"#EXTM3U",),
    "a capture of packets (pcap); open the stream, or a video of it": _PCAP,
    "a log of PX4 (ULog), which has no pictures; open the camera's recording": (b"ULog\x01",),
    _TLOG: (),
    "a video or a sound, which is opened by itself": (b"ftyp", b"\x1aE\xdf\xa3"),
}
_TGA_KINDS, _TGA_BITS = (1, 2, 3, 9, 10, 11), (8, 15, 16, 24, 32)
_JPEG, _ADDED = b"\xff\xd8\xff", b"\xe0\xe1\xe2\xe3\xe4\xe5\xe6\xe7\xe8\xe9\xea\xeb\xec\xed\xef\xfe"
_MARKER = re.compile(rb"\xff([^\0\xd0-\xd7\xff])")  # of a segment of JPEG, none of which is within pixels
_SIZE = re.compile(rb"(?s)\xff[\xc0-\xc3\xc5-\xc7\xc9-\xcb].{3}(.{4})")  # the head of a JPEG's pixels
_TRANSPARENT = b"tRNS"  # a PNG's chunk that names the transparent grey level or colour
_PNM = re.compile(rb"P([2356])" + 3 * rb"(?:\s|#[^\n]*\n)+(\d+)")  # kind, width, height and white
_PNM_BITS = (8, 10, 12, 14, 16)


def name_of(data: bytes) -> str:
    """What a file is by its content, and what to do with it, to follow "is"; empty where it is not known."""
    head = data[4:] if data[4:8] == b"ftyp" else data  # ISO 14496-12: a box's length, its kind, and the file's brand
    if kind := kind_in_words(data, ELSEWHERE):
        return kind
    names = (name for name, starts in (_CONVERTED | _OTHERS).items() if head.startswith(starts))
    name = next(names, "") or _without_start(data)
    return name if not name or name in _OTHERS else f"{name}; convert it to PNG or TIFF"


def _without_start(data: bytes) -> str:
    """Name of a format that does not begin with bytes of its own."""
    if data[:1] == b"\0" and data[1:2] in b"\5\6\7" and data[8:9] in (b"\xfd", b"\xfe"):  # microseconds, and a packet
        return _TLOG
    if data[128:132] == b"DICM":
        return "a DICOM picture"
    if data.startswith(b"<?xml") and b"<svg" in data[:4096]:
        return "an SVG drawing"
    is_tga = len(data) > 18 and data[2] in _TGA_KINDS and data[1] == (data[2] in (1, 9)) and data[16] in _TGA_BITS
    return "a TGA picture" if is_tga and b"\0\0" not in (data[12:14], data[14:16]) else ""


def is_many(data: bytes, pixel_bytes: int) -> bool:
    """Whether another picture of its kind follows in a file, as programs write them to a pipe; a preview is none."""
    header = _PNM.match(data)
    plain, end = _bare_jpeg(data) if data.startswith(_JPEG) else (b"", _end_of_others(data))
    end = header.end() + 1 + pixel_bytes if header else end
    rest = data[end:].lstrip(b"\0")
    if not plain:
        return end != 0 and rest[:2] == data[:2]
    return rest.startswith(_JPEG) and b"MPF\0" not in data[:end] and _SIZE.findall(plain)[:1] == _SIZE.findall(rest)[:1]


def as_meant(image: np.ndarray, data: bytes) -> np.ndarray:
    """What a file means by the levels (H, W, ...) that OpenCV gives: a PNM's white, a PNG's transparent grey."""
    if header := _PNM.match(data):
        return _of_pnm(image, int(header[4]), header[1])
    if data.startswith(b"\x89PNG") and data[25] in (0, 2) and _TRANSPARENT in data[: data.find(b"IDAT")]:
        return _with_transparent_black(image, data)
    return image


def _of_pnm(image: np.ndarray, white: int, kind: bytes) -> np.ndarray:
    """A PNM's levels on a scale of whole bits."""
    top = (1 << next(bits for bits in _PNM_BITS if white < 1 << bits)) - 1
    if white == top or (top == 255 and kind in b"23"):  # words, which OpenCV scales
        return image
    levels = np.arange(np.iinfo(image.dtype).max + 1)
    return np.rint(np.minimum(levels, white) * (top / white)).astype(image.dtype)[image]


def _with_transparent_black(image: np.ndarray, data: bytes) -> np.ndarray:
    """A PNG's grey levels (H, W) or colours, of which one is transparent, for which OpenCV looks in colours alone."""
    at = data.index(_TRANSPARENT) + len(_TRANSPARENT)
    bits, count = data[24], 3 if data[25] == 2 else 1
    level = np.frombuffer(data[at : at + 2 * count], ">u2")[::-1] * (255 // ((1 << bits) - 1) if bits < 8 else 1)
    seen = np.atleast_3d(image)[:, :, :count]
    image[(seen == level).all(axis=2)] = 0
    return image


def is_cut_short(data: bytes) -> bool:
    """Whether a PNG or JPEG file lacks its end, or pixels before it, of which OpenCV gives out what there is."""
    if not data.startswith(_JPEG):
        return _end_of_others(data) < 0
    plain, end = _bare_jpeg(data)
    if end < 0:
        return True
    import av  # takes longer than a picture
    from av.error import FFmpegError, InvalidDataError

    context = av.CodecContext.create("mjpeg", "r")
    context.options = {"err_detect": "explode"}
    try:
        context.decode(av.Packet(plain))
    except FFmpegError as error:  # another one tells of a kind of JPEG that FFmpeg does not know
        return isinstance(error, InvalidDataError)
    return False


def _end_of_others(data: bytes) -> int:
    """Where a PNG, BMP or WebP ends; -1 where it does not, and 0 of others."""
    if data.startswith((b"BM", b"RIFF")):
        return int.from_bytes(data[2:6], "little") if data[:1] == b"B" else int.from_bytes(data[4:8], "little") + 8
    start = 8 if data.startswith(b"\x89PNG") else len(data)
    while (kind := data[start + 4 : start + 8]) not in (b"", b"IEND"):
        start += 12 + int.from_bytes(data[start : start + 4], "big")
    return start + 12 if kind else -1 if data.startswith(b"\x89PNG") else 0


def _bare_jpeg(data: bytes) -> tuple[bytes, int]:
    """A JPEG without what programs add (APP0 to 13 and 15, and comments), and where it ends; -1 where it does not."""
    kept, at = [data[:2]], 2
    while found := _MARKER.search(data, at):
        kept.append(data[at : found.start()])
        if found[0] == b"\xff\xd9":
            return b"".join([*kept, found[0]]), found.end()
        at = found.end() + int.from_bytes(data[found.end() : found.end() + 2], "big")
        kept += [] if found[1] in _ADDED else [data[found.start() : at]]
    return b"", -1
