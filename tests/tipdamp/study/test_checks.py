"""Keys that exclude or require each other."""

import pytest

from tests.conftest import STUDY, changed
from tipdamp.hbm.errors import InputError
from tipdamp.study.study import load_study

RADIUS = ('shape = "cylinder"', 'shape = "cylinder"\nradius = 2e-3')
NO_LEFT = ("kn = 3.32e6\nkt = 3.02e6\n", "")
NO_RIGHT = ("kn = 1.03e6\nkt = 0.94e6\n", "")


@pytest.mark.parametrize(
    "changes, message",
    [
        ([("kt = 3.02e6\n", "")], r"\[contact.left\] kn and kt are missing"),
        (
            [("kt = 3.02e6\n", ""), ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"')],
            r"\[contact.left\] kt is missing: kn is given; only both together replace the model",
        ),
        (
            [NO_LEFT, ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"')],
            r"\[contact.left\] radius is missing",
        ),
        (
            [NO_LEFT, RADIUS, ("mu = 0.6", 'mu = 0.6\nstiffness = "plane_depth"')],
            r"\[contact.left\] depth is missing",
        ),
        (
            [
                NO_LEFT,
                ("mu = 0.6", 'mu = 0.6\nstiffness = "plane_depth"'),
                (RADIUS[0], RADIUS[1] + "\ndepth = [1e-3]"),
            ],
            r"\[contact.left\] depth = \[0.001\]: must be two numbers",
        ),
        (
            [
                NO_LEFT,
                ("mu = 0.6", 'mu = 0.6\nstiffness = "rough_series"'),
                (RADIUS[0], RADIUS[1] + "\nh_rms = 1e-6"),
            ],
            r"\[contact.left\] gamma is missing",
        ),
        (
            [
                NO_LEFT,
                ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"'),
                (RADIUS[0], RADIUS[1] + "\nh_rms = 1e-6"),
            ],
            r"\[contact.left\] h_rms: leave it out, it belongs to \[contact\] stiffness = "
            r"\"rough_series\"",
        ),
        (
            [("mu = 0.6", 'mu = 0.6\nstiffness = "rough_series"\nkind = "secant"')],
            "has a tangent only",
        ),
        (
            [("mu = 0.6", "mu = 0.6\nscale = 0.5")],
            r"\[contact\] scale: leave it out, stiffness = \"given\" uses no model",
        ),
        (
            [("kt = 3.02e6", "kt = 3.02e6\nkn_total = 1e8\nkt_total = 1e8")],
            r"\[contact.left\] kn and kn_total exclude each other: per node, per area or in total",
        ),
        (
            [("kn = 3.32e6\nkt = 3.02e6", "kn_per_area = 1e8")],
            r"\[contact.left\] kn and kt are missing",
        ),
        (
            [("kt = 3.02e6", "kt = 3.02e6\nreference_kn = 1e6")],
            r"reference_kt is missing: reference_kn is given",
        ),
        (
            [("mu = 0.6", "mu = 0.6\nfit_hz = 3500")],
            r"\[contact\] fit_hz: leave it out, stiffness = \"given\"",
        ),
        (
            [("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"\nfit_hz = 3500\nscale = 0.1')],
            r"scale and fit_hz exclude each other",
        ),
        (
            [("stations = [5, 4]", "stations = [5, 4]\ngraded = true")],
            r"\[tune\] graded: leave it out, it belongs to",
        ),
        (
            [("stations = [5, 4]", 'target_from = "low"')],
            r"target_from = 'low': there is no \[measured.low\]",
        ),
        (
            [("stations = [5, 4]", "stations = [5, 4]\nscatter_hz = 10")],
            r"\[tune\] scatter_hz: leave it out",
        ),
        (
            [("stations = [5, 4]", 'target_hz = 2800\norder = "random"')],
            r"order = 'random': .*from_middle, least_loaded",
        ),
        (
            [("stations = [5, 4]", 'target_hz = 2800\norder = "from_edge"')],
            r"order = 'from_edge' is of by = 'area' or",
        ),
        (
            [("[tune]", "[tune]\nkept_share = 0.5")],
            r"kept_share: leave it out, it belongs to by = 'area' or 'cell'",
        ),
        (
            [("[tune]", '[tune]\nby = "cell"')],
            r"\[tune\] stations: leave it out, it belongs to by = 'station'",
        ),
        ([("stations = [5, 4]", 'by = "area"')], r"\[tune\] needs either target_hz or kept_share"),
        (
            [("stations = [5, 4]", 'by = "area"\ntarget_hz = 2800\nkept_share = 0.5')],
            r"either target_hz or kept_share",
        ),
        (
            [("stations = [5, 4]", 'by = "area"\ntarget_hz = 2800\ngraded = true')],
            r"graded: leave it out, by = 'area'",
        ),
        (
            [("stations = [5, 4]", 'by = "cell"\ntarget_hz = 2800\ncell_size = 0')],
            r"cell_size = 0: must be above 0",
        ),
        (
            [("stations = [5, 4]", 'stations = [5, 4]\npreload = "table"')],
            r"preload = 'table': needs a table kept",
        ),
        (
            [("mu = 0.6", 'mu = 0.6\nshares = "area"')],
            r"\[contact\] shares = 'area': .*equal, tributary",
        ),
    ],
)
def test_stiffness_keys_that_do_not_fit(tmp_path, changes, message):
    (tmp_path / "s.toml").write_text(changed(STUDY, *changes))
    with pytest.raises(InputError, match=message):
        load_study(tmp_path / "s.toml")
