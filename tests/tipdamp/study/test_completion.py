"""A shell completes verbs, options, keys and study files by what `tipdamp completion` prints."""

import shutil
import subprocess

import pytest

from tipdamp.cli import main


@pytest.fixture
def completed(tmp_path, capsys):
    if shutil.which("bash") is None:
        pytest.skip("needs bash")
    main(["completion"])
    (tmp_path / "script").write_text(capsys.readouterr().out)
    for name in ("blade.toml", "blade.msh", "notes.txt"):
        (tmp_path / name).touch()

    def of(*words):
        line = f"COMP_WORDS=(tipdamp {' '.join(map(repr, words))}); COMP_CWORD={len(words)}"
        command = f'source ./script; {line}; _tipdamp; printf "%s\\n" "${{COMPREPLY[@]}}"'
        done = subprocess.run(
            ["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return done.stdout.split()

    return of


def test_verbs_options_keys_and_files(completed):
    assert {"inspect", "init"} <= set(completed("in"))
    assert completed("respond", "--jo") == ["--jobs"]
    assert "contact.mu" in completed("explain", "contact.m")
    assert sorted(completed("run", "bl")) == ["blade.msh", "blade.toml"]
    assert completed("run", "no") == []
