"""Line contact on a round side: force per length whatever the rows, and Hertz by hand."""

import numpy as np
import pytest

from tests.contact_tables import contact_table, frames
from tipdamp.engine.store import Store
from tipdamp.fields.line_contact import hole_warnings, line_contacts, narrow_lines
from tipdamp.fields.visualization import keep_preload

R, LENGTH, LOAD = 6e-3, 20e-3, 96.0
E_STAR = 205e9 / (2 * (1 - 0.3**2))  # two bodies of steel


def flank(stations, rows):
    """(table, forces) of a flank along y that carries LOAD evenly over its length, as whatever rows
    it has share it."""
    y, z = np.meshgrid(np.linspace(0, LENGTH, stations), np.linspace(-4e-4, 4e-4, rows))
    n = y.size
    table = contact_table(
        frames(np.tile([1.0, 0, 0], (n, 1))),
        blade_body="blades",
        damper_body="damper",
        blade_node=np.arange(n) + 1,
        damper_node=np.arange(n) + 1,
        side="left",
        station=np.tile(np.arange(stations), rows),
        row=np.repeat(np.arange(rows), stations),
        position=np.column_stack([0 * y.ravel(), y.ravel(), z.ravel()]),
    )
    share = np.ones(stations)
    share[[0, -1]] = 0.5
    across = np.random.default_rng(1).uniform(0.1, 1, rows)
    force = LOAD * np.outer(across / across.sum(), share / share.sum()).ravel()
    return table, force


@pytest.mark.parametrize(("stations", "rows"), [(5, 1), (5, 4), (9, 3)])
def test_hertz_by_hand(stations, rows):
    """4.8 N/mm on R = 6 mm: a = sqrt(4 P R / (pi E*)), p0 = sqrt(P E* / (pi R)), and the pressure
    over the strip, half an ellipse, carries P; on every mesh the same."""
    table, force = flank(stations, rows)
    (line,) = line_contacts(table, np.array([0, 1.0, 0]), {"left": (R, E_STAR)})
    P = LOAD / LENGTH
    assert line.load(force) == pytest.approx(np.full(stations, P))
    assert line.half_width(force) == pytest.approx(np.sqrt(4 * P * R / (np.pi * E_STAR)))
    assert line.peak(force) == pytest.approx(np.sqrt(P * E_STAR / (np.pi * R)))
    carried = np.pi / 2 * line.peak(force) * line.half_width(force)
    assert carried == pytest.approx(np.full(stations, P))
    assert line.length.sum() == pytest.approx(LENGTH)


def test_an_open_station_has_no_pressure():
    table, force = flank(5, 2)
    force[table.station == 2] = -1.0
    (line,) = line_contacts(table, np.array([0, 1.0, 0]), {"left": (R, E_STAR)})
    assert line.load(force)[2] == line.half_width(force)[2] == line.peak(force)[2] == 0.0


def test_what_is_drawn_carries_the_side_whatever_the_rows():
    """Force per length at a node of each station, and a spacing that tells a line from a face."""
    axis, round_sides = np.array([0, 1.0, 0]), {"left": (R, E_STAR)}
    for rows, spacing in ((1, np.inf), (3, 4e-4), (5, 2e-4)):
        table, force = flank(5, rows)
        (line,) = line_contacts(table, axis, round_sides)
        assert line.spacing == pytest.approx(spacing)
        patch = line.patch(table)
        assert patch.unit == "N/mm" and patch.carried(force).sum() == pytest.approx(LOAD)
        assert patch.load(force) == pytest.approx(np.full(5, 1e-3 * LOAD / LENGTH))
        assert np.abs(table.position[patch.rows, 2]).max() <= 4e-4 / max(rows - 1, 1) + 1e-12


def test_a_wide_strip_is_no_line():
    """A strip of 36 um by Hertz: a line between rows 400 um apart, none where they are 25 um
    apart; nor without a radius or moduli."""
    axis = np.array([0, 1.0, 0])
    for rows, narrow in ((3, 1), (33, 0)):
        table, force = flank(5, rows)
        pulled = table.replace(preload=force)
        assert len(narrow_lines(pulled, axis, {"left": R}, {"left": E_STAR})) == narrow
        assert narrow_lines(pulled, axis, {"left": None}, {"left": E_STAR}) == []
        assert narrow_lines(pulled, axis, {"left": R}, {"left": None}) == []


@pytest.mark.parametrize("rows", [3, 5])
def test_paraview_has_force_per_length_on_a_line(tmp_path, rows):
    """And no pressure, which would be that of the mesh."""
    meshio = pytest.importorskip("meshio")
    table, force = flank(5, rows)
    pulled = table.replace(preload=force)
    lines = narrow_lines(pulled, np.array([0, 1.0, 0]), {"left": R}, {"left": E_STAR})
    store = Store(tmp_path)
    assert keep_preload(store, {"pull": pulled}, False, lines) == ["preload.vtu"]
    found = meshio.read(store.path("preload.vtu"))
    assert list(found.cells_dict) == ["line"]
    assert not any(name.startswith("pressure") for name in found.point_data)
    load = found.point_data["force per length (N/mm), pull"][found.cells_dict["line"]]
    assert load == pytest.approx(np.full((4, 2), 1e-3 * LOAD / LENGTH))


def test_holes_between_loaded_stations_are_told():
    """Nothing of a line that touches here and there, and that ends early; the mean is that of what
    it carries over the length between the ends of that."""
    table, force = flank(11, 1)
    axis = np.array([0, 1.0, 0])
    (line,) = line_contacts(table, axis, {"left": (R, E_STAR)})
    short = np.where(table.station < 8, force, 0.0)
    assert not list(hole_warnings([line], force)) and not list(hole_warnings([line], short))
    for carried in (short, force):
        assert line.mean_load(carried) == pytest.approx(LOAD / LENGTH, rel=1e-12)
    moved = short.copy()
    moved[4], moved[5] = 0.0, force[4] + force[5]
    assert line.mean_load(moved) == pytest.approx(LOAD / LENGTH)
    assert line.mean_peak(moved) == pytest.approx(line.peak(force)[2])
    (said,) = hole_warnings([line], moved)
    assert "1 of 8 stations (12%) carry nothing" in said and "up to 2 times its mean" in said
    assert line.mean_load(0 * force) == line.mean_peak(0 * force) == 0.0
