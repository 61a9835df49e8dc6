from dockpose.app.commands import serve as command
from dockpose.app.web.app import App


def test_serve_tells_the_address_and_stops_on_interrupt(monkeypatch):
    told = []

    class Interrupted:
        def wait(self):
            raise KeyboardInterrupt

    monkeypatch.setattr(command.threading, "Event", Interrupted)
    monkeypatch.setattr(App, "build", lambda *_, **__: FakeApp())
    command.serve(None, None, None, report=told.append)
    assert "http://127.0.0.1:1234" in told[0]
    assert FakeApp.stopped


def test_serving_to_others_says_what_that_means(monkeypatch):
    told = []
    monkeypatch.setattr(command.threading, "Event", lambda: (_ for _ in ()).throw(KeyboardInterrupt))
    monkeypatch.setattr(App, "build", lambda *_, **__: FakeApp())
    command.serve(None, None, None, host="0.0.0.0", report=told.append)
    assert "every machine of that network" in told[1]


class FakeApp:
    address = "http://127.0.0.1:1234"
    stopped = False

    def stop(self):
        FakeApp.stopped = True
