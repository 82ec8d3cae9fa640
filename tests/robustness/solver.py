"""D. Solver trouble."""

import json
from dataclasses import replace
from unittest import mock

import numpy as np

from tests.hbm.cases import duffing
from tests.robustness.rows import chain, corner, refused, row, stages, tipdamp, warned
from tests.static_contact import corner as cube
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.laws import Contacts, Jenkins1D
from tipdamp.hbm.response import follow_band
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.normal import complementarity


@row("62", "Newton fails at a point; a curve that stays incomplete", "R")
def newton_fails(folder):
    study = chain(folder)
    stages(study, "tune")
    with mock.patch("tipdamp.hbm.validation.DEFAULT", replace(DEFAULT, max_points=12)):
        said = tipdamp("respond", study, "--quiet", "--jobs", "1")
    assert said.code == 3 and "2 of 2 curves are incomplete" in said.err, said
    found = json.loads((folder / "results" / "study" / "respond.json").read_text())["responses"][0]
    assert found["peak_m"] is None and found["at_least_m"] > 0 and found["ended"]
    yield said.err.strip().removeprefix("tipdamp: ")
    # a slider without any damping in its own resonance: the step is cut, or the point left out and
    # said
    problem = ContactProblem(
        [[1.0]],
        [[1e-6]],
        [[1.0]],
        [[1.0]],
        Jenkins1D(),
        Contacts(*[np.array([v]) for v in (0.0, 1.0, 0.5, 1.0)]),
    )
    curve = follow_band(problem, np.array([0.5]), (0.12, 0.3), harmonics=7, outputs={"x": [1.0]})
    assert curve.complete or curve.ended
    yield (
        f"{int(curve.converged.sum())} points, {int((~curve.converged).sum())} not solved: "
        f"{curve.ended}"
    )


@row("64", "unstable part of a curve", "S")
def folds(folder):
    curve = follow_band(
        duffing(0.03), np.array([0.2]), (0.08, 0.5), harmonics=5, outputs={"x": [1.0]}
    )
    turns = int((np.diff(np.sign(np.diff(curve.frequency))) != 0).sum())
    assert curve.complete and turns >= 2
    yield f"followed through {turns} folds; stability of a point: `compare` (tests/hbm/time)"


@row("67", "active set that cycles", "R")
def active_set(folder):
    bodies, reduced, model, pairs = cube.corner()
    load, random = cube.pulls(bodies, reduced, "both")[1], np.random.default_rng(0)
    for i in range(5):
        case = cube.random_pairs(pairs, random, hard=i % 2 == 0)
        statics = StaticContact(model, case)
        real, tried = complementarity._pivot, []

        def first_cycles(*arguments, real=real, tried=tried, **more):
            if not tried:
                tried.append(True)
                raise complementarity.Cycling
            return real(*arguments, **more)

        with mock.patch.object(complementarity, "_pivot", first_cycles):
            found = statics.solve(load)
        assert found.residual < 1e-8 and found.balance < 1e-8
        N = cube.by_interior_point(model.K, statics.B.toarray(), load, case.gap, case.kn)
        assert np.abs(found.force - N).max() < 1e-8 * N.max()
    yield (
        "5 random gaps, soft and hard: the forces of an interior point method, complementarity "
        "to 1e-8"
    )


@row("67b", "self-locking wedge", "W")
def jams(folder):
    study = corner(folder, ("mu = 0.3", "mu = 1.2"))
    stages(study, "reduce")
    yield warned(
        study,
        r"side 'one' can jam: its friction angle atan\(mu\) = 50.2 degrees exceeds",
        "preload",
    )


@row("68", "contact formula outside its range", "E")
def formula(folder):
    flat = 'shape = "flat"\nkn = 1e6\nkt = 1e6\nwidth = 0.01'
    halfspace = ("mu = 0.3", 'mu = 0.3\nstiffness = "halfspace"')
    yield refused(
        corner(folder, (flat, 'shape = "cylinder"\nradius = 0'), halfspace),
        "radius = 0: must be above 0",
    )
    study = corner(
        folder, (flat, 'shape = "cylinder"\nradius = 1e-9'), halfspace, ("pull = 10", "pull = 1e6")
    )
    said = [tipdamp(verb, study, "--quiet") for verb in ("inspect", "reduce", "preload")]
    assert any(one.code == 2 for one in said), said
    yield next(one.line for one in said if one.code == 2)[:300]
