"""The memory that is foretold for slipping pairs, against what a curve takes, and what is said where it lacks."""

import tracemalloc

import numpy as np
import pytest

from hbm import memory
from hbm.errors import InputError
from hbm.laws import DryFriction2T
from hbm.memory import newton_bytes
from hbm.residual import HarmonicBalance
from hbm.response import contact_problem, forced_response
from tests.hbm.small_rig import small_rig

MODEL, PAIRS, TIP = small_rig(stations=6)


def curve(level=200.0, harmonics=15):
    return forced_response(MODEL, PAIRS, DryFriction2T(), level * TIP, (300, 330), harmonics=harmonics,
                           damping_ratio=0.02, outputs={"tip": TIP})


def test_forecast_of_a_curve():
    """Ten of twelve pairs slip or lift: at H = 15 what is foretold for these is needed, to a factor of two."""
    curve(harmonics=1)                                       # what is loaded or compiled once is not the curve's
    tracemalloc.start()
    found = curve()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    moving = int(((found.share_slip + found.share_open) > 0).sum(axis=1).max())
    assert moving == 10 and 0.5 < newton_bytes(moving, 3, 15) / peak < 2, newton_bytes(moving, 3, 15) / peak


def test_too_many_harmonics_are_refused_at_the_door(monkeypatch):
    """128 pairs in three dimensions at H = 200 with 16 GB, before the modes; the number that is named fits."""
    columns = {name: np.resize(getattr(PAIRS, name), (128, *getattr(PAIRS, name).shape[1:]))
               for name in PAIRS.__dataclass_fields__}
    problem, _ = contact_problem(MODEL, PAIRS.replace(**columns), DryFriction2T(), damping_ratio=0.02)
    monkeypatch.setattr(memory, "available_bytes", lambda: 16e9)
    with pytest.raises(InputError, match=r"harmonics = 200: 32 of the 128 pairs.* need .* GB .* 16 GB are available: "
                                         r"at most harmonics = (\d+) here") as caught:
        HarmonicBalance(problem, {1: TIP}, 200)
    assert "_receptance" not in problem.__dict__
    named = int(str(caught.value).split("at most harmonics = ")[1].split()[0])
    assert 50 < named < 200 and newton_bytes(32, 3, named) <= 16e9 < newton_bytes(32, 3, named + 1)
    HarmonicBalance(problem, {1: TIP}, named)


def test_pairs_that_slip_later_are_refused_by_name(monkeypatch):
    """Where more slip than the door foresaw, before the matrix is made; none slip at a low level, and all is well."""
    monkeypatch.setattr(memory, "available_bytes", lambda: 1.1 * newton_bytes(3, 3, 15))
    monkeypatch.setattr(memory, "_SMALL", 0.0)
    assert curve(level=1e-3).complete
    with pytest.raises(InputError, match=r"harmonics = 15: \d+ of the 12 pairs, which slip or lift at once here, need"):
        curve()
