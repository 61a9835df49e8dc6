import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server.guard import Guard
from dockpose.app.web.server.start import open_server, silence


@pytest.fixture(scope="module")
def app():
    """The page, at any free port."""
    with App(port=0) as running:
        yield running


@pytest.fixture(scope="module")
def served():
    """A guarded server without the page, and its guard."""
    guard = Guard("127.0.0.1")
    server = open_server("127.0.0.1", 0, guard)
    yield server, guard
    with silence():
        server.stop()
