"""Stage respond with harmonics = "auto": two curves of each level or one, which follow from what is
stored."""

import re

import numpy as np
import pytest

from tests.tipdamp.rig_study import CHAIN
from tests.tipdamp.rig_study import run_chain as run
from tipdamp.checks import room
from tipdamp.cli import main
from tipdamp.engine import curves
from tipdamp.engine.store import Store
from tipdamp.hbm.curve.enough_harmonics import error_of
from tipdamp.hbm.memory import curve_bytes
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.result import ForcedResponse
from tipdamp.stages.assembly import assembled
from tipdamp.study.study import load_study

AUTO = CHAIN.replace(
    "levels = [5]\nharmonics = [1]", 'levels = [5, 20, 30]\nharmonics = "auto"\nsearch = 0'
)


@pytest.fixture
def study(matrices_study):
    matrices_study.write_text(AUTO)
    return matrices_study


def found(study):
    """What is said of the curves, but for the time that they took, and the store."""
    store = Store(study.parent / "results" / "study")
    responses = store.read_json("respond.json")["responses"]
    for one in responses:
        one["seconds"] = None
        one["back"] = one["back"] and one["back"] | {"seconds": None}
    return responses, store


def changed(study, old, new):
    assert old in study.read_text()
    study.write_text(study.read_text().replace(old, new))


@pytest.mark.slow
def test_each_level_has_what_it_needs(study, made):
    """The same number of harmonics and the same curve as from Python; further curves are looked for
    where the tolerance is met alone; one that exists is not made again."""
    changed(study, "search = 0", "search = 0.05")
    assert run(study) == 0
    first = list(made)
    responses, store = found(study)
    shared = assembled(load_study(study), store).curves
    for one in responses:
        direct = follow_band(
            shared.problem,
            one["Fe_N"] * shared.force,
            (900, 1400),
            outputs=shared.rows,
            harmonics="auto",
            tolerance=1e-3,
            peaks=shared.peaks,
        )
        kept = ForcedResponse.load(store.path(one["file"]))
        assert direct.H == one["H"] == one["tried"][-1]["H"] and one["within_tolerance"]
        assert np.array_equal(direct.harmonics, kept.harmonics)
        assert one["tried"][-1]["error"] == error_of(kept) <= 1e-3
        assert all(less["error"] > 1e-3 for less in one["tried"][:-1])
        assert "looked for" in one["searched"] and one["alike_backwards"]
    # where 3 are not enough the points of that curve tell how many are
    assert [len(one["tried"]) for one in responses] == [1, 2, 2]
    assert sorted(first) == sorted(
        name
        for one in responses
        for name in [f"Fe_{one['Fe_N']:g}N_H{t['H']}" for t in one["tried"]]
    )
    made.clear()
    assert run(study) == 0 and not made
    changed(study, '"auto"', '"auto"\ntolerance = 1e-4')
    assert run(study) == 0
    tighter, _ = found(study)
    assert not set(made) & set(first) and all(
        b["H"] > a["H"] for a, b in zip(responses[1:], tighter[1:], strict=True)
    )


@pytest.mark.slow
def test_jobs_do_not_change_it(study):
    """Two and three, each with one BLAS thread."""
    assert run(study, "--jobs", "2") == 0
    two, _ = found(study)
    assert run(study, "--jobs", "3", "--force") == 0
    assert found(study)[0] == two


@pytest.mark.slow
def test_interrupted_it_goes_on(study, made, monkeypatch):
    assert run(study) == 0
    whole, every = found(study)[0], list(made)
    made.clear()
    real = curves.Curves._make_curve

    def stopped(self, case, progress):
        if len(made) == 4:
            raise KeyboardInterrupt
        real(self, case, progress)

    monkeypatch.setattr(curves.Curves, "_make_curve", stopped)
    assert main(["respond", str(study), "--quiet", "--force"]) == 130
    assert len(made) == 4
    monkeypatch.setattr(curves.Curves, "_make_curve", real)
    assert run(study) == 0
    assert found(study)[0] == whole and sorted(made) == sorted(every)


@pytest.mark.slow
def test_a_tolerance_that_no_number_meets(study, capsys):
    """The curve of most harmonics, marked, and what was tried."""
    changed(study, "levels = [5, 20, 30]", "levels = [20]\nboth_ways = false")
    changed(study, '"auto"', '"auto"\ntolerance = 1e-13')
    assert run(study) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert re.search(
        r"harmonics = 'auto': the tolerance 1e-13 is not met at Fe = 20 N, the estimated error is "
        r"\S+ with H = 3, .* with H = 45; accept a larger tolerance",
        said,
    )
    ((one,), _) = found(study)
    assert one["H"] == 45 and one["within_tolerance"] is False


@pytest.mark.slow
def test_few_harmonics_are_told_once(study, capsys):
    """With a number: one sentence with the levels whose peak misses the tolerance, and the
    remedy; silent where the study accepts it."""
    changed(study, '"auto"', "1")
    assert run(study) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert len(re.findall("above the tolerance", said)) == 1
    assert re.search(
        r"with H = 1 the estimated error of the peak is above the tolerance 0\.001 at Fe = 30 N "
        r"\(\S+ on \S+\): set \[respond\] harmonics = \"auto\", or accept it with a larger "
        r"tolerance",
        said,
    )
    (_, _, one), _ = found(study)
    assert one["within_tolerance"] is None and one["truncation"] > 1e-3 and not one["tried"]
    changed(study, "harmonics = 1", "harmonics = 1\ntolerance = 0.1")
    assert run(study) == 0 and "above the tolerance" not in capsys.readouterr().out


@pytest.mark.slow
def test_no_room_for_more_harmonics(study, made, monkeypatch, capsys):
    """Refused before the curve that would not fit, with what would; what is finished stays."""
    changed(study, "levels = [5, 20, 30]", "levels = [30]")
    monkeypatch.setattr(room, "SMALL", 0.0)
    monkeypatch.setattr(room, "available_bytes", lambda: 1.01 * curve_bytes(4, 4, 3, 3))
    assert run(study) == 2 and made == ["Fe_30N_H3"]
    assert re.search(
        r"a curve may need .* set \[respond\] harmonics to 3 or less", capsys.readouterr().err
    )
    made.clear()
    changed(study, '"auto"', "3")
    assert run(study) == 0 and made == []
