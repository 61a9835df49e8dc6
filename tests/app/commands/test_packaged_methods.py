"""Threshold methods that installed packages bring are those of the commands, in other processes too."""

import json

import pytest
from dockpose.app.cli import main
from dockpose.sidecar import sample_path

from tests.support.methods import install, registered, run_beside

TENTH = """
import numpy as np

def mask(grey):
    return grey >= 100
"""
PLAIN = str(sample_path("plain"))


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab") / "site"
    install(folder, "glowlab", TENTH, by_mask="glowlab:mask")
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


def test_help_names_methods_of_ones_own(capsys):
    with registered(mine=("Mine", lambda grey: 100)), pytest.raises(SystemExit):
        main(["estimate", "--help"])
    assert " mine, fixed" in " ".join(capsys.readouterr().out.split())
