"""The damper over the period at a peak: its places, and what the marks of its contacts say."""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.report.test_scenes import unpacked
from tipdamp.bodies import DAMPER
from tipdamp.fields.animation import GAP, SLIP, STICK
from tipdamp.fields.surface import OuterSurface
from tipdamp.hbm import fourier
from tipdamp.report.drawing import plotly_moving
from tipdamp.report.results import load_results
from tipdamp.report.subjects import damper_motion
from tipdamp.report.subjects.modes import drawn_amplitude
from tipdamp.report.templating import FOLDER
from tipdamp.results.loops import Loops
from tipdamp.results.response_results import PeakCycle
from tipdamp.study.study import load_study

STAGES = ("reduce", "preload", "tune", "respond", "cycles")


@pytest.fixture(scope="module")
def rig_motion(rig, rig_results):
    results = load_results(
        load_study(rig / "rig.toml"), rig_results, {stage: [] for stage in STAGES}
    )
    (picture,) = damper_motion.figure(results)
    return results, picture


def test_marks_as_often_as_the_curve_says(rig_motion):
    """Time shares of the states at the peak are those that the solver left with the curve."""
    results, picture = rig_motion
    for motion, period in zip(picture.motions, results.periods, strict=True):
        case = next(one for one in results.finest if one.Fe == period.Fe_N)
        i = np.abs(case.curve.frequency - period.hz).argmin()
        shares = case.curve.share_stick[i], case.curve.share_slip[i], case.curve.share_open[i]
        for state, share in zip((STICK, SLIP, GAP), shares, strict=True):
            mine = (motion.states == state).mean(axis=0)
            assert np.abs(mine - share).max() < 3 / damper_motion.INSTANTS
    assert (picture.motions[0].states == STICK).all()  # nothing slips at 1 N
    assert {STICK, SLIP} <= set(picture.motions[-1].states.ravel())


def test_surface_moves_as_the_damper(rig_motion, tmp_path):
    """moving.js at any phase: the place at rest and the magnified motion of the period about its
    mean."""
    node = shutil.which("node") or pytest.skip("node is not installed")
    results, picture = rig_motion
    drawn, period = picture.motions[-1], results.periods[-1]
    data = plotly_moving.data_of(picture)
    motion, body = data["motions"][-1], data["bodies"][0]
    (tmp_path / "data.json").write_text(
        json.dumps([body["rest"], motion["shapes"][DAMPER], motion["orders"], motion["amplitude"]])
    )
    tau = np.array([0.0, 0.7, 2.0, 5.0])
    script = json.dumps(str(FOLDER / "moving.js"))
    code = f"""const {{decoded, displaced, factors}} = require({script});
const [rest, shape, orders, size] = JSON.parse(require("fs").readFileSync(process.argv[1]));
const x0 = decoded(rest, Float32Array), u = decoded(shape, Float32Array);
const frame = p => displaced(x0, u, factors(orders, p).map(f => size * f)).map(v => [...v]);
console.log(JSON.stringify({json.dumps(tau.tolist())}.map(frame)));"""
    out = subprocess.run(
        [node, "-e", code, str(tmp_path / "data.json")], capture_output=True, text=True, check=True
    )
    moved = np.array(json.loads(out.stdout)).transpose(0, 2, 1) - unpacked(body["rest"])
    q = fourier.to_real(results.loops[period.file].damper)
    surface = results.surfaces[DAMPER]
    u = np.array(
        [
            surface.displacement(q[:, 1:] @ e)
            for e in fourier.basis(tau, results.loops[period.file].damper.shape[1] - 1)[:, 1:]
        ]
    )
    ratio = np.linalg.norm(moved) / np.linalg.norm(u)
    assert moved == pytest.approx(ratio * u, abs=0.01 * drawn.amplitude)
    assert np.linalg.norm(moved, axis=2).max() < 1.001 * drawn.amplitude


def test_every_order_turns_with_its_own_share():
    """The damper of two nodes moves as its harmonics say, the largest displacement of the period
    set to 1; an order of no size is not drawn. Contacts at 64 of the instants that the solver
    left."""
    rng = np.random.default_rng(5)
    position = np.array([[0.0, 0.0, 0.0], [0.0, 0.03, 0.04]])
    surface = OuterSurface(
        DAMPER,
        np.array([1, 2]),
        position,
        np.empty((0, 3), int),
        np.empty((0, 2), int),
        rng.normal(size=(6, 4)).astype(np.float32),
    )
    X = 1e-6 * (rng.normal(size=(4, 4)) + 1j * rng.normal(size=(4, 4)))
    X[:, 0], X[:, 2] = 1.0, 1e-5 * X[:, 2]  # the mean is at rest, and order 2 is not seen
    n = 128
    force = np.ones((n + 1, 1, 3))
    force[n // 4 : n // 2, :, 2] = -1.0  # open in the second quarter
    loops = Loops(
        np.arange(n + 1) / n, force, force, np.zeros((n + 1, 1, 2)), ("t1", "t2", "n"), ("a",), X
    )
    cycle = PeakCycle.model_construct(Fe_N=20.0, H=3, hz=2800.04)
    motion = damper_motion._motion(cycle, surface, loops)
    assert motion.label == "Fe = 20 N, H = 3, 2800.0 Hz" and motion.orders == (1, -1, 3, -3)
    tau = 2 * np.pi * np.arange(64) / 64
    parts = [np.cos(h * tau) if h > 0 else -np.sin(-h * tau) for h in motion.orders]
    drawn = np.tensordot(parts, motion.shapes[DAMPER], (0, 0))
    turning = np.exp(1j * np.outer(tau, np.arange(1, 4)))
    u = ((turning @ X[:, 1:].T).real @ surface.recovery.T).reshape(64, 2, 3)
    largest = np.linalg.norm(u, axis=2).max()
    assert np.linalg.norm(drawn, axis=2).max() == pytest.approx(1, rel=1e-4)
    assert drawn == pytest.approx(u / largest, abs=1e-4)
    assert motion.amplitude == drawn_amplitude([surface])
    assert motion.states.ravel().tolist() == [STICK] * 16 + [GAP] * 16 + [STICK] * 32


def test_no_picture_without_the_mesh_of_the_damper(rig_motion):
    results, _ = rig_motion
    assert list(damper_motion.figure(replace(results, surfaces={}))) == []
    assert list(damper_motion.figure(replace(results, cycles=None))) == []
