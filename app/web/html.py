"""Tables of the page, as HTML; every cell from outside is escaped by the code that makes it."""

from collections.abc import Sequence

from dockpose.app.drawing.colours import POSE_COLOURS, POSE_NAMES
from dockpose.app.drawing.numbers import MISSING, number, parts_words, percent, pose_cells, pose_sigmas, sigma_words
from dockpose.app.state.view import MeasuredPose
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose

NUMBERS = "padding: 0.15em 0.3em; text-align: right; font-variant-numeric: tabular-nums"


def table(name: str, columns: Sequence[str], rows: Sequence[str], note: str = "", foot: str = "") -> str:
    """Return a table with an HTML id, its head, rows and a foot as :func:`row` makes them, and a note below."""
    head = "".join(map(f'<th style="{NUMBERS}">{{}}</th>'.format, columns))
    below = f'<div style="opacity: 0.75; padding-top: 0.4em; line-height: 1.35">{note}</div>' if note else ""
    return (
        '<div style="padding: 0 0.75em 0.5em; font-size: 0.85em">'
        f'<table id="{name}" style="width: 100%; border-collapse: collapse"><thead><tr><th></th>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody><tfoot>{foot}</tfoot></table>{below}</div>"
    )


def row(name: str, cells: Sequence[str], *, bold: bool = False) -> str:
    """Return a row: its name at the left, then numbers."""
    style = "border-top: 1px solid rgba(128,128,128,0.35)" + ("; font-weight: 600" if bold else "")
    columns = "".join(map(f'<td style="{NUMBERS}">{{}}</td>'.format, cells))
    return f'<tr style="{style}"><td style="white-space: nowrap">{name}</td>{columns}</tr>'


def wide_row(text: str, columns: int) -> str:
    """Return a row of one cell, which says why there are no numbers."""
    return f'<tr><td colspan="{columns}">{text}</td></tr>'


def pose_name(index: int, is_chosen: bool) -> str:
    """Letter and colour of a pose; the chosen one's dot is full, and it says so."""
    mark = f'<span style="color: {POSE_COLOURS[index]}">{"●" if is_chosen else "○"}</span>'
    return f"{mark} {POSE_NAMES[index]}{', chosen' if is_chosen else ''}"


def result_cells(pose: CirclePose | KnownPose | MeasuredPose) -> list[str]:
    """Return a pose's position, angles, probability and reprojection error, as tables of candidates show them."""
    if isinstance(pose, MeasuredPose):
        return [*map(number, pose.values), MISSING, MISSING]
    if isinstance(pose, KnownPose):
        return [*pose_cells(pose), MISSING, MISSING]
    return [*pose_cells(pose), percent(pose.probability), number(pose.rms_px, 2)]


def sigma_cells(pose: CirclePose) -> list[str]:
    """Return one sigma of each of a pose's quantities, and on hover its parts, for :func:`result_cells`."""
    pairs = zip(parts_words(pose), pose_sigmas(pose), strict=True)
    return [*[f'<span title="{parts}">{sigma_words(sigma)}</span>' for parts, sigma in pairs], "", ""]


def small(html: str, attributes: str = "") -> str:
    """Return small print; ``attributes`` are HTML of its own, as an id."""
    style = "padding: 0 0.75em 0.5em; font-size: max(0.8em, 12px); line-height: 1.35"
    return f'<div {attributes} style="{style}">{html}</div>' if html else ""


def tab_link(tab: str, words: str) -> str:
    """Return a link that opens a tab."""
    return f'<a href="#{tab}" data-opens="{tab}">{words}</a>'


def name_around(name: str) -> str:
    """Return what gives the controls that stand around it a class, for our style sheets."""
    return f'<dockpose-name-next name="{name}" count="0"></dockpose-name-next>'


def help_link(section: str, words: str = "What these numbers mean, and how far to trust them") -> str:
    """Return a line with a link to a section of the help, which opens in a new tab."""
    link = f'<a href="help#{section}" target="_blank" rel="noopener">{words}</a>'
    return f'<div style="padding: 0.3em 0.75em 0.6em; font-size: 0.85em">{link}</div>'
