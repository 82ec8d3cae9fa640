"""Checks that are always on: each quantity that they watch is put wrong, and the check says so.

Stored points of a curve, balance of the contact forces and indefinite bodies:
tests/hbm/curve/test_equilibrium.py, tests/static_contact/contact/test_preload.py,
tests/modal/test_craig_bampton.py; modes over ranks: tests/static_contact/full/test_stuck_modes.py.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from tests.modal.random_bodies import random_body
from tests.robustness.rows import chain, stages, tipdamp
from tests.static_contact import corner
from tipdamp.hbm.curve import equilibrium
from tipdamp.hbm.errors import InputError
from tipdamp.modal import craig_bampton as reduction
from tipdamp.modal.eigen import Factor, SingularStiffness
from tipdamp.modal.solvers import arpack, slepc
from tipdamp.stages import report, run
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.full import newton


class Off:
    """A solver whose solutions are off by a relative amount, in one of their columns alone."""

    def __init__(self, solver, by, column=-1):
        self.solver, self.by, self.column = solver, by, column

    def solve(self, right):
        x = self.solver.solve(right).copy()
        x[:, self.column] *= 1 + self.by
        return x


@pytest.fixture(scope="module")
def body():
    K, M, lam = random_body(2)
    return sp.csr_matrix(K), sp.csr_matrix(M), lam


@pytest.mark.parametrize("columns", [1, 40])
@pytest.mark.parametrize("by", [1e-6, np.nan])
def test_a_linear_solve_that_is_off(body, columns, by):
    """Alone, and hidden among many that are right."""
    factor = Factor(body[0])
    right = np.random.default_rng(0).standard_normal((body[0].shape[0], columns))
    factor.solve(right)
    factor._solver = Off(factor._solver, by)
    with pytest.raises(SingularStiffness, match="the residual of a linear solve is"):
        factor.solve(right)


def test_a_mode_that_is_none(body, monkeypatch):
    real = Factor._lowest
    noise = 1 + 1e-3 * np.random.default_rng(0).standard_normal((body[0].shape[0], 1))

    def off(self, M, count):
        lam, phi = real(self, M, count)
        return lam, phi * noise

    monkeypatch.setattr(Factor, "_lowest", off)
    with pytest.raises(RuntimeError, match="the residual of a mode is"):
        Factor(body[0]).lowest_modes(body[1], 6)


def test_a_mode_that_is_missed(body, monkeypatch):
    """Found by the count of inertia; where it cannot be found, the count and what there is are
    told."""
    K, M, lam = body
    real = arpack.lowest

    def misses_the_third(solve, M, count, *known):
        omega2, phi = real(solve, M, count + 1, *known)
        return (
            (np.delete(omega2, 2), np.delete(phi, 2, axis=1))
            if not known
            else real(solve, M, count, *known)
        )

    monkeypatch.setattr(slepc, "start", lambda: None)
    monkeypatch.setattr(arpack, "lowest", misses_the_third)
    assert Factor(K).lowest_modes(M, 6)[0] ** 2 == pytest.approx(lam[:6], rel=1e-8)
    monkeypatch.setattr(Factor, "_fill", lambda self, M, lam, phi, shift, count: (lam, phi))
    with pytest.raises(
        RuntimeError, match=r"\d+ modes found near .* Hz, where the inertia counts \d+"
    ):
        Factor(K).lowest_modes(M, 6)


def test_rigid_motions_that_meet_stiffness(monkeypatch):
    """Constraint modes that are off, behind the check of the solves."""
    damper = corner.corner()[0][1]
    solve = Factor.solve
    monkeypatch.setattr(Factor, "solve", lambda self, right: solve(self, right) * (1 + 1e-5))
    with pytest.raises(RuntimeError, match="body 'damper': its rigid motions meet a stiffness of"):
        reduction.craig_bampton(damper, damper.node[:9], 0)


@pytest.fixture(scope="module")
def cube():
    bodies, reduced, model, pairs = corner.corner()
    return model, pairs, corner.pulls(bodies, reduced, "both")[1]


def test_a_static_state_out_of_balance(cube, monkeypatch):
    model, pairs, load = cube
    real = StaticContact._contact

    def off(self, *arguments):
        found, q = real(self, *arguments)
        return found._replace(N=found.N * (1 + 1e-6)), q

    StaticContact(model, pairs).solve(load)
    monkeypatch.setattr(StaticContact, "_contact", off)
    with pytest.raises(InputError, match="of the load unbalanced"):
        StaticContact(model, pairs).solve(load)


def test_a_state_with_friction_out_of_balance(cube, monkeypatch):
    model, pairs, load = cube
    contact = FrictionalContact(model, pairs.replace(mu=np.full(len(pairs), 0.3)))
    assert contact.solve([load])[-1].converged
    solve = contact.bodies.solve
    monkeypatch.setattr(contact.bodies, "solve", lambda load: (1 + 1e-6) * solve(load))
    assert not contact.solve([load])[-1].converged


@pytest.mark.parametrize("residual", [1e-3, np.nan])
def test_newton_on_the_full_model_that_does_not_arrive(monkeypatch, residual):
    class System:
        settings = newton.FullSettings()

        def solve(self):
            return np.zeros(3), 7, residual

        def destroy(self):
            pass

    class Sets(System):
        factored = 2

        def __init__(self, *_):
            pass

        def solve(self):
            return np.zeros(3), residual

    monkeypatch.setattr(newton, "FullSets", Sets)
    with pytest.raises(RuntimeError, match="Newton on the full model ended at a residual of"):
        newton._solved(System(), None, None)


def planted(monkeypatch, study_stages):
    """Each stage of a study with a warning of its own; {stage: warning}."""
    said = {name: f"planted in {name} <b>&" for name in study_stages}
    for name, text in said.items():
        stage = run.STAGES[name]
        both = replace(
            stage,
            warnings=lambda study, store, text=text, own=stage.warnings: (*own(study, store), text),
        )
        monkeypatch.setitem(run.STAGES, name, both)
        if name in report.BEFORE:
            monkeypatch.setitem(report.BEFORE, name, both)
    return said


@pytest.mark.slow
def test_every_warning_in_the_terminal_the_summary_and_the_report(tmp_path, monkeypatch):
    """Of every stage that warns, and of energy that is not in balance."""
    study = chain(tmp_path)
    stages(study, "tune")
    energies = equilibrium.KeptPoints.energies

    def off(self):
        return [replace(one, friction=one.friction + 0.01 * one.input) for one in energies(self)]

    monkeypatch.setattr(equilibrium.KeptPoints, "energies", off)
    for receipt in (tmp_path / "results").rglob("*.receipt"):
        receipt.unlink()  # of what was said before the planted ones
    said = planted(monkeypatch, ("inspect", "reduce", "preload", "tune", "respond", "cycles"))
    done = [
        tipdamp(verb, study, "--quiet", "--jobs", "1")
        if verb == "respond"
        else tipdamp(verb, study, "--quiet")
        for verb in (*said, "report")
    ]
    assert all(one.code == 0 for one in done), done
    terminal = "".join(one.out for one in done)
    folder = tmp_path / "results" / "study"
    summary = json.loads((folder / "summary.json").read_text())["warnings"]
    page = (folder / "report.html").read_text(encoding="utf-8")
    texts = [
        line.removeprefix("warning: ")
        for line in terminal.splitlines()
        if line.startswith("warning: ")
    ]
    assert set(said.values()) < set(texts) and any(
        "the energy of a period is balanced to" in t for t in texts
    )
    for text in texts:
        start = text[0].upper() + text[1:40]
        assert any(one.startswith((start, text[:40])) for one in summary), (text, summary)
        assert (
            start.replace("&", "&amp;")
            .replace("<", "&lt;")
            .replace(">", "&gt;")
            .replace("'", "&#39;")
            in page
        ), text
