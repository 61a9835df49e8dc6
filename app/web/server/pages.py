"""Web pages served beside viser's own: its front page with our scripts added, and the help."""

import re
from dataclasses import dataclass

from dockpose import __version__
from dockpose.app.resources import static_path
from dockpose.app.web.server.viser_private import page_html

MADE_HERE = b"<!-- made for each request -->"  # in a page: what the guard's ``made`` has for its path
LOOK_PATH = "/look"  # asked for where a browser's look changed; that browser's own pages alone are told
# The styles and the first scripts stand in the page itself, which would wait for them.
_STYLES = ("page.css", "view.css", "viser.css", "modes.css")
_FIRST_SCRIPTS = ("viser.js", "layout.js", "connection.js")
_SCRIPTS = ("page.js",)
_MODULES = (
    *("link.js", "frame.js", "viewport.js", "overlay.js", "pixels.js", "lights.js", "tools.js", "flat.js"),
    *("picture.js", "histogram.js", "jobs.js", "compare.js", "timeline.js", "scene.js", "steps.js"),
)
_STUDY = "<!-- study.html -->"  # where it stands in the help
_ICON = '<link rel="icon" type="image/svg+xml" href="icon.svg" />'


@dataclass(frozen=True)
class Page:
    """The answer to requests for one path."""

    content_type: str
    body: bytes


# What BlueOS asks of each port before a person opens it: whether something is there, and what it is.
_WHAT_IT_IS = static_path("register_service.json").read_text(encoding="utf-8").replace("VERSION", __version__)
WITHOUT_TOKEN = {
    "/": Page("text/html; charset=utf-8", static_path("token.html").read_bytes()),
    "/register_service": Page("application/json", _WHAT_IT_IS.encode()),
}


def own_pages() -> dict[str, Page]:
    """Pages by path."""
    html = "text/html; charset=utf-8"
    script = "application/javascript; charset=utf-8"
    front = Page(html, with_ours(page_html()).encode())
    return {
        "/": front,
        "/index.html": front,
        **{f"/{name}": Page(script, static_path(name).read_bytes()) for name in (*_SCRIPTS, *_MODULES)},
        "/icon.svg": Page("image/svg+xml", static_path("icon.svg").read_bytes()),
        "/alive": Page("text/plain; charset=utf-8", MADE_HERE),
        LOOK_PATH: Page("text/plain; charset=utf-8", b""),
        "/help": Page(html, help_page().encode()),
        "/register_service": WITHOUT_TOKEN["/register_service"],
    }


def help_page() -> str:
    """The help, with what the study says in it."""
    return _text("help.html").replace(_STUDY, _text("study.html"))


def with_ours(html: str) -> str:
    """Give viser's page our name, icon, style and scripts, at addresses that hold below a proxy's path too."""
    html = re.sub(r"<title>[^<]*</title>", "<title>dockpose: where a dock is, by its lights</title>", html, count=1)
    html = re.sub(r"<link\s+rel=\"icon\"[^>]*>", _ICON, html, count=1)
    style, first = ("\n".join(map(_text, names)) for names in (_STYLES, _FIRST_SCRIPTS))
    scripts = "".join(f'<script src="{name}" defer></script>' for name in _SCRIPTS)
    modules = "".join(f'<script type="module" src="{name}"></script>' for name in _MODULES)
    tags = f"<style>{style}</style><script>{first}</script>{scripts}{modules}"
    start, end = html.index("<script"), html.index("</head>")
    loader, before = (
        html[start:end],
        f'{MADE_HERE.decode()}<div id="root">',
    )  # viser's comes last: it holds up what follows
    html = html[:start] + tags + html[end:].replace('<div id="root">', before, 1)
    return html.replace("</body>", f"{loader}</body>", 1)


def _text(name: str) -> str:
    return static_path(name).read_text(encoding="utf-8")
