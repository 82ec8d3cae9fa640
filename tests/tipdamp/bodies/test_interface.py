"""The interface reduction of a study: when it is made, what is said of it, and the same curve as on
all dofs."""

import numpy as np
import pytest

from tests.benchmarks.hundreds import face_to_face, loosened
from tests.conftest import changed
from tipdamp.bodies import interface
from tipdamp.checks.pairs import pair_names
from tipdamp.engine.curves import CurveCase
from tipdamp.engine.store import Store
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band
from tipdamp.stages.assembly import assembled
from tipdamp.stages.curve_facts import curve_result
from tipdamp.study.study import load_study

PAIRS, BAND = 48, (1700.0, 2200.0)
TEXT = """[model]
matrices = "model.npz"
pull = 10
[contact]
pairs = "kept.csv"
[contact.face]
shape = "flat"
width = 0.01
[tune]
stations = "all"
[respond]
excitation = "all"
share_force = true
direction = [0, 1, 0]
patches = ["one", "two"]
levels = [5]
harmonics = [3]
band = [1700, 2200]
damping_ratio = 0.01
"""


@pytest.fixture
def study_of(tmp_path):
    """What makes (study, store) of further keys of [respond], with what the stages before would
    have left."""
    arrays, pairs, push = face_to_face(PAIRS)
    arrays["body"] = np.where(arrays["body"] == "blade", "blades", "damper")
    groups = {"blades/all": np.arange(1, PAIRS + 1), "blades/one": [1], "blades/two": [PAIRS]}
    ReducedModel.from_matrices(**arrays, groups=groups, loads={"pull": push}).save(
        tmp_path / "model.npz"
    )
    pairs.replace(blade_body=np.full(PAIRS, "blades")).save(tmp_path / "kept.csv")

    def write(keys="", *changes, loose=False):
        if loose:
            free = arrays | {"K": loosened(arrays["K"], PAIRS)}
            ReducedModel.from_matrices(**free, groups=groups, loads={"pull": push}).save(
                tmp_path / "model.npz"
            )
        (tmp_path / "faces.toml").write_text(changed(TEXT, *changes) + keys)
        return load_study(tmp_path / "faces.toml"), Store(tmp_path)

    return write


def curve_and_facts(study, store, band=BAND):
    assembly = assembled(study, store)
    problem, case = assembly.curves.problem, CurveCase(5.0, 3, band)
    curve = follow_band(
        problem,
        case.Fe_N * assembly.curves.force,
        band,
        harmonics=case.H,
        outputs=assembly.curves.rows,
    )
    found = curve_result(study.respond, assembly.kept, problem, case, (curve,))
    names = pair_names(assembly.kept, slice(None))
    return found, interface.facts_of(study, assembly.interface, [found], names)


def test_the_curve_of_all_dofs(study_of):
    whole, none = curve_and_facts(*study_of())
    few, facts = curve_and_facts(*study_of('interface = "reduced"\nfollowed = 12\n'))
    assert none is None and (facts.pairs, facts.dofs, facts.followed) == (PAIRS, 6 * PAIRS, 12)
    assert facts.shapes < facts.dofs / 2 and not list(interface.doubts(facts))
    assert few.peak_m == pytest.approx(whole.peak_m, rel=1e-4) and few.peak_hz == pytest.approx(
        whole.peak_hz, rel=1e-5
    )
    assert few.slipping_pairs == whole.slipping_pairs and len(few.slipping_pairs) >= 6
    assert f"48 pairs in {facts.shapes} shapes for 288 dofs" in interface.in_words(facts)


def test_pairs_that_slip_unfollowed_are_named(study_of):
    few, facts = curve_and_facts(*study_of('interface = "reduced"\nfollowed = 3\n'))
    assert len(facts.not_followed) == len(few.slipping_pairs) - 3
    (said,) = interface.doubts(facts)
    assert facts.not_followed[0] in said and "raise [respond] followed above 3" in said


def test_when_it_is_made(study_of, monkeypatch):
    """By itself above a number of pairs; not where it makes nothing smaller, which is said, nor
    against the wish."""
    assert assembled(*study_of()).interface is None
    monkeypatch.setattr(interface, "CHOICE", interface.Choice(whole=PAIRS - 1))
    study, store = study_of("followed = 12\n")
    made, again = (assembled(study, store) for _ in range(2))
    assert made.interface is not None
    # a curve that was interrupted goes on where it was
    assert made.curves.key(CurveCase(5.0, 3, BAND)) == again.curves.key(CurveCase(5.0, 3, BAND))
    assert assembled(*study_of('followed = 12\ninterface = "whole"\n')).interface is None
    study, store = study_of('interface = "reduced"\n')
    assert assembled(study, store).interface is None
    assert "makes nothing smaller" in next(
        interface.doubts(interface.facts_of(study, None, (), ()))
    )


@pytest.mark.parametrize("hold", ['"y"', '{ motion = "y", mean = true }'])
def test_beside_a_hold(study_of, hold):
    """The curve, the force on what holds and the linear response are those of all dofs."""
    found = []
    for kind in ("whole", "reduced"):
        study, store = study_of(
            f'interface = "{kind}"\nfollowed = 12\n',
            ("pull = 10", f"pull = 10\nhold = {hold}"),
            ("[1700, 2200]", "[700, 1100]"),
            loose=True,
        )
        found.append((*curve_and_facts(study, store, (700.0, 1100.0)), assembled(study, store)))
    (whole, _, all_dofs), (few, facts, shapes) = found
    # written once, and the same for the stages behind
    assert (
        interface.keep_shapes(store, None) == []
        and len(interface.keep_shapes(store, shapes.interface)) == 2
    )
    again = assembled(study, store, responded=True)
    assert again.curves.key(CurveCase(5.0, 3, BAND)) == shapes.curves.key(CurveCase(5.0, 3, BAND))
    assert (
        again.interface.basis == shapes.interface.basis
    ).all() and again.interface.followed.sum() == 12
    assert facts.shapes < facts.dofs / 2 and shapes.interface is not None
    assert few.peak_m == pytest.approx(whole.peak_m, rel=1e-4) and few.held_change == pytest.approx(
        whole.held_change, rel=0.01, abs=1e-9
    )
    (mine,), (its,) = few.held.values(), whole.held.values()
    assert mine.amplitude == pytest.approx(its.amplitude, rel=1e-3, abs=1e-9) and mine.unit == "N"
    hz = np.linspace(700, 1100, 50)
    exact, near = (one.linear(study.respond, hz, 1.0) for one in (all_dofs, shapes))
    assert np.abs(near - exact).max() < 1e-4 * np.abs(exact).max()
