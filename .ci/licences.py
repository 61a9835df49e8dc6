"""Write LICENSES-THIRD-PARTY.md: every package that dockpose and its extras bring along, its version and licence."""

import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement

_HEAD = """# Licences of what dockpose brings along

Made by `make licences` from the packages that are installed. All allow use beside code under the MIT licence.

**FFmpeg**: the wheel of PyAV (`av`) contains FFmpeg with libx264 and libx265, which are under the GPL; who passes that
wheel on must follow the GPL for it. To avoid it, build PyAV against an FFmpeg without them (`pip install --no-binary av
av`); `--annotate NAME.mkv` then still works, NAME.mp4 does not.
OpenCV's wheel contains an FFmpeg under the LGPL.

| package | version | for | licence |
|---|---|---|---|
"""
_EXTRAS = ("", "mavlink", "ros")


def licence_of(name: str) -> str:
    """The licence that a package's metadata tell, in a few words."""
    about = distribution(name).metadata
    told = about.get("License-Expression") or (about.get("License") or "").strip().partition("\n")[0]
    classes = [one.split("::")[-1].strip() for one in about.get_all("Classifier") or [] if one.startswith("License")]
    is_name = told and not re.search("copyright|agreement|files|==|^bsd$", told, re.IGNORECASE)
    return (told if is_name else ", ".join(classes)) or "see its files"


def brought_along(name: str, extra: str, found: dict[str, str]) -> None:
    """Collect the versions of what a package needs, and what that needs in turn."""
    for text in distribution(name).requires or ():
        need = Requirement(text)
        if need.marker is not None and not need.marker.evaluate({"extra": extra}):
            continue
        key = re.sub(r"[-_.]+", "-", need.name).lower()
        if key in found:
            continue
        try:
            found[key] = distribution(key).version
        except PackageNotFoundError:
            continue
        brought_along(key, "", found)


def main() -> None:
    """Write the file."""
    rows: dict[str, tuple[str, str]] = {}
    for extra in _EXTRAS:
        found: dict[str, str] = {}
        brought_along("dockpose", extra, found)
        for name, version in found.items():
            rows.setdefault(name, (version, extra or "all"))
    lines = [f"| {name} | {version} | {use} | {licence_of(name)} |\n" for name, (version, use) in sorted(rows.items())]
    Path("LICENSES-THIRD-PARTY.md").write_text(_HEAD + "".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
