"""Threshold methods that installed packages bring are those of the commands, in other processes too."""

import json

import pytest
from dockpose.app.cli import main
from dockpose.sidecar import sample_path

from tests.support.methods import install, registered, run_beside

TENTH = """
import numpy as np

def bright(grey):
    return 100

def mask(grey):
    return grey >= 100

def broken(grey):
    raise RuntimeError("no glow here")
"""
PLAIN = str(sample_path("plain"))


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab") / "site"
    install(folder, "glowlab", TENTH, bright="glowlab:bright", by_mask="glowlab:mask", broken="glowlab:broken")
    install(folder, "rottenlab", "import a_module_that_is_not_there", rotten="rottenlab:any", hats="glowlab:mask")
    return folder


@pytest.mark.slow
def test_estimate_with_a_method_of_a_package_in_two_processes(lab):
    pictures = [PLAIN, str(sample_path("tilted"))]
    done = run_beside(lab, "estimate", *pictures, "--method", "by_mask", "--jobs", "2", "--json", "-")
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["status"] for line in lines] == ["ok", "ok"], done.stderr
    assert [line["threshold"]["method"] for line in lines] == ["by_mask", "by_mask"]
    assert done.returncode == 0
    # Told once, and not by each process; a method that nobody asked for stops nothing.
    assert done.stderr.count("'rotten' of rottenlab is left out: ModuleNotFoundError: No module named 'a_module_") == 1
    assert "'hats' of rottenlab is left out: there is a threshold method 'hats' already, dockpose's own" in done.stderr


@pytest.mark.slow
def test_compare_has_them_all_and_one_that_fails_is_a_row(lab):
    done = run_beside(lab, "compare", PLAIN)
    rows = {line.split()[0]: line for line in done.stdout.splitlines()[2:] if line}
    assert "right:" in rows["bright"]
    assert "right:" in rows["by_mask"]
    assert "Threshold method 'broken' failed: RuntimeError: no glow here (glowlab.py, line 11)." in rows["broken"]
    assert "right:" in rows["hats"]
    assert done.returncode == 0


@pytest.mark.slow
def test_estimate_by_a_method_that_fails_says_so_and_ends_with_1(lab):
    done = run_beside(lab, "estimate", PLAIN, "--method", "broken", "--json", "-")
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "method_failed"
    (told,) = [line for line in done.stderr.splitlines() if "no glow here" in line]
    assert told.startswith("dockpose: on 1 frame the threshold method failed; first: Threshold method 'broken'")


def test_help_names_methods_of_ones_own(capsys):
    with registered(mine=("Mine", lambda grey: 100)), pytest.raises(SystemExit):
        main(["estimate", "--help"])
    assert " mine, fixed" in " ".join(capsys.readouterr().out.split())
