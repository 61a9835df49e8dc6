"""What MkDocs does while it builds the documentation: commands from the parser, formulas, and links out of docs/."""

from __future__ import annotations

import argparse
import html
import json
import re
import shutil
from pathlib import Path
from typing import Any

import ziamath
from dockpose.app.cli import COMMANDS
from dockpose.app.cli import _parser as parser
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
# Files of the checkout that become pages.
PAGES = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md", "SECURITY.md": "security.md"}
_FORMULA_PX = 17
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
_MATH = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
# What the theme asks for so that pages opened as files can be searched, and what they get.
_SHIM = "https://unpkg.com/iframe-worker/shim"
_WORKER = (Path(__file__).parent / "search_worker.js").read_text(encoding="utf-8")
# What a browser would fetch by itself.
_FETCHED = re.compile(r"<(?:script|img|link|iframe|source)\b[^>]*\b(?:src|href)=\"?(https?:|//)[^>]*>")


def on_pre_build(config: Any) -> None:
    """Show the code to mkdocstrings as it is installed."""
    package = ROOT / "build" / "source" / "dockpose"
    shutil.rmtree(package, ignore_errors=True)  # links to files that are no longer there
    package.mkdir(parents=True)
    for path in (*(ROOT / "pipeline").iterdir(), ROOT / "app"):
        (package / path.name).symlink_to(path)


def on_files(files: Any, config: Any) -> Any:
    """Add the pages and pictures that lie beside docs/."""
    for name, page in PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / name).read_text(encoding="utf-8")))
    files.append(File.generated(config, "examples.md", content=examples()))
    for picture in sorted((ROOT / "static").glob("screenshot*")):
        files.append(File.generated(config, f"static/{picture.name}", abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Fill in the commands, and turn links out of docs/ into links to pages, pictures, or the file's name."""
    is_root = page.file.src_uri in PAGES.values()

    def link(match: re.Match[str]) -> str:
        bang, text, target = match.groups()
        path, hash_, anchor = target.partition("#")
        if re.match(r"[a-z]+:", target) or not path:
            return match[0]
        name = f"../{path}" if is_root else path
        if name.startswith("../docs/"):
            return f"{bang}[{text}]({name.removeprefix('../docs/')}{hash_}{anchor})"
        if name == "examples/":
            return f"[{text}](examples.md)"
        if not name.startswith("../"):
            return match[0]
        name = name.removeprefix("../")
        if name in PAGES:
            return f"[{text}]({PAGES[name]}{hash_}{anchor})"
        if name.startswith("static/screenshot"):
            return f"{bang}[{text}]({name})"
        return text if text.strip("`") == name else f"{text} (`{name}`)"

    markdown = _LINK.sub(link, markdown)
    return markdown.replace("<!-- commands -->", commands())


def on_page_content(content: str, **_: Any) -> str:
    """Draw formulas as SVG with outlines for letters, for not every machine has a font for MathML."""
    return _MATH.sub(lambda match: _drawn(html.unescape(match[2]).strip(), match[1] == "div"), content)


def _drawn(formula: str, is_display: bool) -> str:
    """A formula in the colour of the text around it, on its line; its source is what a screen reader says."""
    ziamath.config.svg2 = False
    picture = ziamath.Latex(formula, size=_FORMULA_PX, color="currentColor", inline=not is_display).svg()
    view = re.search(r'viewBox="\S+ (\S+) \S+ (\S+)"', picture)
    assert view is not None
    below_px = float(view[1]) + float(view[2])
    how = "display: block; margin: 1em auto; max-width: 100%" if is_display else f"vertical-align: {-below_px:.1f}px"
    label = html.escape(formula, quote=True)
    return picture.replace("<svg ", f'<svg role="img" aria-label="{label}" style="{how}" ', 1)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Put our own script in place of one from another host, and refuse a page that would fetch anything else there."""
    output = re.sub(
        rf"<script src=\"?{re.escape(_SHIM)}\"?></script>", lambda _: f"<script>\n{_WORKER}</script>", output
    )
    fetched = _FETCHED.search(output)
    if fetched:
        raise PluginError(f"{page.file.src_uri}: is not readable offline: {fetched[0]}")
    return output


def examples() -> str:
    """The example programs, and what of the notebook is text and code, as Markdown."""
    parts = ["# Examples\n\nThe files are in `docs/examples/` of the checkout; the tests run them.\n"]
    for path in sorted((ROOT / "docs" / "examples").glob("*.py")):
        program = path.read_text(encoding="utf-8")
        about, _, code = program.removeprefix('"""').partition('"""\n')
        parts.append(f"## {path.name}\n\n{about}\n\n```python\n{code.strip()}\n```\n")
    for path in sorted((ROOT / "docs" / "examples").glob("*.ipynb")):
        parts.append(f"## {path.name}\n\nA notebook:\n")
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            text = "".join(cell["source"])
            is_code = cell["cell_type"] == "code"
            parts.append(
                f"```python\n{text}\n```\n" if is_code else re.sub(r"^#", "###", text, flags=re.MULTILINE) + "\n"
            )
    return "\n".join(parts)


def commands() -> str:
    """Every command with its arguments in their groups, as Markdown, from the parser."""
    parts = []
    for name, command in _commands(parser(*COMMANDS)).items():
        parts.append(f"## dockpose {name}\n\n{_about(name)}\n\n```text\n{command.format_usage().strip()}\n```\n")
        parts.append("| argument | what it does |\n|---|---|")
        for group in command._action_groups:
            rows = [_row(action) for action in group._group_actions if action.dest != "help"]
            if rows:
                title = "arguments" if group.title == "positional arguments" else group.title
                parts.append("\n".join([f"| **{title}** | |", *rows]))
        parts.append("")
    return "\n".join(parts)


def _commands(top: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    (subparsers,) = (action for action in top._actions if isinstance(action, argparse._SubParsersAction))
    return dict(subparsers.choices)


def _about(name: str) -> str:
    (subparsers,) = (action for action in parser(*COMMANDS)._actions if isinstance(action, argparse._SubParsersAction))
    text = next((one.help for one in subparsers._choices_actions if one.dest == name), "") or ""
    return f"{text[:1].upper()}{text[1:]}."


def _row(action: argparse.Action) -> str:
    value = action.metavar if isinstance(action.metavar, str) else ""
    if not value and action.choices is not None:
        value = "{" + ",".join(map(str, action.choices)) + "}"
    elif not value and action.nargs != 0:
        value = action.dest.upper()
    words = ", ".join(f"{option} {value}".strip() for option in action.option_strings) or value
    text = (action.help or "") % {**vars(action), "prog": "dockpose"}
    return f"| `{words.replace('|', chr(92) + '|')}` | {text.replace('|', chr(92) + '|')} |"
