import ctypes
import json
import os
import signal
import subprocess
import sys
import threading

import pytest
from dockpose.app.commands.console import Terminated, check_stopped, stopped_by_signals
from dockpose.sidecar import sample_source


@pytest.fixture(autouse=True)
def obeyed():
    """Ctrl+C has its usual meaning, also where the tests run in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(("number", "raised"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)])
def test_interrupt_that_was_swallowed_comes_again(number, raised):
    with stopped_by_signals():
        check_stopped()
        for again in (lambda: signal.raise_signal(number), check_stopped):
            with pytest.raises(KeyboardInterrupt) as error:
                again()
            assert error.type is raised
    check_stopped()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_nothing_is_said_of_a_sigterm_that_is_lost_in_a_callback_of_compiled_code(capfd):
    def end(_):
        signal.raise_signal(signal.SIGTERM)

    with stopped_by_signals():
        ctypes.CFUNCTYPE(None, ctypes.c_int)(end)(0)
        with pytest.raises(Terminated):
            check_stopped()
    assert capfd.readouterr() == ("", "")


def test_another_meaning_of_it_is_left():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with stopped_by_signals():
            signal.raise_signal(signal.SIGINT)
            check_stopped()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_are_left_alone():
    seen = []

    def work():
        with stopped_by_signals():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


def run_in_shell(closing, *words):
    command = ["sh", "-c", f'exec "$@" {closing}', "sh", sys.executable, "-m", "dockpose", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs a shell that closes files")
def test_a_standard_output_that_is_closed_is_one_sentence():
    done = run_in_shell(">&-", "estimate", "tilted")
    assert done.stderr == "dockpose: standard output: cannot be written (it is closed)\n"
    assert done.returncode == 1


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs a shell that closes files")
def test_nothing_that_is_said_lands_in_a_file_where_all_standard_streams_are_closed(tmp_path):
    path = tmp_path / "a.jsonl"
    words = ["estimate", sample_source("plain"), str(tmp_path / "gone.png"), "--json", str(path)]
    assert run_in_shell("<&- >&- 2>&-", *words).returncode == 1
    (line,) = path.read_text().splitlines()
    assert json.loads(line)["status"] == "ok"
