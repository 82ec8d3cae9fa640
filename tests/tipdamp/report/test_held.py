"""The force on what holds a rigid motion of the damper: of curves whose reactions are known."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, results_of
from tipdamp.hbm.drawing.figure import Curve, Marks
from tipdamp.report.subjects import held
from tipdamp.report.text import NOTHING
from tipdamp.results.response_results import HeldForce

MINUS = "\N{MINUS SIGN}"
ALONG, ROLL = "along the axis", "roll about y"


def forces(Fe, mean):
    """Of the motion along the axis, held by a spring, and of the roll, whose mean is held."""
    return {
        ALONG: HeldForce(
            unit="N", hz=2800.0, mean=mean, amplitude=0.25 * Fe, spring=True, moved=-2e-6
        ),
        ROLL: HeldForce(unit="N m", hz=2800.0, mean=0.05 * Fe, amplitude=0.0, spring=False),
    }


def results(folder, mean=lambda Fe: -0.1 * Fe):
    """A mean force along the axis that is the same over the band, none of the roll; the vibration
    of both is not in the figure."""
    found = results_of(*artefacts(folder))
    cases = []
    for case in found.cases:
        reaction = np.full((41, 2, case.H + 1), 7.0 + 3.0j)
        reaction[:, 0, 0], reaction[:, 1, 0] = mean(case.Fe) or 0.0, 1e-12 * case.Fe
        facts = case.facts.model_copy(
            update={
                "held": forces(case.Fe, mean(case.Fe)),
                "held_change": 0.012,
                "held_reaction_change": 0.34,
            }
        )
        curve = replace(case.curve, held=np.array([ALONG, ROLL]), reaction=reaction)
        cases.append(replace(case, facts=facts, curve=curve))
    return replace(found, cases=tuple(cases))


def test_force_on_what_holds_with_its_unit(tmp_path):
    """Signed, in N or N m; what a spring tells is told of springs alone."""
    (table,) = held.table(results(tmp_path))
    assert [(row["motion"], row["H"], row["Fe (N)"]) for row in table.records] == [
        (motion, H, Fe) for H in "13" for Fe in ("1", "20") for motion in (ALONG, ROLL)
    ]
    spring, mean = table.records[-2:]
    assert list(spring.values())[3:] == [
        "2800.0",
        f"{MINUS}2.000 N",
        "5.000 N",
        "0.012",
        "0.34",
        f"{MINUS}2.00 µm",
    ]
    assert list(mean.values())[3:] == ["2800.0", "1.000 N m", "0 N m", *[NOTHING] * 3]
    assert f"No mean force at any level, so no figure: {ROLL}." in table.caption


def test_force_at_rest_is_beside_the_table(tmp_path):
    found = results(tmp_path)
    preload = found.preload.model_copy(update={"held": {ALONG: -3.0, ROLL: 0.02}})
    (table,) = held.table(replace(found, preload=preload))
    assert f"At rest: {MINUS}3.00 N ({ALONG}). At rest: 0.0200 N m ({ROLL})." in table.caption


@pytest.mark.parametrize(
    "force, said", [(1e-12, "0 N"), (-1e-12, "0 N"), (1e-8, "1.000\N{MULTIPLICATION SIGN}10⁻⁸ N")]
)
def test_rounding_of_a_mean_force_is_nothing(tmp_path, force, said):
    """Beside the excitation; a force that is not known stays unknown."""
    (table,) = held.table(results(tmp_path, lambda Fe: force * Fe))
    assert table.records[0]["mean"] == said
    assert len([*held.figure(results(tmp_path, lambda Fe: force * Fe))]) == (said != "0 N")


def test_force_that_is_not_known_is_a_dash(tmp_path):
    (table,) = held.table(results(tmp_path, lambda Fe: None))
    assert table.records[0]["mean"] == f"{NOTHING} N"


def test_mean_force_over_the_band(tmp_path):
    """In N as it is, a line for each level with a circle at the highest amplitude; of a motion
    without any none."""
    (figure,) = held.figure(results(tmp_path))
    (panel,) = figure.panels
    assert (panel.title, panel.y_label, panel.x_range) == (
        ALONG,
        "mean force (N)",
        (2300.0, 3300.0),
    )
    lines = [item for item in panel.items if isinstance(item, Curve)]
    circles = [item for item in panel.items if isinstance(item, Marks)]
    assert [one.name for one in lines] == ["Fe = 1 N", "Fe = 20 N"]
    assert len({one.dash for one in lines}) == len({one.color for one in lines}) == 2
    for line, circle, mean in zip(lines, circles, (-0.1, -2.0), strict=True):
        assert len(line.x) == 41 and line.y == pytest.approx(np.full(41, mean))
        assert (list(circle.x), list(circle.y), circle.filled) == ([2800.0], [mean], False)
        assert circle.color == line.color
    assert f"{MINUS}2.00 N ({ALONG}, 20 N, 2800.0 Hz)" in figure.caption
    assert ROLL not in figure.caption and "at Fe = 1 and 20 N with H = 3" in figure.caption


def test_no_force_where_nothing_is_held(tmp_path):
    found = results_of(*artefacts(tmp_path))
    assert [*held.table(found)] == [] and [*held.figure(found)] == []
    assert [*held.figure(replace(found, cases=()))] == []
