"""Escape text for LaTeX: for every engine, without further packages."""

from __future__ import annotations

import functools
import re
import tomllib
import unicodedata

from dockpose.app.resources import static_path

_GREEK = re.compile(r"GREEK (SMALL|CAPITAL) LETTER (\w+)$")


def to_latex(text: str) -> str:
    """Return LaTeX that prints the text and does nothing else; letters without a font in plain LaTeX become "?"."""
    return "".join(_character(character) for character in unicodedata.normalize("NFC", text))


def _character(character: str) -> str:
    commands = _commands()
    if character in commands["characters"]:
        return commands["characters"][character]
    if " " <= character <= "~":
        return character
    letter, *marks = unicodedata.normalize("NFD", character)
    if letter.isascii() and letter.isalpha() and len(marks) == 1 and marks[0] in commands["accents"]:
        dotless = rf"\{letter}" if letter in "ij" and marks[0] != "\N{COMBINING CEDILLA}" else letter
        return f"{commands['accents'][marks[0]]}{{{dotless}}}"
    return _greek(character)


def _greek(character: str) -> str:
    """Return a Greek letter as a math command; "?" where there is none."""
    match = _GREEK.match(unicodedata.name(character, ""))
    if match is None:
        return "?"
    name = {"LAMDA": "lambda"}.get(match[2], match[2].lower())
    command = name if match[1] == "SMALL" else name.capitalize()
    return rf"$\{command}$" if name in _commands()["greek"][match[1]].split() else "?"


@functools.cache
def _commands() -> dict[str, dict[str, str]]:
    """What prints characters, accents and Greek letters, by each."""
    return tomllib.loads(static_path("latex.toml").read_text(encoding="utf-8"))
