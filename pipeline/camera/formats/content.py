"""What a camera file holds as plain Python values, be it YAML, JSON, XML, TOML, text, NumPy's or MATLAB's."""

import configparser
import contextlib
import io
import json
import re
import tomllib
import zipfile
from typing import Any
from xml.etree import ElementTree

import numpy as np
from dockpose.camera.formats.fields import numbers_in
from dockpose.camera.formats.mat import mat_content
from dockpose.camera.formats.words import READ, foreign
from dockpose.files import MOST_BYTES, FileError, NotYamlError, PlainTextError, parse_yaml

LARGEST_BYTES = 5_000_000  # of a file that is not YAML; MATLAB and calib.io keep every corner beside the camera
_EXPANDED_BYTES = 50_000_000
_NUMBER = r"[-+.\deE]+"
_COLMAP_LINE = re.compile(rf"^[ \t]*(\d+)[ \t]+([A-Z_]+)((?:[ \t]+{_NUMBER})+)[ \t]*\r?$", re.MULTILINE)
_OST_ENTRY = re.compile(rf"^(width|height|camera matrix|distortion)\s*\n((?:{_NUMBER}[ \r\n]+)+)", re.MULTILINE)
_ASSIGNED = re.compile(r"^(\w+)[ \t]*=[ \t]*\[?([-+.\deE \t;,]+)\]?[ \t]*;", re.MULTILINE)
_ZED = {"2K": (2208, 1242), "FHD": (1920, 1080), "HD": (1280, 720), "VGA": (672, 376)}
_ZED |= {"FHD1200": (1920, 1200), "SVGA": (960, 600), "4K": (3840, 2160), "QHDPLUS": (3200, 1800)}


def content_of(data: bytes, name: str) -> Any:
    """What a file holds; FileError, about ``name``, where it is nothing that is read."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):  # what PowerShell writes
        data = data.decode("utf-16", "replace").encode()
    if told := foreign(data):
        raise FileError(f"{name}: {told}")
    if len(data) > LARGEST_BYTES:
        raise FileError(f"{name}: has more than the {LARGEST_BYTES / 1e6:g} MB that are read")
    no_json = ""
    try:
        if data.startswith(b"PK\x03\x04"):
            return _npz(data)
        if data.startswith(b"MATLAB"):
            return mat_content(data)
        if data.lstrip(b"\xef\xbb\xbf \r\n\t").startswith(b"<"):
            return _xml(data)
        if data.lstrip()[:1] in (b"{", b"["):
            try:
                return json.loads(data)
            except ValueError as error:  # what is no JSON may be YAML
                no_json = f"is not valid JSON ({error})"
    except RecursionError as error:
        raise FileError(f"{name}: is nested too deeply") from error
    except ValueError as error:
        raise FileError(f"{name}: {error}") from error
    if len(data) > MOST_BYTES:
        raise FileError(f"{name}: has more than the {MOST_BYTES / 1e6:g} MB that are read")
    text = data.decode("utf-8", "replace")
    if lines := _COLMAP_LINE.findall(text):
        return {number: {"colmap": model, "numbers": rest.split()} for number, model, rest in lines}
    if rows := re.findall(r"^(cam\d)=\[([-+.\deE ;]+)\]", text, re.MULTILINE):  # of Middlebury's data sets
        size = dict(re.findall(r"^(width|height)=(\d+)", text, re.MULTILINE))
        return {name: {"camera_matrix": row.replace(";", " "), **size} for name, row in rows}
    if "[image]" in text:  # what ROS's calibrator writes beside its YAML
        return _ost(f"{text}\n")
    given = {key: value.replace(";", " ").split() for key, value in _ASSIGNED.findall(text)}
    if {"fc", "cc"} <= given.keys():
        return given  # Calib_Results.m
    if re.search(r"^[ \t]*[\w.\"-]+[ \t]*=", text, re.MULTILINE):
        with contextlib.suppress(ValueError, RecursionError):
            return _with_sizes(tomllib.loads(text))
        with contextlib.suppress(configparser.Error):
            parser = configparser.ConfigParser(interpolation=None)
            parser.read_string(text)
            return _with_sizes({name: dict(parser[name]) for name in parser.sections()})
    try:
        return parse_yaml(_first_document(data), name)
    except PlainTextError as error:
        keys = "holds no keys, as image_width: 640"
        raise FileError(f"{name}: {keys}, and is no other kind of camera file ({READ})") from error
    except NotYamlError as error:
        if name.lower().endswith((".yaml", ".yml")):
            raise
        told = f"{name}: {no_json}" if no_json else f"{error}, and no other kind of camera file ({READ})"
        raise FileError(told) from error


def _ost(text: str) -> dict[str, Any]:
    """What ROS's calibrator writes beside its YAML; the size of each camera stands before its name."""
    parts = re.split(r"^\[(?!image\])([^\]\n]+)\]", text, flags=re.MULTILINE)
    found = {
        name.rpartition("/")[2]: dict(_OST_ENTRY.findall(before))
        | dict(_OST_ENTRY.findall(body.partition("[image]")[0]))
        for before, name, body in zip(parts[::2], parts[1::2], parts[2::2], strict=False)
    }
    return found if len(found) > 1 else dict(_OST_ENTRY.findall(text))


def _with_sizes(found: dict[str, Any]) -> dict[str, Any]:
    """Sections with what those of a ZED's SN.conf say by their names; a size counts if the principal point fits it."""
    for name, values in found.items():
        side, _, size = name.partition("_CAM_")
        if size in _ZED and isinstance(values, dict):
            values |= lens if isinstance(lens := found.get(f"{side}_DISTO"), dict) else {}
            cy = numbers_in(values.get("cy"))
            if len(cy) == 1 and abs(2 * cy[0] / _ZED[size][1] - 1) < 0.25:
                values |= dict(zip(("width", "height"), _ZED[size], strict=True))
    return {name: values for name, values in found.items() if not name.endswith("_DISTO")}


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
    inner = {each.tag: _opencv_value(each) for each in element}
    if isinstance(inner.get("data"), str):
        inner["data"] = inner["data"].split()
    return inner or (element.text or "").strip()


def _agisoft_values(element: ElementTree.Element) -> dict[str, Any]:
    found: dict[str, Any] = {"agisoft": True, "projection": element.get("type", "frame")}
    for each in element:
        found |= dict(each.attrib) if each.tag == "resolution" else {each.tag: each.text}
    return found
