import builtins
import shutil
import subprocess

import pytest
from dockpose.app.cli import COMMANDS, main

pytest.importorskip("shtab")
BASH = shutil.which("bash")


@pytest.fixture
def script(tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    path = tmp_path / "completion.bash"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    return path


def completed(script, *words):
    """What bash offers after these words, the last of which is being typed."""
    quoted = " ".join(f"'{word}'" for word in words)
    program = f"""
        source {script}
        function=$(complete -p dockpose | sed 's/.*-F \\([^ ]*\\).*/\\1/')
        COMP_WORDS=({quoted}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
        $function dockpose "${{COMP_WORDS[COMP_CWORD]}}" "${{COMP_WORDS[COMP_CWORD - 1]}}"
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(
        ["bash", "-c", program], cwd=script.parent, capture_output=True, text=True, timeout=120, check=True
    )
    return [one.strip() for one in done.stdout.split()]


@pytest.mark.skipif(BASH is None, reason="needs bash")
def test_bash_completes_commands_options_choices_and_files(script):
    (script.parent / "tank.png").touch()
    assert completed(script, "dockpose", "est") == ["estimate"]
    assert set(completed(script, "dockpose", "")) >= set(COMMANDS)
    assert completed(script, "dockpose", "estimate", "--met") == ["--method"]
    assert completed(script, "dockpose", "estimate", "--method", "ot") == ["otsu"]
    assert "tank.png" in completed(script, "dockpose", "estimate", "tan")
    assert "tank.png" in completed(script, "dockpose", "estimate", "--camera", "tan")


@pytest.mark.parametrize("shell", ["zsh", "tcsh"])
def test_other_shells_get_a_script_of_their_own(shell, capsys):
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    assert "estimate" in text
    assert "learn-dock" in text
    assert ("compdef" if shell == "zsh" else "complete dockpose") in text


def test_without_shtab_it_is_said_how_to_get_it(monkeypatch, capsys):
    real = builtins.__import__

    def without(name, *rest, **more):
        if name == "shtab":
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    assert main(["completion", "bash"]) == 2
    assert capsys.readouterr().err == "dockpose: completion needs shtab: pip install 'dockpose[completion]'\n"
