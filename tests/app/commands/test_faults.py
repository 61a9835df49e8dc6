"""Full disks, strange names and what is no file: a sentence, an exit status, and whole files or none."""

import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import av
import pytest
from dockpose.app.cli import main
from dockpose.app.export.bundle import read_lines
from dockpose.files import write_whole
from dockpose.sidecar import sample_source

from tests.support.forked import run_on_full_disk

pytestmark = pytest.mark.skipif(os.name == "nt", reason="has no such devices and limits")
PLAIN = sample_source("plain")


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """What is compiled is kept in files, which the tests that follow have no room for."""
    assert main(["estimate", PLAIN]) == 0


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    path = tmp_path_factory.mktemp("faults") / "seq.mkv"
    assert main(["simulate", "--frames", "6", "--seed", "1", "--out", str(path)]) == 0
    assert main(["estimate", str(path)]) == 0
    return path


@pytest.mark.parametrize("option", ["--json", "--csv", "--tum"])
def test_full_device_is_one_sentence(option, capsys):
    assert main(["estimate", PLAIN, option, "/dev/full"]) == 1
    assert capsys.readouterr().err == f"dockpose: {option} /dev/full: cannot be written (the disk is full)\n"


@pytest.mark.slow
@pytest.mark.parametrize("words", [["estimate", PLAIN], ["estimate", PLAIN, "--json", "-"], ["compare", PLAIN]])
def test_full_standard_output_is_one_sentence(words):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "dockpose.app.cli", *words]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    assert done.returncode == 1
    # The first run compiles, and says so.
    told = [line for line in done.stderr.splitlines() if not line.startswith("dockpose: compiling")]
    assert told == ["dockpose: standard output: cannot be written (the disk is full)"]


@pytest.mark.slow
def test_lines_on_a_full_disk_are_whole(tmp_path, video):
    done = run_on_full_disk(20_000, tmp_path, "estimate", str(video), "--json", "a.jsonl", "--csv", "a.csv")
    assert done.returncode == 1
    text = (tmp_path / "a.jsonl").read_text(encoding="utf-8")
    assert text.endswith("\n")
    lines = read_lines(tmp_path / "a.jsonl")
    assert [line["frame"] for line in lines] == list(range(len(lines)))
    assert 0 < len(lines) < 6
    assert "Traceback" not in done.stderr
    assert (
        f"a.jsonl: cannot be written (the disk or this account takes no larger file); what was written before is "
        f"kept (lines: {len(lines)})" in done.stderr
    )


@pytest.mark.parametrize("ending", ["mp4", "mkv"])
def test_video_on_a_full_disk_is_whole_or_absent(tmp_path, ending):
    done = run_on_full_disk(30_000, tmp_path, "estimate", PLAIN, "--rate", "5", "--annotate", f"a.{ending}")
    path = tmp_path / f"a.{ending}"
    if done.returncode == 0:
        assert path.stat().st_size <= 30_000
        return
    assert done.returncode == 1
    assert f"a.{ending}: cannot be written (the disk or this account takes no larger file)" in done.stderr
    if path.exists():
        with av.open(str(path)) as container:
            assert sum(1 for _ in container.decode(video=0)) > 0


def test_simulate_and_bag_on_a_full_disk(tmp_path, video):
    done = run_on_full_disk(3000, tmp_path, "simulate", "--frames", "2", "--out", "sim")
    assert done.returncode == 1
    assert "--out sim: cannot be written" in done.stderr
    assert sorted(path.name for path in (tmp_path / "sim").iterdir()) == ["scene.yaml", "truth.csv"]
    done = run_on_full_disk(3000, tmp_path, "estimate", str(video), "--out", "x.mcap")
    assert done.returncode == 1
    assert "x.mcap: cannot be written (the disk or this account takes no larger file)" in done.stderr


def test_a_simulated_video_on_a_full_disk_leaves_all_its_files_or_none(tmp_path):
    scene = tmp_path / "scene.yaml"
    for limit_bytes in (3000, 30_000):
        done = run_on_full_disk(limit_bytes, tmp_path, "simulate", "--frames", "3", "--out", "x.mp4")
        assert done.returncode == 1
        assert "x.mp4: cannot be written" in done.stderr
        assert [path for path in tmp_path.iterdir() if path != scene] == []


@pytest.mark.parametrize("name", ["f.png", "f.mp4", "f.mcap", "f.yaml"])
def test_pipe_in_place_of_a_file_is_refused(tmp_path, name, capsys):
    os.mkfifo(tmp_path / name)
    yaml = PLAIN.replace(".png", ".yaml")
    assert main(["estimate", str(tmp_path / name), "--camera", yaml, "--dock-diameter", "0.3"]) == 1
    assert f"{name}: is not a regular file" in capsys.readouterr().err


def test_name_that_is_no_text_is_spelt_out_everywhere(tmp_path, capsys):
    for ending in (".png", ".yaml"):
        shutil.copy(
            PLAIN.replace(".png", ending),
            os.fsdecode(os.path.join(os.fsencode(tmp_path), b"a\xff\x1b" + ending.encode())),
        )
    lines, table = tmp_path / "a.jsonl", tmp_path / "a.csv"
    assert main(["estimate", str(tmp_path), "--json", str(lines), "--csv", str(table)]) == 0
    assert json.loads(lines.read_text())["source"].endswith("a\\xff\x1b.png")
    assert len(read_lines(lines)) == 1
    assert "a\\xff" in table.read_text(encoding="utf-8")
    assert main(["estimate", str(tmp_path)]) == 0
    assert "a\\xff\\x1b.png: 10 lights" in capsys.readouterr().out


def test_device_is_written_to_and_not_replaced(tmp_path):
    link = tmp_path / "link"
    link.symlink_to("/dev/null")
    write_whole(link, b"x")
    assert link.is_symlink()
    assert not os.path.isfile("/dev/null")


def test_files_written_at_once_by_many_are_whole(tmp_path):
    theirs = tmp_path / ".film.part"
    theirs.write_bytes(b"half")
    contents = [bytes([number]) * 100_000 for number in range(8)]
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda content: write_whole(tmp_path / "a", content), contents))
    assert (tmp_path / "a").read_bytes() in contents
    assert sorted(path.name for path in tmp_path.iterdir()) == [theirs.name, "a"]
