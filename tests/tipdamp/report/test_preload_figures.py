"""The preload along the axis: nodal forces, pressures of contact points, force per length where
these are in contact along a line."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.contact_tables import contact_table, frames
from tests.tipdamp.fields.test_line_contact import E_STAR, LENGTH, LOAD, R, flank
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing.figure import Marks
from tipdamp.report.subjects import preload
from tipdamp.report.subjects.axial import PER_LENGTH, PRESSURE

AXIS = np.array([0.0, 1.0, 0.0])


def results_with(table, E_star=E_STAR):
    """What the figures of the preload read of the results."""
    side = SimpleNamespace(shape="cylinder", radius=R)
    study = SimpleNamespace(
        sides={"left": side}, driver=SimpleNamespace(pull_direction=(0.0, 0.0, 1.0))
    )
    made = SimpleNamespace(E_star_Pa=E_star)
    return SimpleNamespace(
        study=study,
        whole=table,
        preload=SimpleNamespace(stiffness={"left": made}),
        axis=AXIS,
        along=lambda pairs: 1e3 * pairs.position @ AXIS,
    )


def points(rows):
    """A flank of contact points, which stand for areas."""
    table, force = flank(5, rows)
    return table.replace(preload=force, area=np.full(len(table), 1e-6))


@pytest.mark.parametrize("rows", [3, 5])
def test_force_per_length_of_a_line_contact(rows):
    """That of the side over its length at every station, whatever the rows."""
    (panel,) = preload.panels(results_with(points(rows)), points(rows))
    marks = [item for item in panel.items if getattr(item, "symbol", "") and len(item.x)]
    assert panel.y_label == PER_LENGTH and len(marks) == 1
    assert marks[0].x == pytest.approx(1e3 * np.linspace(0, LENGTH, 5))
    assert marks[0].y == pytest.approx(np.full(5, 1e-3 * LOAD / LENGTH))
    assert panel.y_range[0] == 0 < marks[0].y.max() < panel.y_range[1]


def test_a_stop_is_named_and_no_end_of_the_damper():
    """A side of pairs to the ground, beside one between the bodies."""
    table = points(5)
    stop = table.replace(side=np.full(len(table), "stop"), blade_body=np.full(len(table), "ground"))
    stop = stop.select(stop.station < 2)
    both = ContactTable(
        **{name: np.r_[column, vars(stop)[name]] for name, column in vars(table).items()}
    )
    found = results_with(both, None)
    titles = [panel.title for panel in preload.panels(found, both)]
    assert titles == ["side 'left', cylinder", "side 'stop' to ground"]
    said = preload._ends(found, both)
    assert "'left'" in said and "'stop'" not in said


def test_pressure_where_the_strip_is_wide_or_not_known():
    for rows, E_star in ((33, E_STAR), (3, None)):
        (panel,) = preload.panels(results_with(points(rows), E_star), points(rows))
        assert panel.y_label == PRESSURE


def test_an_open_station_carries_nothing():
    table = points(3)
    table = table.replace(preload=np.where(table.station == 2, -1.0, table.preload))
    (panel,) = preload.panels(results_with(table), table)
    (opened,) = [item for item in panel.items if getattr(item, "filled", True) is False]
    assert list(opened.y) == [0.0] and opened.x == pytest.approx([1e3 * LENGTH / 2])


def test_ends_that_carry_nothing_are_no_ratio():
    table = points(3)
    open_end = table.replace(preload=np.where(table.station == 0, 0.0, table.preload))
    assert "times the middle" in preload._ends(results_with(table), table)
    assert preload._ends(results_with(open_end), open_end) == ""


def test_points_of_an_unlike_mesh_by_their_height():
    """Every point once, where it is and in N/mm², in its third of the side; hollow where open, and
    a cross at the end of the axis where the gap is wide."""
    n = 12
    height = np.tile([0.0, 1e-3, 2e-3], 4)
    pressure = np.array([4.0, 8.0, 6.0, 3.0, -1.0, 5.0, 2.0, 7.0, -0.5, 1.0, 9.0, -100.0])
    area = np.linspace(1e-6, 2e-6, n)
    table = contact_table(
        frames([[1.0, 0.0, 0.0]] * n),
        position=np.column_stack([np.zeros(n), 1e-3 * np.arange(n), height]),
        area=area,
        preload=1e6 * area * pressure,
    )
    (panel,) = preload.panels(results_with(table, None), table)
    low, top = -0.25 * 9.0, 9.0
    found = {
        (marks.name, round(x, 6)): (y, marks.filled)
        for marks in panel.items
        if isinstance(marks, Marks)
        for x, y in zip(marks.x, marks.y, strict=True)
    }
    thirds = ["lower third", "middle", "upper third"] * 4
    words = {4: "middle, open", 8: "upper third, open", 11: "open, below the axis"}
    expected = {
        (words.get(k, thirds[k]), 1.0 * k): (max(pressure[k], low), k not in (4, 8))
        for k in range(n)
    }
    assert found.keys() == expected.keys()
    for place, (y, filled) in expected.items():
        assert found[place] == (pytest.approx(y), filled), place
    assert panel.y_label == PRESSURE
    assert panel.y_range[0] < low and top < panel.y_range[1]
