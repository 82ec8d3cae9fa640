"""The check of stuck frequencies on the full model: once for the same sets of the same bodies."""

import json

import pytest

from tests.tipdamp import corner_study
from tipdamp.bodies import check
from tipdamp.cli import main

TUNED = ("[respond]", '[tune]\nstations = "all"\n[respond]')


@pytest.fixture
def checked(monkeypatch, tmp_path):
    """checked(*changes): figures of the check, and how many checks were made so far."""
    made, real = [], check.full_stuck_sets
    monkeypatch.setattr(check, "_latest", {})
    monkeypatch.setattr(check, "full_stuck_sets", lambda *a: made.append(0) or real(*a))

    def run(*changes):
        study = corner_study.write(tmp_path, change=[TUNED, *changes])
        for verb in ("reduce", "preload", "tune"):
            assert main([verb, str(study), "--quiet"]) == 0
        found = json.loads((tmp_path / "results" / "corner" / "tune.json").read_text())
        return found["full_model_check"], len(made)

    return run


@pytest.mark.slow
def test_pull_and_friction_change_no_stuck_mode(checked):
    first, made = checked()
    assert made == 1
    assert checked(("pull = 10", "pull = 20"), ("mu = 0.3", "mu = 0.4")) == (first, 1)


@pytest.mark.slow
@pytest.mark.parametrize("change", [("kn = 1e6", "kn = 2e6"), ("E = 207e9", "E = 200e9")])
def test_other_contacts_or_bodies_are_checked_anew(checked, change):
    first, _ = checked()
    other, made = checked(change)
    assert made == 2 and other["tuned"]["full_hz"] != first["tuned"]["full_hz"]


def test_only_the_latest_are_kept(monkeypatch):
    monkeypatch.setattr(check, "_latest", {})
    monkeypatch.setattr(check, "_check", lambda *_: {})
    for reduced in "abcdef":
        check.full_model_check(None, None, reduced, None, {}, lambda *_: None)
    assert len(check._latest) == check.LATEST
