import contextlib
import json
from concurrent.futures import ThreadPoolExecutor

import pytest
from dockpose.app.errors import UserError
from dockpose.app.experiment.lock import FolderLock
from dockpose.app.processing import study as module
from dockpose.app.processing.study import Study
from dockpose.study.judge import methods


class StoppedError(Exception):
    """Stands for a kill."""


@pytest.fixture
def worked_on(monkeypatch):
    """Scenes that were worked on, by threads and without any picture."""
    scenes = []

    def scene_text(seed, scene):
        scenes.append(scene)
        rows = [f"{scene},{seed},{label},{scene * seed},320,240,1.5" for label in methods()]
        return module.code_print(), "\n".join(["scene,seed,method,value,width_px,height_px,elapsed_ms", *rows, ""])

    @contextlib.contextmanager
    def workers(jobs, scheduler):
        with ThreadPoolExecutor(jobs) as pool:
            yield pool, jobs

    monkeypatch.setattr(module, "scene_text", scene_text)
    monkeypatch.setattr(module, "workers", workers)
    return scenes


def run(folder, scenes, seed=2, jobs=2):
    told = []
    Study(folder, scenes, seed).run(jobs, None, told.append)
    return told


def test_rows_are_in_order_and_nothing_timed_is_among_them(tmp_path, worked_on):
    told = run(tmp_path, 11)
    assert (told[0], told[-1]) == (0, 11)
    assert sorted(worked_on) == list(range(11))
    lines = (tmp_path / "study.csv").read_text().splitlines()
    assert lines[0] == "scene,seed,method,value,width_px,height_px"
    assert [line.split(",")[0] for line in lines[1 :: len(methods())]] == [str(scene) for scene in range(11)]
    assert (tmp_path / "cost.csv").read_text().splitlines()[1] == "0,hats_and_local,320,240,1.5"


def stopped(folder):
    def stop(count):
        if count >= 4:
            raise StoppedError

    with pytest.raises(StoppedError):
        Study(folder, 30, 2).run(1, None, stop)
    assert len(Study(folder, 30, 2).done) == 4
    assert not (folder / "study.csv").exists()


def lost(folder):
    run(folder, 30)
    (folder / "scenes" / "000004.csv").unlink()
    (folder / "scenes" / ".000004.csv.part").write_text("scene")


@pytest.mark.parametrize("begin", [stopped, lost, lambda folder: run(folder, 7)], ids=["stopped", "lost", "fewer"])
def test_what_was_begun_goes_on_from_what_is_done(begin, tmp_path, worked_on):
    begin(tmp_path / "one")
    kept = {int(path.stem) for path in (tmp_path / "one" / "scenes").glob("[0-9]*.csv")}  # they end in any order
    worked_on.clear()
    assert run(tmp_path / "one", 30)[0] == len(kept)
    assert sorted(worked_on) == sorted(set(range(30)) - kept)
    run(tmp_path / "other", 30)
    assert (tmp_path / "one" / "study.csv").read_bytes() == (tmp_path / "other" / "study.csv").read_bytes()
    assert not list((tmp_path / "one" / "scenes").glob(".*"))


def test_all_that_is_done_is_in_the_table_even_where_the_folder_does_not_list_it(tmp_path, worked_on, monkeypatch):
    monkeypatch.setattr(Study, "done", set())
    run(tmp_path, 12)
    assert len((tmp_path / "study.csv").read_text().splitlines()) == 1 + 12 * len(methods())


@pytest.mark.parametrize(
    ("scenes", "seed", "changed", "message"),
    [
        (12, 3, {}, "has a study with the seed 2, not 3; use another folder"),
        (8, 2, {}, "has a study of 12 scenes, more than 8; give --scenes 12 or more, or use another folder"),
        (12, 2, {"code": "other"}, "begun with other code of dockpose; use another folder"),
        (12, 2, {"versions": {"numpy": "1.0"}}, "numpy 1.0, not"),
        (12, 2, {"methods": ["hats"]}, "begun with other threshold methods; use another folder"),
        (12, 2, None, "has scenes of a study, but no study.json; use another folder"),
    ],
)
def test_another_study_in_the_folder_is_refused(tmp_path, worked_on, scenes, seed, changed, message):
    run(tmp_path, 12)
    about = tmp_path / "study.json"
    if changed is None:
        about.unlink()
    else:
        about.write_text(json.dumps(json.loads(about.read_text()) | changed))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.*") if path.is_file() and path.name != ".lock"}
    with pytest.raises(UserError, match=message):
        run(tmp_path, scenes, seed)
    assert {path: path.read_bytes() for path in before} == before


def test_one_program_at_a_time(tmp_path, worked_on):
    lock = FolderLock(tmp_path)
    with pytest.raises(UserError, match="is at work on the study in it"):
        run(tmp_path, 4)
    lock.release()
    run(tmp_path, 4)


@pytest.mark.parametrize(
    ("code", "message"), [("other", "a different version of dockpose"), (None, "scene 0: a worker did not send all of")]
)
def test_a_worker_of_another_version_or_that_breaks_off_is_refused(tmp_path, worked_on, monkeypatch, code, message):
    monkeypatch.setattr(module, "scene_text", lambda *scene: (code or module.code_print(), ""))
    with pytest.raises(UserError, match=message):
        run(tmp_path, 1)
    assert not Study(tmp_path, 1, 2).done
