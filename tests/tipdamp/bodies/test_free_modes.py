"""Which free mode is out of phase and which in phase: two different modes of both blades, or none
is named."""

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tipdamp.bodies import free_modes
from tipdamp.bodies.free_modes import band, band_warnings, named_modes, tracking_warnings
from tipdamp.cli import main
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import AreaStep, KeptArea, OfSets, TuneResult
from tipdamp.study.study import load_study

ONE, TWO = np.eye(2)

TUNED = [("[respond]", '[tune]\nstations = "all"\n[respond]')]


def two_blades(coupling, mistuning=0.05, second=1.0):
    """Two masses of 1 kg on 1 N/m (the second's 5 % stiffer), joined by a spring; `second` scales
    blade two's motion at its patch."""
    K = np.diag([1.0, 1.0 + mistuning]) + coupling * np.array([[1, -1], [-1, 1]])
    model = ReducedModel.from_matrices(
        np.eye(2),
        K,
        body=["blades"] * 2,
        node=[1, 2],
        direction=["x"] * 2,
        position=np.zeros((2, 3)),
        groups={},
        loads={},
    )
    return named_modes(model, ONE, second * TWO)


@pytest.mark.parametrize("second", [1.0, 0.2])
def test_coupled_blades_have_one_mode_of_each_kind(second):
    """Strong coupling: in phase at sqrt(1.025 +- small), out of phase above it. The patch may lie
    lower on one."""
    found = two_blades(1.0, second=second)
    # eigenvalues of [[2, -1], [-1, 2.05]]: 2.025 -+ sqrt(1 + 0.025^2)
    exact = np.sqrt(2.025 + np.array([1, -1]) * np.sqrt(1 + 0.025**2)) / (2 * np.pi)
    assert [found.named[n] for n in ("out_of_phase", "in_phase")] == pytest.approx(exact, rel=1e-12)
    assert found.warnings == []
    out, together = (found.follow[n] for n in ("out_of_phase", "in_phase"))
    assert out[0] * out[1] < 0 < together[0] * together[1]


@pytest.mark.parametrize("coupling", [0.0, 1e-4])
def test_weakly_coupled_blades(coupling):
    """One mode would bear both names, or each mode moves one blade alone: no names, a warning, and
    what is followed is the difference or the sum of the two blades' own motions."""
    found = two_blades(coupling)
    assert found.named == {}
    assert "no free mode involves both blades (lowest: 0.2, 0.2 Hz)" in found.warnings[0]
    for name, sign in (("out_of_phase", -1), ("in_phase", 1)):
        assert np.abs(found.follow[name]) == pytest.approx([np.sqrt(0.5)] * 2, rel=1e-2)
        assert np.sign(found.follow[name].prod()) == sign


@pytest.mark.parametrize("seed", range(4))
def test_blades_of_equal_bending_stiffness(seed, monkeypatch):
    """Two equal square blades that stand alone: four modes of one frequency. Whatever mixture of
    them a solver returns, followed are the sum and the difference of what moves the patches."""
    random = np.random.default_rng(seed)

    def any_mixture(K, M, **_):
        return np.ones(4), np.linalg.qr(random.normal(size=(4, 4)))[0]

    monkeypatch.setattr(free_modes, "eigh", any_mixture)
    square = ReducedModel.from_matrices(
        np.eye(4),
        np.eye(4),
        body=["blades"] * 4,
        node=[1, 1, 2, 2],
        direction=["x", "y"] * 2,
        position=np.zeros((4, 3)),
        groups={},
        loads={},
    )
    one, two = np.array([0.6, 0.8, 0, 0]), np.array([0, 0, 0, 2.0])
    found = named_modes(square, one, two)
    assert found.named == {} and "4 free modes have the same frequency" in found.warnings[0]
    for name, sign in (("out_of_phase", -1), ("in_phase", 1)):
        assert found.follow[name] == pytest.approx((one + sign * two / 2) / np.sqrt(2), abs=1e-14)


def test_default_band_lies_around_the_two_modes():
    found = two_blades(1.0)
    assert band((1.0, 2.0), found) == (1.0, 2.0)
    low, high = band(None, found)
    assert low < min(found.pair) and high > max(found.pair)
    assert band_warnings((low, high), found) == []
    assert "[free] band = 1 to 2 Hz contains no resonance" in band_warnings((1.0, 2.0), found)[0]


def test_reduce_and_tune_warn_in_the_terminal(tmp_path, capsys):
    """The cubes of the corner stand on their own: at reduce no mode is named, on the screen and in
    the report."""
    path = corner_study.write(
        tmp_path,
        change=[("[respond]", "[tune]\nstations = [1, 1]\n[free]\nband = [10, 20]\n[respond]")],
    )
    assert main(["reduce", str(path), "--quiet"]) == 0
    out = capsys.readouterr().out
    assert (
        "warning: no free mode involves both blades" in out
        and "out of phase " not in out.splitlines()[0]
    )
    assert "warning: [free] band = 10 to 20 Hz contains no resonance" in out
    assert main(["preload", str(path), "--quiet"]) == main(["tune", str(path), "--quiet"]) == 0
    assert main(["inspect", str(path), "--quiet"]) == 0


def test_warnings_of_the_tracked_mode(tmp_path):
    study = load_study(corner_study.write(tmp_path, change=TUNED))  # band 20 to 40 kHz

    def found(mac, hz, whole=0.9):
        sets = {"full_area": 3e4, "full_line": 3e4, "tuned": hz}
        pairs = OfSets(full_area=9, full_line=6, tuned=4)
        tune = TuneResult.model_construct(
            closed_pairs=pairs,
            open_pairs=pairs,
            stuck_hz=OfSets(**sets),
            mac=OfSets(full_area=whole, full_line=0.8, tuned=mac),
            stuck_modes_hz=OfSets(full_area=(), full_line=(), tuned=(25e3, 26e3)),
        )
        return tracking_warnings(study, tune)

    assert [w[:73] for w in found(0.49, 3e4)] == [
        "the tracked mode, stuck on the kept stations (30000 Hz), has a MAC of 0.4"
    ]
    (both,) = found(0.32, 3e4, whole=0.32)
    assert "stuck on the whole area and on the kept stations (30000 Hz), has a MAC of 0.32" in both
    assert len(found(0.32, 3.1e4, whole=0.32)) == 2
    assert (
        "lies outside [respond] band = 20000 to 40000 Hz, where there are stuck modes at "
        "25000.0, 26000.0 Hz" in found(0.9, 5e4)[0]
    )


def test_a_tracked_mode_that_becomes_another_one_is_told(tmp_path):
    """Shares of the area below that of the jump, and steep parts of one mode, are not."""
    study = load_study(corner_study.write(tmp_path, change=TUNED))
    steps = (
        (1.0, 5e4, 0.55),
        (0.5, 4.9e4, 0.5),
        (0.4, 3e4, 0.6),
        (0.2, 2.5e4, 0.9),
        (0.1, 1e4, 0.5),
    )

    def found(share):
        history = [AreaStep(share=s, hz=hz, mac=mac) for s, hz, mac in steps]
        tune = TuneResult.model_construct(
            area=KeptArea.model_construct(share=share, history=history),
            closed_pairs=(pairs := OfSets(full_area=9, full_line=9, tuned=4)),
            open_pairs=pairs,
            stuck_hz=OfSets(full_area=5e4, full_line=5e4, tuned=2.6e4),
            mac=OfSets(full_area=0.55, full_line=0.55, tuned=0.9),
            stuck_modes_hz=OfSets(full_area=(), full_line=(), tuned=(2.6e4,)),
        )
        return tracking_warnings(study, tune)

    (said,) = found(0.2)
    assert "out-of-phase" in said and said.count("from") == 1
    assert "from 49000 to 30000 Hz (MAC 0.50 and 0.60) between 50 and 40 % of it" in said
    assert found(0.5) == []
