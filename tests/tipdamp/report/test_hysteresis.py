"""Loops and normal forces of a period, of ellipses whose work is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from tipdamp.hbm.drawing.figure import Curve
from tipdamp.report.results import Results
from tipdamp.report.subjects import friction
from tipdamp.results.loops import Loops

AMPLITUDE, MEAN = 2e-6, 5e-6  # m
WORK = np.array([1.0, 0.5, 2e-4, 0.2, 3.0] + [1e-2 * (k + 1) for k in range(10)])  # J
NORMAL = [(-4.0, 10.0), (3.0, 8.0), (-7.0, -1.0), (0.0, 0.0)]  # N, from and to, over and over


def results(components=("t1", "t2", "n")):
    """Each pair turns its work in t1, half of it in t2; four curves, of which the last counts."""
    phase = np.linspace(0, 2 * np.pi, 401)
    motion, force = np.zeros((2, len(phase), len(WORK), len(components)))
    for k, name in enumerate(components):
        for i, work in enumerate(WORK):
            low, high = NORMAL[i % len(NORMAL)]
            share = {"t1": 1.0, "t2": 0.5, "n": 0.0}[name]
            motion[:, i, k] = MEAN + AMPLITUDE * np.cos(phase)
            force[:, i, k] = -share * work / (np.pi * AMPLITUDE) * np.sin(phase) + (name == "n") * (
                low + (high - low) * (1 - np.cos(phase)) / 2
            )
    pairs = tuple(f"left {i}" for i in range(len(WORK)))
    done = dict(zip(pairs, WORK, strict=True))
    curves = [
        SimpleNamespace(file=f"{Fe}_{H}", Fe_N=Fe, H=H, hz=2800.0, friction_J=done, tried=())
        for Fe, H in ((5.0, 1), (20.0, 1), (5.0, 3), (20.0, 3))
    ]
    none = np.zeros((0, 2))
    time = phase / (2 * np.pi * 2800.0)
    loops = Loops(time, motion, force, motion[:, :, :0], components, pairs, none)
    return Results(
        None,
        cycles=SimpleNamespace(curves=tuple(curves)),
        loops={curves[-1].file: loops},
        cases=tuple(SimpleNamespace(Fe=one.Fe_N, H=one.H, facts=one) for one in curves),
    )


def test_area_of_a_loop_is_the_work_and_its_middle_the_mean():
    loops, _ = friction.hysteresis(results())
    most = sorted(np.argsort(-WORK)[: friction.SHOWN])
    assert [panel.title for panel in loops.panels] == [f"left {i}" for i in most]
    assert "Fe = 20 N, H = 3 (2800.0 Hz), of the 12 pairs" in loops.caption
    for panel, i in zip(loops.panels, most, strict=True):
        for curve, share in zip(panel.items, (1.0, 0.5), strict=True):
            area = 0.5 * np.sum((curve.y[1:] + curve.y[:-1]) * np.diff(curve.x))  # N um
            assert area == pytest.approx(1e6 * share * WORK[i], rel=1e-3)
            assert [curve.x.min(), curve.x.max()] == pytest.approx([-2.0, 2.0], rel=1e-3)


def test_pairs_without_a_thousandth_of_the_largest_work_are_left_out(monkeypatch):
    monkeypatch.setattr(friction, "SHOWN", len(WORK))
    loops, _ = friction.hysteresis(results())
    assert [panel.title for panel in loops.panels] == [
        f"left {i}" for i in range(len(WORK)) if WORK[i] > 3e-3
    ]


def test_normal_forces_lie_within_their_axes():
    """With room above and below, and zero in sight: nobody takes a part of the axis for all."""
    *_, normal = friction.hysteresis(results())
    for panel in normal.panels:
        (curve,) = (item for item in panel.items if isinstance(item, Curve))
        low, high = panel.y_range
        assert low <= 0 and low <= curve.y.min() <= curve.y.max() < high
        assert curve.y.min() >= 0 or low < curve.y.min()
        assert curve.x[0] == 0 and curve.x[-1] == 1 and panel.x_range == (0.0, 1.0)


def test_only_what_the_law_has_is_drawn():
    assert [f.name for f in friction.hysteresis(results(("n",)))] == ["normal_force"]
    assert [f.name for f in friction.hysteresis(results(("t1",)))] == ["hysteresis"]
    assert not list(friction.hysteresis(Results(None)))
