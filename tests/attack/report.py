"""Writes what was measured into the tables of SECURITY.md."""

from collections.abc import Callable
from pathlib import Path

_SECURITY = Path(__file__).resolve().parents[2] / "SECURITY.md"
_END = "<!-- end of the table -->"


def write_table(begin: str, made: Callable[[str], str]) -> None:
    """Replace the table that follows a comment by what ``made`` makes of it."""
    before, _, rest = _SECURITY.read_text(encoding="utf-8").partition(begin)
    old, _, after = rest.partition(_END)
    _SECURITY.write_text(f"{before}{begin}\n\n{made(old.strip())}\n\n{_END}{after}", encoding="utf-8")
