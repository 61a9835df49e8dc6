"""A stand-in of BlueOS: its helper asks each port what it is, and writes a route of nginx; its page frames ours.

What is asked, and in which order, is that of BlueOS's core/services/helper/main.py (detect_service, setup_nginx_route).
"""

import contextlib
import http.client
import json
import re
import shutil
import socket
import subprocess
import time

import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options

from tests.support.answering import answering
from tests.support.visitors import SUBPROTOCOL

pytestmark = pytest.mark.skipif(shutil.which("nginx") is None, reason="needs nginx")
NEEDED = {"name", "description", "icon", "company", "version", "webpage", "api"}  # of ServiceMetadata
TOKEN_LETTERS = 24


def asked(port, path, headers=None):
    """Status and text of an answer to one without a token."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=30)) as connection:
        connection.request("GET", path, headers=headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read().decode("utf-8", "replace")


def detected(port):
    """What the helper would know of a port: the title of its page, and its own words; None where it lists nothing."""
    status, page = asked(port, "/", {"User-Agent": "python", "Accept": "*/*"})
    if status != 200:
        return None
    title = re.search("<title>(.*?)</title>", page)
    status, words = asked(port, "/register_service", {"User-Agent": "python", "Accept": "application/json"})
    return (title and title[1], json.loads(words)) if status == 200 else None


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return taken.getsockname()[1]


@contextlib.contextmanager
def nginx(folder, port, name, behind):
    """BlueOS's proxy with the route that the helper writes, as it is since it passes on WebSockets."""
    (folder / "nginx.conf").write_text(f"""
daemon off; master_process off; pid {folder}/nginx.pid; error_log {folder}/error.log;
events {{}}
http {{
    access_log off; proxy_http_version 1.1;
    client_body_temp_path {folder}/a; proxy_temp_path {folder}/b; fastcgi_temp_path {folder}/c;
    uwsgi_temp_path {folder}/d; scgi_temp_path {folder}/e;
    server {{
        listen 127.0.0.1:{port};
        location /extensionv2/{name}/ {{
            proxy_pass http://127.0.0.1:{behind}/;
            proxy_set_header Host $host;
            proxy_set_header X-Real-IP $remote_addr;
            proxy_set_header X-Forwarded-For $proxy_add_x_forwarded_for;
            proxy_set_header X-Forwarded-Proto $scheme;
            proxy_set_header Upgrade $http_upgrade;
            proxy_set_header Connection "upgrade";
        }}
    }}
}}
""")
    process = subprocess.Popen(["nginx", "-p", folder, "-c", folder / "nginx.conf"])
    try:
        for _ in range(200):
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 5):
                break
            time.sleep(0.05)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(20)


def framing(address):
    """BlueOS's own page: one of another origin that shows an address in a frame."""
    page = f"<!doctype html><title>BlueOS</title><iframe src='{address}' style='width:1300px;height:740px'>"
    return answering(lambda path: (200, {"Content-Type": "text/html"}, page.encode()))


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory):
    """The page as an extension, the addresses of BlueOS's page, of one that is not named, and of the route."""
    folder, port = tmp_path_factory.mktemp("nginx"), free_port()
    route = f"http://127.0.0.1:{port}/extensionv2/dockpose/"
    with framing(route) as blueos, framing(route) as other:
        options = Options(
            allow_hosts=(f"http://127.0.0.1:{port}",), allow_frames=(blueos,), sessions=folder / "sessions"
        )
        with App(port=0, options=options) as app:
            found = detected(app.port)
            assert found is not None
            name = re.sub("[^a-z0-9]", "", found[1]["name"].lower())
            with nginx(folder, port, name, app.port):
                yield app, blueos, other, route


@pytest.fixture
def browsing(browser):
    """A new browser's page, and what it was refused."""
    context = browser.new_context(viewport={"width": 1366, "height": 768})
    page, refused = context.new_page(), []
    page.on("console", lambda message: refused.append(message.text) if message.type == "error" else None)
    page.on("response", lambda answer: refused.append(answer.url) if answer.status >= 400 else None)
    yield page, refused
    context.close()


def test_the_helper_lists_it_by_what_it_says_without_a_token(vehicle):
    app, *_ = vehicle
    found = detected(app.port)
    assert found is not None
    title, words = found
    assert title == "dockpose"
    assert words.keys() >= NEEDED
    assert all(isinstance(words[name], str) and words[name] for name in NEEDED)
    assert words["works_in_relative_paths"] is True
    assert app._guard.token not in json.dumps(words)


def test_a_page_that_nobody_may_frame_tells_the_helper_nothing():
    with App(port=0) as app:
        assert detected(app.port) is None
        assert asked(app.port, "/register_service")[0] == 403


def test_below_its_path_and_in_the_frame_of_blueos_it_works(vehicle, browsing):
    app, blueos, _, _ = vehicle
    page, refused = browsing
    page.goto(blueos)
    frame = page.frame_locator("iframe")
    frame.get_by_label("Token").fill(app._guard.token)
    assert len(app._guard.token) == TOKEN_LETTERS
    frame.get_by_role("button", name="Open the page").click()
    frame.locator("#candidates").wait_for()  # the poses, which come by the WebSocket
    assert refused == []
    page.reload()  # the cookie is enough from then on
    frame.locator("#candidates").wait_for()
    assert refused == []


def test_a_page_of_another_origin_may_not_frame_it(vehicle, browsing):
    app, _, other, route = vehicle
    page, refused = browsing
    page.goto(f"{route}?token={app._guard.token}")
    page.locator("#candidates").wait_for()
    refused.clear()
    with page.expect_console_message(lambda message: "frame-ancestors" in message.text):
        page.goto(other)
    assert page.frame_locator("iframe").locator("#candidates").count() == 0


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/help", {}),
        ("/page.js", {}),
        ("/alive", {}),
        ("/look", {}),
        ("/index.html", {}),
        ("/register_service/", {}),
        ("/help?token=wrong", {}),
        ("/", {"Host": "evil.example"}),
        ("/register_service", {"Host": "evil.example"}),
        ("/", {"Origin": "http://evil.example"}),
        ("/register_service", {"Origin": "null"}),
    ],
)
def test_strangers_get_nothing_else(vehicle, path, headers):
    app, *_ = vehicle
    assert asked(app.port, path, headers)[0] in (403, 404)


@pytest.mark.parametrize("path", ["/", "/?token=wrong", "/register_service"])
def test_what_strangers_get_has_nothing_of_the_page(vehicle, path):
    app, *_ = vehicle
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", app.port, timeout=30)) as connection:
        connection.request("GET", path)
        answer = connection.getresponse()
        body = answer.read().decode()
        assert answer.status == 200
    assert answer.getheader("Set-Cookie") is None
    assert "<script" not in body
    assert len(body) < 4000
    policy = answer.getheader("Content-Security-Policy") or ""
    assert "form-action 'self'" in policy
    assert "frame-ancestors http://127.0.0.1:" in policy


@pytest.mark.parametrize("origin", ["own", "blueos", "http://evil.example"])
def test_no_websocket_opens_without_the_token_nor_for_the_page_that_frames_it(vehicle, origin):
    app, blueos, *_ = vehicle
    named = {"own": f"http://127.0.0.1:{app.port}", "blueos": blueos}.get(origin, origin)
    asks = {
        **{"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13", "Origin": named},
        **{"Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Protocol": SUBPROTOCOL},
    }
    assert asked(app.port, "/", asks)[0] == 403
    if origin != "own":  # the cookie alone does not make another page ours
        assert asked(app.port, "/", asks | {"Cookie": f"dockpose_{app.port}={app._guard.token}"})[0] == 403
