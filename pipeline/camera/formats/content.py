"""What a camera file holds as plain Python values, be it YAML, JSON, XML, text, NumPy's or MATLAB's."""

import contextlib
import io
import json
import re
import zipfile
from typing import Any
from xml.etree import ElementTree

import numpy as np
from dockpose.camera.formats.mat import mat_content
from dockpose.files import MOST_BYTES, FileError, parse_yaml

LARGEST_BYTES = 5_000_000  # of a file that is not YAML; MATLAB and calib.io keep every corner beside the camera
_EXPANDED_BYTES = 50_000_000
_NUMBER = r"[-+.\deE]+"
_COLMAP_LINE = re.compile(rf"^[ \t]*(\d+)[ \t]+([A-Z_]+)((?:[ \t]+{_NUMBER})+)[ \t]*\r?$", re.MULTILINE)
_OST_ENTRY = re.compile(rf"^(width|height|camera matrix|distortion)\s*\n((?:{_NUMBER}[ \r\n]+)+)", re.MULTILINE)


def content_of(data: bytes, name: str) -> Any:
    """What a file holds; FileError, about ``name``, where it is nothing that is read."""
    try:
        if data.startswith(b"PK\x03\x04"):
            return _npz(data)
        if data.startswith(b"MATLAB"):
            return mat_content(data)
        if data.lstrip(b"\xef\xbb\xbf \r\n\t").startswith(b"<"):
            return _xml(data)
        if data.lstrip()[:1] in (b"{", b"["):
            with contextlib.suppress(ValueError):  # what is no JSON may be YAML
                return json.loads(data)
    except RecursionError as error:
        raise FileError(f"{name}: is nested too deeply") from error
    except ValueError as error:
        raise FileError(f"{name}: {error}") from error
    if len(data) > MOST_BYTES:
        raise FileError(f"{name}: has more than the {MOST_BYTES / 1e6:g} MB that are read")
    text = data.decode("utf-8", "replace")
    if lines := _COLMAP_LINE.findall(text):
        return {number: {"colmap": model, "numbers": rest.split()} for number, model, rest in lines}
    if "[image]" in text:  # what ROS's calibrator writes beside its YAML
        return dict(_OST_ENTRY.findall(f"{text}\n"))
    return parse_yaml(_first_document(data), name)


def _first_document(data: bytes) -> bytes:
    """The first of several YAML documents: ROS's echo ends each with a line of dashes, before which others begin."""
    parts = re.split(rb"^---[ \t]*\r?$", data, maxsplit=2, flags=re.MULTILINE)
    is_head = all(line.strip()[:1] in (b"", b"#", b"%") for line in parts[0].splitlines())
    if is_head and len(parts) > 1:
        return b"\n" * parts[0].count(b"\n") + parts[1]  # so that errors name the line
    return parts[0]


def _npz(data: bytes) -> dict[str, Any]:
    found = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(each.file_size for each in archive.infolist()) > _EXPANDED_BYTES:
                raise ValueError(f"expands to more than {_EXPANDED_BYTES / 1e6:g} MB")
            for each in archive.infolist():
                with contextlib.suppress(ValueError):  # Python's objects are not read
                    array = np.load(io.BytesIO(archive.read(each)), allow_pickle=False)
                    found[each.filename.removesuffix(".npy")] = array.tolist()
    except Exception as error:  # which errors damaged archives raise is not documented
        raise ValueError(f"is a damaged archive of NumPy ({error})") from error
    return found


def _xml(data: bytes) -> dict[str, Any]:
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ValueError("is XML that defines entities, which are not read")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise ValueError(f"is not valid XML ({error})") from error
    if root.tag == "opencv_storage":
        return {each.tag: _opencv_value(each) for each in root}
    found = [each for each in root.iter("calibration") if each.find("f") is not None or each.find("fx") is not None]
    found = [each for each in found if each.get("class") == "adjusted"] or found
    return {f"sensor{number}": _agisoft_values(each) for number, each in enumerate(found)}


def _opencv_value(element: ElementTree.Element) -> Any:
    inner = {each.tag: (each.text or "").strip() for each in element}
    return inner | {"data": inner["data"].split()} if "data" in inner else inner or (element.text or "").strip()


def _agisoft_values(element: ElementTree.Element) -> dict[str, Any]:
    found: dict[str, Any] = {"agisoft": True, "projection": element.get("type", "frame")}
    for each in element:
        found |= dict(each.attrib) if each.tag == "resolution" else {each.tag: each.text}
    return found
