"""Doubtful units, pieces, pulls and stiffness: warnings with the factor of 1000."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tests.static_contact.beams import supports
from tests.tipdamp import corner_study
from tests.tipdamp.bad_meshes import inspect
from tests.tipdamp.report.files import table
from tipdamp.bodies.read import read_meshes
from tipdamp.checks.pairs import axis_warnings
from tipdamp.checks.plausibility import gap_warnings, mesh_warnings
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact_doubts import tangential_doubts
from tipdamp.results.static_results import PreloadResult
from tipdamp.static_contact.surfaces.pairing import Side, contact_frames
from tipdamp.study.study import load_study


@pytest.mark.parametrize(
    "factor, unit, phrases",
    [
        (
            1e3,
            "m",
            (
                "mesh is 20 m in size",
                "blades: its mass is 1.05e+07 kg",
                "first natural frequency between",
            ),
        ),
        (
            1.0,
            "mm",
            (
                "blades: the mesh is 2e-05 m in size",
                "damper: its mass is 7.85e-12 kg",
                "first natural frequency between",
            ),
        ),
    ],
)
def test_mesh_in_another_unit(tmp_path, capsys, factor, unit, phrases):
    """Coordinates in mm with a study in m, and the reverse: size, mass and frequency all say the
    factor 1000."""
    meshes = [
        replace(m, position=m.position * factor)
        for m in (corner_study.blades(), corner_study.damper())
    ]
    change = [("[material]", f'[units]\nlength = "{unit}"\n[material]')]
    if factor > 1:  # the study is in m; a tolerance that suits its mesh
        change.append(("[contact]", "[contact]\ntolerance = 1e-3"))
    code, _, warnings = inspect(corner_study.write(tmp_path, *meshes, change), capsys)
    assert code == 0
    for phrase in phrases:
        found = [w for w in warnings if phrase in w]
        assert found and "factor of 1000" in found[0]


@pytest.mark.parametrize(
    "old, new", [("density = 7850", "density = 7.85e-9"), ("E = 207e9", "E = 207e3")]
)
def test_material_in_another_unit(tmp_path, capsys, old, new):
    code, _, warnings = inspect(corner_study.write(tmp_path, change=[(old, new)]), capsys)
    assert code == 0 and any("sqrt(E/density)" in w and "factor of 1000" in w for w in warnings)


def test_range_of_wave_speed(tmp_path, capsys):
    _, _, warnings = inspect(corner_study.write(tmp_path), capsys)
    assert ["cells are linear (hexahedron) and lock in bending" in w for w in warnings] == [
        True,
        True,
    ]
    soft = [
        ("E = 207e9", "E = 3e9\nwave_speed = [500, 7000]"),
        ("density = 7850", "density = 1200"),
        ("band = [20000, 40000]", "band = [2000, 4000]"),
    ]
    _, _, warnings = inspect(corner_study.write(tmp_path, change=soft), capsys)
    assert len(warnings) == 2


def test_contact_stiffer_than_two_half_spaces(tmp_path, capsys):
    """kn in N/mm where N/m is meant, or the other way: above the smooth half-spaces of that side.
    Steel, the flat 10 mm square of the corner: a circle of the same area, a = 5.64 mm, has 2 a E* =
    1.28e9 N/m, a square 1 % more."""
    _, _, warnings = inspect(
        corner_study.write(tmp_path, change=[("kn = 1e6", "kn = 1e9")]), capsys
    )
    found = [w for w in warnings if "half-spaces" in w]
    assert len(found) == 1 and found[0].startswith(
        "[contact.one] kn = 1e+09 N/m on 9 nodes is 9e+09 N/m"
    )
    bound = float(found[0].split(" N/m), real")[0].rpartition("(")[2])
    assert 1.28e9 < bound < 1.32e9


@pytest.mark.parametrize(
    "given, said",
    [
        ("kn_total = 9e9\nkt_total = 9e9", "kn_total = 9e+09 N/m for the side"),
        (
            "kn_per_area = 9e13\nkt_per_area = 9e13",
            "kn_per_area = 9e+13 N/m3 on 100 mm2 is 9e+09 N/m for the side",
        ),
    ],
)
def test_total_and_areal_stiffness_beyond_half_spaces(tmp_path, capsys, given, said):
    """The bound of the test above, 1.29e9 N/m, on surfaces and on matching nodes."""
    for k, mesh in enumerate((None, corner_study.unlike())):
        folder = tmp_path / str(k)
        folder.mkdir()
        _, _, warnings = inspect(
            corner_study.write(
                folder,
                damper_mesh=mesh,
                change=[
                    ("kn = 1e6\nkt = 1e6", given),
                    ("kn = 1e6\nkt = 1e6", "kn_total = 1e9\nkt_total = 1e9"),
                ],
            ),
            capsys,
        )
        [found] = [w for w in warnings if "half-spaces" in w]
        assert found.startswith(f"[contact.one] {said}, ")
        assert 1.1e9 < float(found.split(" N/m), real")[0].rpartition("(")[2]) < 1.32e9


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("kn = 1e6", "kn = 1e3", "kn = 1000 N/m on 9 nodes is 9e+03 N/m"),
        ("kn = 1e6", "kn_total = 1e5\nkt_total = 1e5", "kn_total = 1e+05 N/m"),
        (
            "kn = 1e6",
            "kn_per_area = 90\nkt_per_area = 90",
            "kn_per_area = 90 N/m3 on 100 mm2 is 0.009 N/m",
        ),
    ],
)
def test_contact_a_thousand_times_too_soft(tmp_path, capsys, old, new, said):
    """N/mm, or N/mm3, taken for N/m: held against the half-spaces of the tests above, 1.29e9 N/m,
    and the pull of 10 N, of which each side carries 7.07 N."""
    total = float(said.split(" is ")[-1].split("= ")[-1].split()[0])
    new = f"{old}\nkt = 1e6", new if "total" in new or "area" in new else f"{new}\nkt = 1e6"
    _, error, warnings = inspect(corner_study.write(tmp_path, change=[new]), capsys)
    assert warnings is not None, error
    [found] = [w for w in warnings if "half-spaces" in w]
    assert found.startswith(f"[contact.one] {said} for the side, 1/")
    ratio, closes = (
        float(found.split(a)[1].split(b)[0])
        for a, b in ((" 1/", " of that"), ("close it by ", " mm"))
    )
    assert 1.28e9 < ratio * total < 1.32e9 and closes == pytest.approx(7.07e3 / total, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("kn, soft", [("1e6", False), ("1e3", True)])
def test_closure_under_the_preload(tmp_path, capsys, kn, soft):
    """Nodes lie 5 mm apart; 7.07 N on nine springs of 1 kN/m close them by 0.79 mm, were they
    alike."""
    path = corner_study.write(tmp_path, change=[("kn = 1e6", f"kn = {kn}")] * 2)
    assert [main([stage, str(path)]) for stage in ("inspect", "reduce", "preload")] == [0, 0, 0]
    capsys.readouterr()
    result = PreloadResult.load(Store(path.parent / "results" / "corner"))
    found = [warning for warning in result.warnings if "close under the preload" in warning]
    assert len(found) == 2 * soft
    if soft:
        closed = float(found[0].split("N/m is ")[1].split(" mm")[0])
        assert (
            closed == pytest.approx(0.79)
            and "cells are 5 mm" in found[0]
            and "half-spaces of its size" in found[0]
        )


@pytest.mark.parametrize("along, share", [(0.04, None), (0.08, "92 of 100 mm2 (92%)")])
def test_part_of_a_side_without_blade(tmp_path, capsys, along, share):
    """The unlike cube shifted along the axis by a part of its length."""
    damper = corner_study.unlike()
    damper = replace(damper, position=damper.position + [0, along * corner_study.A, 0])
    _, error, warnings = inspect(
        corner_study.write(
            tmp_path,
            damper_mesh=damper,
            change=[("kn = 1e6\nkt = 1e6", "kn_total = 1e7\nkt_total = 1e7")] * 2,
        ),
        capsys,
    )
    assert warnings is not None, error
    found = [w for w in warnings if "carries nothing" in w]
    assert len(found) == 2 * (share is not None)
    if share:
        assert found[0].startswith(
            f"side 'one': of the damper's faces 'face_x' {share} lie opposite"
        )


@pytest.mark.parametrize(
    "axis, said",
    [
        ("[0, 1, 0]", []),
        (
            "[1, 1, 0]",
            [
                "9 of 18 contact normals are more than 20 degrees off being perpendicular to it, "
                "side 'one' 45"
            ],
        ),
    ],
)
def test_wrong_axis(tmp_path, capsys, axis, said):
    """The cube's contact runs along y; the sides are square, which is no reason."""
    _, error, warnings = inspect(
        corner_study.write(
            tmp_path,
            change=[
                ("modes = 3\n", f"modes = 3\naxis = {axis}\n"),
                ("mu = 0.3", 'mu = 0.3\nmethod = "surfaces"'),
                *[("kn = 1e6\nkt = 1e6", "kn_total = 1e7\nkt_total = 1e7")] * 2,
            ],
        ),
        capsys,
    )
    assert warnings is not None, error
    assert [w.split(": ")[1] for w in warnings if w.startswith("axis = ")] == said


def test_axis_across_the_contact():
    """Two flat sides, 40 mm along x and 5 mm wide: y as the axis is warned of, x is not; normals
    along z."""
    place = np.array([[x, y, 0.0] for x in np.linspace(0, 0.04, 5) for y in (0, 0.005)])
    for axis, count in (((1.0, 0, 0), 0), ((0, 1.0, 0), 1)):
        frames = contact_frames(
            np.tile([0, 0, 1.0], (10, 1)), np.array(axis), Side("one", "b", "d")
        )
        pairs = supports(place[:, 0], np.ones(10), np.zeros(10)).replace(
            position=place, frame=frames
        )
        found = axis_warnings(pairs, axis)
        assert len(found) == count and all(
            "40 mm wide across it, all contact 5 mm long" in w for w in found
        )


def test_cylinder_without_radius(tmp_path, capsys):
    """Its kn is held against the stiffest cylinder that the damper has room for."""
    change = [
        (
            'shape = "flat"\nkn = 1e6\nkt = 1e6\nwidth = 0.01',
            'shape = "cylinder"\nkn = 1e9\nkt = 1e6',
        )
    ]
    _, _, warnings = inspect(corner_study.write(tmp_path, change=change), capsys)
    assert [
        w
        for w in warnings
        if w.startswith("[contact.one] kn = 1e+09 N/m on 9 nodes is 9e+09 N/m for the side")
    ]


def test_pull_direction_turned_round(tmp_path, capsys):
    code, _, warnings = inspect(
        corner_study.write(tmp_path, change=[("[1, 0, 1]", "[-1, 0, -1]")]), capsys
    )
    assert code == 0 and any(
        w.startswith(
            "pull_direction = [-0.7071, 0.0, -0.7071]: side 'one' would have to pull the damper"
        )
        for w in warnings
    )


def test_two_pieces(tmp_path, capsys):
    """Two blades that stand apart, each clamped, are told and not warned of; one that nothing holds
    is refused."""
    study = corner_study.write(tmp_path)
    assert main(["inspect", str(study)]) == 0
    said = capsys.readouterr().out
    assert "blades: 54 nodes in 2 pieces, 16 hexahedron" in said and "share no node" not in said
    meshes = read_meshes(load_study(study))
    meshes["blades"].groups["clamp_one"] = meshes["blades"].groups["touch_one"] = np.empty(0, int)
    found = mesh_warnings(load_study(study), "blades", meshes["blades"])
    assert (
        "blades: the mesh consists of 2 pieces that share no node (of 27, 27 nodes); 1 of them "
        "is neither clamped nor in contact"
    ) in found
    _, _, found = inspect(corner_study.write(tmp_path, corner_study.with_a_third()), capsys)
    assert any(
        "blades: the mesh consists of 3 pieces that share no node (of 27, 27, 27 nodes); 1 of "
        "them is clamped and in no contact" in one
        for one in found
    )
    (tmp_path / "results" / "corner" / "inspect.json").unlink()
    path = corner_study.write(tmp_path, change=[('["clamp_one", "clamp_two"]', '"clamp_one"')])
    code, error, _ = inspect(path, capsys)
    assert (
        code == 2
        and "6 rigid motions are free" in error
        and "consists of 2 pieces that share no node" in error
    )


@pytest.mark.parametrize("share, said", [(0.7, 0), (1e-3, 1), (1e3, 1), (0.0, 0)])
def test_tangential_stiffness_of_another_unit(share, said):
    pairs = table()
    found = list(
        tangential_doubts(pairs.replace(kn=np.full(len(pairs), 1e6), kt=share * 1e6 + 0 * pairs.kn))
    )
    assert len(found) == said * len(pairs.sides)
    assert all("kt is" in one and "unit" in one for one in found)


def test_slivers_are_told_of_a_study(tmp_path, capsys):
    """Tetrahedra pressed flat along the axis: each is two hundred times as wide as high."""
    thin = [
        replace(m, position=m.position * [1, 5e-3, 1])
        for m in (corner_study.blades("tetra10"), corner_study.damper("tetra10"))
    ]
    _, _, found = inspect(corner_study.write(tmp_path, *thin), capsys)
    for body, cells in (("blades", 96), ("damper", 48)):
        said = [w for w in found if w.startswith(f"{body}: {cells} of {cells} cells are slivers")]
        assert len(said) == 1 and "worst 0.0" in said[0]
        assert ") m): frequencies and stresses come out too high or wrong there" in said[0]
    _, _, found = inspect(corner_study.write(tmp_path), capsys)
    assert not any("slivers" in w for w in found)


def test_slivers_are_told_of_meshes(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("tipdamp.proposal.trial.LONGEST", 0.0)
    monkeypatch.setattr("tipdamp.modal.cell_shape.SLIVER", 0.9)  # of the bricks' tetrahedra some
    corner_study.write(tmp_path, corner_study.blades("tetra10"), corner_study.damper("tetra10"))
    assert main(["inspect", str(tmp_path / "damper.inp"), str(tmp_path / "blades.inp")]) == 0
    said = capsys.readouterr().out
    assert "warning: blades.inp: " in said and " of 96 cells are slivers" in said


@pytest.mark.parametrize(
    "shape, gaps, said", [("flat", 1, True), ("cylinder", 1, False), ("cylinder", 2, True)]
)
def test_gaps_beside_the_line_of_a_round_side_are_no_doubt(shape, gaps, said):
    """They are there on any cylinder on a flat; where no point touches the side stands off."""
    points = contact_table(
        np.tile(np.eye(3), (2, 1, 1)), side="left", area=1e-6, gap=[2e-4 * (gaps == 2), 2e-4]
    )
    study = SimpleNamespace(sides={"left": SimpleNamespace(shape=shape)}, length_unit=1e-3)
    assert any("have gaps" in text for text in gap_warnings(study, points)) == said
