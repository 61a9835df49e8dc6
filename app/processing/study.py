"""The study's scenes by several processes or on a cluster, each kept in a file, so that a killed run can go on."""

import csv
import functools
import hashlib
import io
import itertools
import json
import os
from collections.abc import Callable, Iterator
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import dockpose
from dockpose.app.errors import UserError, writing
from dockpose.app.experiment.lock import FolderLock, InUseError
from dockpose.app.experiment.record import csv_text
from dockpose.app.processing.parallel import workers
from dockpose.app.resources import versions
from dockpose.files import remove_temporaries, sync_folder, write_whole
from dockpose.study.judge import ELAPSED, as_text, methods, scene_rows

_ABOUT, _SCENES, STUDY_CSV, COST_CSV = "study.json", "scenes", "study.csv", "cost.csv"
_COST = ("scene", "method", "width_px", "height_px", ELAPSED)
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Study:
    """A study in a folder."""

    folder: Path
    scenes: int
    seed: int  # of all that is random in them

    def run(self, jobs: int, scheduler: str | None, done: Callable[[int], None]) -> None:
        """Work on what is left, then write ``study.csv`` and ``cost.csv``; ``done`` hears how many scenes are done."""
        with writing(f"--out {self.folder}"):
            (self.folder / _SCENES).mkdir(parents=True, exist_ok=True)
            try:
                lock = FolderLock(self.folder)
            except InUseError as error:
                raise UserError(f"--out {self.folder}: {error} is at work on the study in it") from error
            try:
                self._begin()
                self._work(jobs, scheduler, done)
                self._assemble()
            finally:
                lock.release()

    @property
    def done(self) -> set[int]:
        """The scenes that are done."""
        names = (path.stem for path in (self.folder / _SCENES).glob("*.csv"))
        return {int(name) for name in names if name.isdecimal()}

    def _begin(self) -> None:
        """Check that what is in the folder belongs to this study, and note what it is."""
        remove_temporaries(self.folder)
        remove_temporaries(self.folder / _SCENES)
        about = {"seed": self.seed, "scenes": self.scenes, "code": code_print(), "versions": versions()}
        about["methods"] = methods()
        path, why = self.folder / _ABOUT, ""
        if path.exists():
            why = _differs(json.loads(path.read_text(encoding="utf-8")), about)
        elif self.done:
            why = f"has scenes of a study, but no {_ABOUT}; "
        if why:
            raise UserError(f"--out {self.folder}: {why}use another folder")
        write_whole(path, (json.dumps(about, indent=1) + "\n").encode())
        sync_folder(self.folder)

    def _work(self, jobs: int, scheduler: str | None, done: Callable[[int], None]) -> None:
        """Work on what is left."""
        kept = self.done
        done(len(kept))
        if len(kept) == self.scenes:
            return
        # Idle threads of the workers' linear algebra would take the cores from each other.
        os.environ |= dict.fromkeys(_THREADS, "1")
        todo = [scene for scene in range(self.scenes) if scene not in kept]
        with workers(jobs, scheduler) as (executor, _):
            waiting = {executor.submit(scene_text, self.seed, scene): scene for scene in todo}
            for number, future in enumerate(as_completed(waiting), start=1):
                scene, (code, text) = waiting.pop(future), future.result()
                if code != code_print():
                    raise UserError("a worker runs a different version of dockpose; all must run the same")
                if text.count("\n") != 1 + len(methods()):
                    raise UserError(f"scene {scene}: a worker did not send all of its rows")
                write_whole(self._path(scene), text.encode())
                sync_folder(self.folder / _SCENES)
                done(len(kept) + number)

    def _path(self, scene: int) -> Path:
        return self.folder / _SCENES / f"{scene:06d}.csv"

    def _assemble(self) -> None:
        """Write the rows of all scenes, none of which may have gone since, and apart from them what was timed."""
        of_study = [column for column in next(self._rows()) if column != ELAPSED]
        for name, columns in ((COST_CSV, _COST), (STUDY_CSV, of_study)):
            rows = ([row[column] for column in columns] for row in self._rows())
            write_whole(self.folder / name, csv_text(itertools.chain([columns], rows)).encode())
        sync_folder(self.folder)

    def _rows(self) -> Iterator[dict[str, str]]:
        for scene in range(self.scenes):
            yield from csv.DictReader(io.StringIO(self._path(scene).read_text(encoding="utf-8")))


def scene_text(seed: int, scene: int) -> tuple[str, str]:
    """Work on a scene: the print of the code that did, and the rows as CSV. Runs in a worker."""
    cv2.setNumThreads(1)
    rows = scene_rows(seed, scene)
    return code_print(), csv_text([[*rows[0]], *([as_text(value) for value in row.values()] for row in rows)])


@functools.cache
def code_print() -> str:
    """A print of the library's code, which differs where a study might give other numbers."""
    folder = Path(dockpose.__file__).parent
    paths = [path for kind in ("*.py", "*.csv") for path in folder.rglob(kind)]
    total = hashlib.sha256()
    for name, path in sorted((path.relative_to(folder).as_posix(), path) for path in paths):
        if not name.startswith("app/"):
            total.update(name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


def _differs(there: dict[str, Any], ours: dict[str, Any]) -> str:
    """Why a folder's study cannot go on as ours; empty where it can."""
    if there.get("seed") != ours["seed"]:
        return f"has a study with the seed {there.get('seed')}, not {ours['seed']}; "
    if (scenes := there.get("scenes", 0)) > ours["scenes"]:
        return f"has a study of {scenes} scenes, more than {ours['scenes']}; give --scenes {scenes} or more, or "
    before, now = there.get("versions", {}), ours["versions"]
    if changed := [f"{name} {before.get(name)}, not {now[name]}" for name in now if before.get(name) != now[name]]:
        return f"its study was begun with {'; '.join(changed)}; "
    if there.get("code") != ours["code"]:
        return "its study was begun with other code of dockpose; "
    return "" if there.get("methods") == ours["methods"] else "its study was begun with other threshold methods; "
