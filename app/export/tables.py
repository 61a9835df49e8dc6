"""The table "estimated (measured)" as CSV, Markdown, LaTeX and HTML."""

import re
import unicodedata
from collections.abc import Sequence

from dockpose.app.drawing.numbers import MISSING
from dockpose.app.experiment.row import POSE_COLUMNS, Row, csv_text, table
from dockpose.app.export.parts import page
from dockpose.app.resources import read_toml
from markupsafe import escape

CSV_HEAD = (
    *("number", "time", "source", "status", "probability", "range_cm"),
    *(f"{kind}{name}" for name in POSE_COLUMNS for kind in ("", "measured_", "error_")),
    "notes",
)
_FORMULA = re.compile(r"^[=+\-@\t]")
_LATEX_HEAD = ("No.", *(rf"${name}$ (cm)" for name in "xyz"), *(rf"$\theta_{name}$ ($^\circ$)" for name in "xy"))
_GREEK = re.compile(r"GREEK (SMALL|CAPITAL) LETTER (\w+)$")


def csv_table(rows: Sequence[Row]) -> str:
    """Return a line per row, unknown values blank; what a spreadsheet would take for a formula gets an apostrophe."""
    lines: list[Sequence[object]] = [CSV_HEAD]
    for row in rows:
        triples = zip(row.estimated, row.measured, row.errors, strict=True)
        lines.append(
            [row.number, row.time, _no_formula(row.source), row.status, row.probability, _rounded(row.range_cm)]
            + [_rounded(value) for triple in triples for value in triple]
            + [_no_formula(row.notes)]
        )
    return csv_text(lines)


def markdown_table(rows: Sequence[Row]) -> str:
    """Return a table in GitHub's Markdown."""
    content = table(rows)
    lines = [_markdown_line(content.head), _markdown_line(["---:"] * (len(content.head) - 1) + ["---"])]
    lines += [_markdown_line([_markdown(cell) for cell in cells]) for cells in content.body]
    lines += [_markdown_line([f"**{cell}**" if cell else "" for cell in cells]) for cells in content.foot]
    return "".join(lines)


def latex_table(rows: Sequence[Row]) -> str:
    """Return a ``longtable`` without the error columns; the document must load the package of that name."""
    content = table(rows, with_errors=False)
    head = " & ".join(rf"\textbf{{{name}}}" for name in (*_LATEX_HEAD, "Notes"))
    lines = [
        "% estimated (measured); needs \\usepackage{longtable}",
        r"\begin{longtable}{rrrrrrp{0.2\textwidth}}",
        rf"\hline {head} \\ \hline \endhead",
        *(_latex_line(cells) for cells in content.body),
        r"\hline",
        *(_latex_line(cells) for cells in content.foot),
        r"\hline",
        r"\end{longtable}",
    ]
    return "\n".join(lines) + "\n"


def html_table(rows: Sequence[Row]) -> str:
    """Return a complete page with the table."""
    return page("table.html", table=table(rows)) + "\n"


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 6)


def _no_formula(text: str) -> str:
    return f"'{text}" if _FORMULA.match(text) else text


def _markdown_line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |\n"


def _markdown(text: str) -> str:
    """Escape Markdown and HTML; a line break becomes <br>."""
    is_number = re.fullmatch(rf"[+-]?[\d.]+( \([+-]?[\d.]+\))?|{MISSING}( \([+-]?[\d.]+\))?", text)
    marked = text if is_number else re.sub(r"([\\`*_{}\[\]()#+!|~$-])", r"\\\1", text)
    return str(escape(marked)).replace("\n", "<br>")


def _latex_line(cells: Sequence[str]) -> str:
    return " & ".join(to_latex(cell) for cell in cells) + r" \\"


def to_latex(text: str) -> str:
    """Return LaTeX that prints the text and does nothing else; letters without a font in plain LaTeX become "?"."""
    return "".join(_character(character) for character in unicodedata.normalize("NFC", text))


def _character(character: str) -> str:
    commands = read_toml("latex.toml")
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
    return rf"$\{command}$" if name in read_toml("latex.toml")["greek"][match[1]].split() else "?"
