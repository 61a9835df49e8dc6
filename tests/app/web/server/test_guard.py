import contextlib
import http.client
from importlib.metadata import version
from types import SimpleNamespace
from urllib.request import urlopen

import pytest
from dockpose.app.web.server.guard import Guard, cookie_name
from websockets import Headers
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from tests.attack import requests
from tests.support.visitors import Visitor


def ask(app, path="/", **headers):
    """Status and text of a plain request; Host and the like may be given."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", app.port, timeout=60)) as connection:
        connection.putrequest("GET", path, skip_host="Host" in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        with connection.getresponse() as answer:
            return answer.status, answer.read().decode("utf-8", "replace"), answer.headers


def open_socket(app, cookie=None, origin=None):
    """Open the page's WebSocket as a browser would, with another or an empty cookie, or as another page's script."""
    headers = {"Cookie": cookie_of(app) if cookie is None else cookie}
    return connect(
        f"ws://127.0.0.1:{app.port}",
        origin=Origin(origin or f"http://127.0.0.1:{app.port}"),
        additional_headers=headers,
        subprotocols=[Subprotocol(f"viser-v{version('viser')}")],
    )


def cookie_of(app):
    return f"dockpose_{app.port}={app._guard.token}"


def test_printed_address_opens_the_page_and_leaves_a_cookie(app):
    with urlopen(app.address, timeout=60) as answer:
        assert answer.status == 200
        assert 'src="page.js"' in answer.read().decode()
        cookie = answer.headers["Set-Cookie"]
        assert answer.headers["X-Frame-Options"] == "DENY"
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        policy = dict(part.split(" ", 1) for part in answer.headers["Content-Security-Policy"].split("; "))
    assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == policy["form-action"] == "'none'"
    assert not any("*" in sources or "http" in sources or "ws:" in sources for sources in policy.values())
    assert cookie.startswith(cookie_of(app))
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie


@pytest.mark.parametrize("path", ["/", "/index.html", "/help", "/page.js", "/picture.js", "/histogram.js"])
def test_cookie_is_enough_from_then_on(app, path):
    status, _, _ = ask(app, path, Cookie=f"other=1; {cookie_of(app)}")
    assert status == 200


@pytest.mark.parametrize("attack", [*requests.REFUSED, "Paths that lead out of the page's folder"])
def test_what_the_page_itself_would_not_send_is_refused(app, attack):
    assert requests.ATTACKS[attack](app, "127.0.0.1").startswith(("403", "404"))


@pytest.mark.parametrize(
    ("headers", "words"),
    [
        ({}, "Open the address that dockpose printed"),
        ({"Host": "evil.example"}, "Host"),
        ({"Origin": "http://evil.example"}, "Origin"),
    ],
)
def test_a_refusal_says_why_and_gives_nothing_away(app, headers, words):
    own = {"Cookie": cookie_of(app)} if headers else {}
    status, text, answer = ask(app, "/help", **own, **headers)
    assert status == 403
    assert words in text
    assert answer["Content-Security-Policy"].startswith("default-src 'none'")
    assert answer["Set-Cookie"] is None


@pytest.mark.parametrize("name", ["localhost", "127.0.0.1", "LOCALHOST"])
def test_own_names_are_known(app, name):
    assert ask(app, f"/?token={app._guard.token}", Host=f"{name}:{app.port}")[0] == 200


def test_every_start_has_its_own_token():
    assert Guard("127.0.0.1").token != Guard("127.0.0.1").token
    assert len(Guard("127.0.0.1").token) >= 20


@pytest.mark.parametrize(
    ("host", "names", "passes"),
    [
        ("127.0.0.1", ["192.168.0.9:8080"], False),
        ("0.0.0.0", ["192.168.0.9:8080"], True),
        ("0.0.0.0", ["[fe80::1]:8080"], True),
        ("0.0.0.0", ["evil.example:8080"], False),
        ("127.0.0.1", ["127.0.0.1", "127.0.0.1"], False),
        ("127.0.0.1", [], False),
    ],
)
def test_addresses_are_known_only_where_others_may_come_and_one_at_a_time(host, names, passes):
    """A name may be rebound to this machine by anyone; a bare address cannot."""
    headers = Headers([("Host", name) for name in names])
    assert (Guard(host, token="t").refusal(headers, "/?token=t") is None) is passes


def test_proxy_with_its_own_name():
    guard = Guard("127.0.0.1", ["tank.example.org"], token="t")
    headers = Headers({"Host": "tank.example.org", "Origin": "https://tank.example.org", "Cookie": "dockpose=t"})
    assert guard.refusal(headers, "/") is None
    assert guard.cookie(headers).startswith("dockpose=t;")
    assert cookie_name("127.0.0.1:8080") == "dockpose_8080"


def test_a_proxy_that_drops_the_port_is_named_and_its_address_can_be_allowed():
    at = {"Host": "tank.example.org", "Origin": "https://tank.example.org:8443", "Cookie": "dockpose=t"}
    told = Guard("127.0.0.1", ["tank.example.org"], token="t").refusal(Headers(at), "/")
    assert told is not None
    for words in ("https://tank.example.org:8443 (Origin)", "tank.example.org (Host)", "--allow-host"):
        assert words in told
    guard = Guard("127.0.0.1", ["https://Tank.example.org:8443/"], token="t")
    assert guard.refusal(Headers(at), "/") is None
    for other in ("https://tank.example.org:8444", "http://tank.example.org:8443", "https://evil.example", "null"):
        assert guard.refusal(Headers(at | {"Origin": other}), "/") is not None


@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=None", "/?token=x", "/?view", "/?token=v&token="])
def test_nothing_but_the_token_opens_the_page(path):
    headers = Headers({"Host": "127.0.0.1:80", "Cookie": "dockpose_80=x; dockpose_81=t; dockpose_80_look=t"})
    assert Guard("127.0.0.1", token="t").refusal(headers, path) is not None


def test_a_socket_shows_its_cookie_and_not_its_address():
    guard, host = Guard("127.0.0.1", token="t"), {"Host": "127.0.0.1:80", "Upgrade": "websocket"}
    assert guard.refusal(Headers(host), "/?token=t") is not None
    assert guard.refusal(Headers(host | {"Cookie": "dockpose_80=v; dockpose_80=t"}), "/") is None


@pytest.mark.slow
def test_no_request_changes_what_others_see(app):
    """As of a page of another port, to which browsers add the cookie."""
    requests.look_of_others(SimpleNamespace(port=app.port, address=app.address, token=app._guard.token), "127.0.0.1")
    assert not app._looks.slow


def test_each_browser_has_the_colours_of_its_system(app):
    with (
        Visitor(app.address) as plain,
        Visitor(app.address, look="idA.dark.software") as dark,
        Visitor(app.address, look="idB.dark") as other,
        Visitor(app.address, look="<dark>.x") as odd,
    ):
        for one in (dark, other):
            assert one.until(lambda page: page.is_replayed.is_set() and page.is_dark, 60)
            assert one.was_dark == [True]  # once: what all are sent may come later than what one is
        for one in (plain, odd):
            assert one.until(lambda page: page.is_replayed.is_set() and page.is_dark is False, 60)
        assert plain.until(lambda _: len(app.server.get_clients()) == 4, 60)
        assert len(app._looks.slow) == 1
        assert (plain.is_dark, odd.is_dark) == (False, False)
        for said in ("idB", "idC", "", "id"):  # its system is light now; other browsers stay as they are
            ask(app, "/look", Cookie=f"{cookie_of(app)}; dockpose_{app.port}_look={said}")
        assert other.until(lambda page: page.is_dark is False, 60)
        assert dark.is_dark
        dark.close()
        assert plain.until(lambda _: not app._looks.slow, 60)


def test_only_who_may_open_the_page_is_answered_with_a_result(app):
    assert app.wait_until_idle(60)
    for path in ("/", "/index.html"):
        assert 'id="shell"' not in ask(app, path)[1]
        status, text, headers = ask(app, path, Cookie=cookie_of(app))
        assert (status, text.count('id="shell"')) == (200, 1)
        assert int(headers["Content-Length"]) == len(text.encode())
        assert headers["Cache-Control"] == "no-store"
    assert ask(app, "/alive")[0] == 403
