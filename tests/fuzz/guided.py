"""Inputs that coverage guides, by atheris: ``python -m tests.fuzz.guided camera --inputs 20000 --counted FILE``.

What reaches code that none reached before is changed further. Atheris ends the process itself, at the first escape or
after so many inputs, so that how many there were is kept in a file.
"""

import argparse
import importlib
import inspect
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

atheris: Any = importlib.import_module("atheris")  # there is none for every Python

with atheris.instrument_imports(include=["yaml"]):
    from tests.fuzz.run import MOST_S, corpus_of, judge
    from tests.fuzz.targets import TARGETS

# Of our own modules those that read; what numba compiles must stay as it is.
_READERS = re.compile(
    r"dockpose\.(checks|dock|camera\.(camera|files)|files|app\.(inputs|experiment|export\.(bundle|data|rows))\b)"
)
_MOST_S = 20 * MOST_S  # code that counts what it reaches takes some twenty times as long


def _instrument_readers() -> None:
    for name, module in list(sys.modules.items()):
        if _READERS.match(name):
            for each in vars(module).values():
                if inspect.isfunction(each) and each.__module__ == name:
                    atheris.instrument_func(each)


class EscapedError(Exception):
    """What a target made of an input was no refusal."""


def main() -> None:
    """Run one target; the exit status is not 0 where an input escaped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--inputs", type=int, required=True)
    parser.add_argument("--counted", type=Path, required=True, help="file for the number of inputs")
    arguments = parser.parse_args()
    _instrument_readers()
    target, count = TARGETS[arguments.target], 0

    def take(data: bytes) -> None:
        nonlocal count
        count += 1
        if count % 100 == 0 or count == arguments.inputs:
            arguments.counted.write_text(str(count))
        wrong = judge(target, data, _MOST_S)
        if wrong:
            raise EscapedError(wrong)

    Path("build/fuzz").mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for number, data in enumerate([*target.seeds(), *(path.read_bytes() for path in corpus_of(arguments.target))]):
            (Path(folder) / str(number)).write_bytes(data)
        atheris.Setup(
            [
                sys.argv[0],
                f"-runs={arguments.inputs}",
                "-max_len=1000",  # code that counts what it reaches is slow
                "-seed=1",
                "-artifact_prefix=build/fuzz/",
                folder,
            ],
            take,
        )
        atheris.Fuzz()


if __name__ == "__main__":
    main()
