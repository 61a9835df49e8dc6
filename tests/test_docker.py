"""What the Dockerfile says, read without Docker; tests/bench/bench_docker.py tries its commands."""

import ast
import fnmatch
import json
import shlex
import tomllib
from pathlib import Path

from dockpose import __version__
from dockpose.app.cli import _parser
from dockpose.app.commands.serve import of_environment
from dockpose.sources import Kind, kind_of

from tests.support.container import environment, instructions, of

ROOT = Path(__file__).resolve().parents[1]


def test_both_stages_are_slim_and_of_a_python_that_we_name():
    bases = [one.words[0] for one in instructions() if one.name == "FROM"]
    assert len(bases) == 2
    assert len(set(bases)) == 1
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    version = bases[0].removeprefix("python:").removesuffix("-slim")
    assert f"Programming Language :: Python :: {version}" in project["classifiers"]


def test_it_runs_as_nobody_special_after_all_that_needs_rights():
    (user,) = of("USER", 1)
    number, group = user.words[0].split(":")
    assert int(number) > 0
    assert int(group) > 0
    (made,) = of("RUN", 1)
    assert f"--uid {number}" in made.text
    last = [one.name for one in instructions() if one.stage == 1]
    assert last.index("USER") > last.index("RUN")


def test_all_that_is_written_goes_into_the_volume_or_the_temporary_folder():
    (volume,) = of("VOLUME", 1)
    (folder,) = of("WORKDIR", 1)
    assert volume.words == folder.words == ["/data"]
    variables = environment(1)
    for name in ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "XDG_CONFIG_HOME"):
        assert variables[name].startswith(("/tmp/", "/data/")), name
    assert variables["PYTHONDONTWRITEBYTECODE"] == "1"
    (command,) = of("CMD", 1)
    assert command.words[command.words.index("--sessions") + 1].startswith("/data/")


def test_the_command_is_one_of_ours_on_the_port_that_is_exposed():
    (command,), (port,) = of("CMD", 1), of("EXPOSE", 1)
    arguments = _parser("serve").parse_args(command.words)
    assert arguments.command == "serve"
    assert str(arguments.port) == port.words[0]
    assert arguments.host == "0.0.0.0"
    *_, built = of("RUN", 0)
    assert _parser("estimate").parse_args(built.words[1:]).command == "estimate"


def test_what_was_compiled_is_where_the_start_looks_for_it():
    (start,) = of("ENTRYPOINT", 1)
    assert start.words[:2] == ["sh", "-c"]
    baked, used = environment(0)["NUMBA_CACHE_DIR"], environment(1)["NUMBA_CACHE_DIR"]
    assert f"cp -R {baked} {Path(used).parent}/" in start.words[2]
    assert Path(baked).name == Path(used).name
    assert 'exec dockpose "$@"' in start.words[2]


def test_the_health_check_is_a_program_that_asks_the_exposed_port():
    (check,), (port,) = of("HEALTHCHECK", 1), of("EXPOSE", 1)
    program, option, code = check.words
    assert (program, option) == ("python", "-c")
    ast.parse(code)
    assert f"'127.0.0.1', {port.words[0]}" in code
    assert f"{environment(1)['XDG_CONFIG_HOME']}/dockpose/token-{port.words[0]}" in code
    assert "/alive" in code


def labels():
    (label,) = of("LABEL", 1)
    return dict(word.split("=", 1) for word in shlex.split(label.text))


def test_the_labels_are_those_that_blueos_asks_for():
    found = labels()
    names = {"version", "permissions", "authors", "company", "type", "readme", "links", "requirements"}
    assert set(found) == names
    assert found["version"] == __version__
    assert all(isinstance(json.loads(found[name]), dict) for name in ("company", "links", "permissions"))
    assert json.loads(found["authors"])[0]["name"]


def test_as_an_extension_it_has_the_network_and_one_volume_and_no_more_rights():
    """A volume of Docker's own takes its owner from the image; a folder of the vehicle's would be root's."""
    permissions = json.loads(labels()["permissions"])
    (volume,) = of("VOLUME", 1)
    assert set(permissions) == {"HostConfig", "Env"}
    assert permissions["HostConfig"] == {"NetworkMode": "host", "Binds": [f"dockpose:{volume.words[0]}"]}


def test_its_settings_are_options_of_the_page():
    variables = dict(one.split("=", 1) for one in json.loads(labels()["permissions"])["Env"])
    (command,) = of("CMD", 1)
    arguments = _parser("serve").parse_args(["serve", *of_environment(variables), *command.words[1:]])
    assert arguments.allow_frame == ["http://blueos.local", "http://192.168.2.2"]
    assert arguments.allow_host == ["blueos.local"]
    assert arguments.resume
    assert kind_of(variables["DOCKPOSE_SOURCE"]) is Kind.STREAM


def test_the_build_gets_what_the_package_is_made_of_and_nothing_else():
    lines = [line for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines() if line[:1] != "#"]
    assert lines[0] == "*"
    kept = {line[1:] for line in lines if line.startswith("!")}
    assert all((ROOT / name).exists() for name in kept)
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    needed = {path.split("/")[0] for path in tool["tool"]["setuptools"]["package-dir"].values()}
    needed |= {"pyproject.toml", tool["project"]["readme"], *tool["project"]["license-files"]}
    assert kept == needed
    assert not any(fnmatch.fnmatch(name, line) for name in kept for line in lines[1:] if line[:1] != "!")
