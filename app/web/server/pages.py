"""Web pages served beside viser's own: its front page with our script added, and the help."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import viser
from dockpose.app.resources import static_path

_SCRIPT_TAG = '<script src="/page.js" defer></script>'


@dataclass(frozen=True)
class Page:
    """The answer to requests for one path, and what to call on each."""

    content_type: str
    body: bytes
    on_request: Callable[[], None] | None = None


def own_pages(on_software_webgl: Callable[[], None]) -> dict[str, Page]:
    """Pages by path; ``on_software_webgl`` is called when a browser reports that it has no graphics card."""
    html = "text/html; charset=utf-8"
    front = Page(html, with_script(_viser_page()).encode())
    return {
        "/": front,
        "/index.html": front,
        "/page.js": Page("application/javascript; charset=utf-8", static_path("page.js").read_bytes()),
        "/software-webgl": Page("text/plain; charset=utf-8", b"", on_software_webgl),
        "/help": Page(html, static_path("help.html").read_bytes()),
    }


def help_body() -> str:
    """The main part of the help page, to be shown within another page."""
    html = static_path("help.html").read_text(encoding="utf-8")
    return html[html.index("<main>") : html.index("</main>") + len("</main>")]


def with_script(html: str) -> str:
    """Put our script at the end of a page's head."""
    place = html.index("</head>")
    return f"{html[:place]}{_SCRIPT_TAG}{html[place:]}"


def _viser_page() -> str:
    return (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
