"""The rig's meshes: checked against closed forms and mirror symmetry, and broken on purpose."""

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tipdamp.hbm.errors import InputError
from tipdamp.meshes.checks import MeshError, cell_volumes, check, check_solid, damper_volume
from tipdamp.meshes.rig import DAMPERS, SIDES, Cells, Rig, contact
from tipdamp.meshes.structured import HEX27, boundary
from tipdamp.meshes.two_blade_rig import build, generate, main

pytest.importorskip("gmsh")
RIG = Rig()
SMALL = 0.5
each_damper = pytest.mark.parametrize("damper", DAMPERS)


@pytest.fixture(scope="module")
def asymmetric():
    return build(RIG, "asymmetric", SMALL)


@each_damper
def test_files_hold_every_group_for_another_reader(damper, tmp_path):
    from tipdamp.readers.dispatch import read_mesh

    paths = generate(RIG, damper, SMALL, tmp_path)  # checks what it wrote
    left, right = ({"round": 31, "flat": 62}[shape] for shape in DAMPERS[damper])
    contacts = {"contact_left": left, "contact_right": right}
    points = {
        "blades": contacts | {"excitation": 1, "patch_1": 5, "patch_2": 5},
        "damper": contacts | {"load_points": 4},
    }
    surfaces = {
        "blades": {"clamp", "cover_left", "cover_right"},
        "damper": {"side_left", "side_right"},
    }
    for body, path in paths.items():
        assert path.name == f"{damper}_{body}.msh"
        assert path.read_bytes().startswith(b"$MeshFormat\n4.1")
        mesh = read_mesh(path)
        assert set(mesh.groups) == {body} | set(points[body]) | surfaces[body]
        assert {k: len(mesh.groups[k]) for k in points[body]} == points[body]
        assert len(mesh.groups[body]) == len(mesh.node) and not mesh.unused


def test_node_order_is_that_of_gmsh():
    import gmsh

    gmsh.initialize()
    try:
        lattice = gmsh.model.mesh.getElementProperties(12)[4]
    finally:
        gmsh.finalize()
    assert np.array_equal(np.reshape(lattice, (27, 3)), HEX27 - 1)


def test_faces_point_outward(asymmetric):
    """Divergence theorem: a third of the flux of the position through the surface is the volume."""
    for mesh in asymmetric:
        faces = boundary(mesh.cells)
        x, w = np.polynomial.legendre.leggauss(3)
        flux = 0.0
        for s, ws in zip(x, w, strict=True):
            for t, wt in zip(x, w, strict=True):
                p, a, b = _on_face(mesh.nodes[faces], s, t)
                flux += ws * wt * np.einsum("ij,ij->", p, np.cross(a, b)) / 3
        assert flux == pytest.approx(cell_volumes(mesh).sum(), rel=1e-12)


def _on_face(nodes, s, t):
    """Position and the two tangents of 9-node faces (k, 9, 3) at (s, t)."""

    def line(u):
        return np.array([u * (u - 1) / 2, 1 - u**2, u * (u + 1) / 2]), np.array(
            [u - 0.5, -2 * u, u + 0.5]
        )

    (f, df), (g, dg) = line(s), line(t)
    i, j = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]).T
    return tuple(
        np.einsum("i,kij->kj", weight, nodes)
        for weight in (f[i] * g[j], df[i] * g[j], f[i] * dg[j])
    )


def test_cylinder_volume_converges_with_fourth_order():
    """Quadratic cells follow an arc with an error of h^4: halving them leaves a sixteenth of the
    missing volume."""
    exact = np.pi * RIG.damper_radius**2 * RIG.length
    base = Cells(axial=15, flat=2, gap=2)
    errors = []
    for n in (1, 2, 4):
        cells = replace(base, flat=2 * n, gap=2 * n)
        errors.append(
            abs(cell_volumes(build(RIG, "cylindrical", cells=cells)[1]).sum() - exact) / exact
        )
    assert errors[0] < 1e-3
    assert 12 < errors[0] / errors[1] < 20 and 12 < errors[1] / errors[2] < 20


def test_flats_take_their_segments_off():
    """Area of a circular segment by the trapezoidal rule over the chord's depth."""
    z = RIG.flat_distance + (RIG.damper_radius - RIG.flat_distance) * np.linspace(0, 1, 200001) ** 2
    segment = trapezoid(2 * np.sqrt(np.maximum(RIG.damper_radius**2 - z**2, 0)), z) * RIG.length
    v = {d: damper_volume(RIG, contact(RIG, d)) for d in DAMPERS}
    assert v["cylindrical"] - v["asymmetric"] == pytest.approx(segment, rel=1e-6)
    assert v["asymmetric"] - v["wedge"] == pytest.approx(segment, rel=1e-6)


@each_damper
def test_damper_sits_in_the_v_without_overlap(damper):
    found = contact(RIG, damper)
    blades, solid = build(RIG, damper, SMALL)
    arm = solid.nodes[:, [0, 2]] - found.centre
    for side in SIDES:
        n, d = found.normal[side], found.distance[side]
        assert (arm @ n).max() == pytest.approx(d, abs=1e-12)
        face = blades.nodes[np.unique(blades.surfaces[f"cover_{side}"])][:, [0, 2]] - found.centre
        assert face @ n == pytest.approx(d, abs=1e-12)
    difference = found.distance["left"] - found.distance["right"]
    # (r - d) / (2 cos 45)
    assert found.centre[0] == pytest.approx(difference / np.sqrt(2), abs=1e-15)
    lowest, highest = (f(found.rows[s][:, 1]) for f, s in ((np.min, "right"), (np.max, "right")))
    if DAMPERS[damper][1] == "flat":
        assert (highest + RIG.cover_margin_above, lowest - RIG.cover_margin_below) == pytest.approx(
            (RIG.height, RIG.height - RIG.cover_height), abs=1e-12
        )


@pytest.mark.parametrize("damper", ["cylindrical", "wedge"])
def test_symmetric_dampers_have_mirror_symmetric_meshes(damper):
    for mesh in build(RIG, damper, SMALL):
        mirrored = mesh.nodes * [-1, 1, 1]
        order, other = (np.lexsort(np.round(p, 9).T) for p in (mesh.nodes, mirrored))
        assert np.abs(mesh.nodes[order] - mirrored[other]).max() < 1e-9


@pytest.mark.parametrize("rows", [3, 4])
def test_rows_are_equally_spaced_and_matched(rows):
    blades, solid = build(RIG, "asymmetric", SMALL, rows)
    check(RIG, "asymmetric", rows, blades, solid)
    points = blades.nodes[blades.node_sets["contact_right"]].reshape(rows, 31, 3)
    # row 0 is the lowest
    assert np.diff(points[:, 0, 2]) == pytest.approx(RIG.flat_width / np.sqrt(2) / (rows - 1))
    corners = set(blades.cells[:, :8].ravel())
    assert set(blades.node_sets["contact_right"].reshape(rows, 31)[:, ::2].ravel()) <= corners


def test_stations_stay_on_a_finer_mesh():
    cells = replace(Cells.of_size(SMALL), axial=30)
    blades, solid = build(RIG, "asymmetric", cells=cells)
    check(RIG, "asymmetric", 2, blades, solid)
    y = blades.nodes[blades.node_sets["contact_left"], 1]
    assert y == pytest.approx(0.07 * np.arange(31) / 30, abs=1e-15)


def _moved(mesh, node, by):
    nodes = mesh.nodes.copy()
    nodes[node] += by
    return replace(mesh, nodes=nodes)


def _torn(mesh):
    """The first cell gets nodes of its own: coincident, and so no longer joined to its
    neighbours."""
    cells = mesh.cells.copy()
    cells[0] = len(mesh.nodes) + np.arange(27)
    return replace(mesh, nodes=np.vstack([mesh.nodes, mesh.nodes[mesh.cells[0]]]), cells=cells)


def _hollow(mesh):
    """Without a cell that neighbours surround, and without that cell's middle node."""
    outside = set(boundary(mesh.cells).ravel())
    inner = next(i for i, c in enumerate(mesh.cells) if not outside & set(c))
    middle = mesh.cells[inner, 26]
    cells = np.delete(mesh.cells, inner, axis=0)
    return replace(
        mesh, nodes=np.delete(mesh.nodes, middle, axis=0), cells=cells - (cells > middle)
    )


@pytest.mark.parametrize(
    "broken, message",
    [
        (lambda m: _moved(m, m.cells[0, 26], 0.01), "inverted"),
        (lambda m: _moved(m, 0, np.nan), "not a number"),
        (_torn, "lie on each other|belong to no cell"),
        (lambda m: replace(m, nodes=np.vstack([m.nodes, [1.0, 1.0, 1.0]])), "belong to no cell"),
        (
            lambda m: replace(m, cells=np.vstack([m.cells, m.cells[:1]])),
            "more than two cells|not closed",
        ),
    ],
)
def test_broken_solid_is_refused(asymmetric, broken, message):
    with pytest.raises(MeshError, match=message):
        check_solid(broken(asymmetric[0]))


def test_hole_inside_is_refused():
    solid = build(RIG, "wedge", cells=replace(Cells.of_size(SMALL), gap=3, ring=2))[1]
    with pytest.raises(MeshError, match="Euler characteristic 4"):
        check_solid(_hollow(solid))


def test_shifted_contact_node_is_refused(asymmetric):
    blades, solid = asymmetric
    node = solid.node_sets["contact_right"][40]
    with pytest.raises(MeshError, match="contact_right: the pairs are up to 2.00e-09 m apart"):
        check(RIG, "asymmetric", 2, blades, _moved(solid, node, [0, 2e-9, 0]))


def test_wrong_volume_is_refused(asymmetric):
    with pytest.raises(MeshError, match="volume"):
        check(replace(RIG, height=1.001 * RIG.height), "asymmetric", 2, *asymmetric)


@pytest.mark.parametrize("size", [0.25, 0.5, 1.0])
def test_coarse_cells_of_a_thick_damper_are_no_wrong_volume(size):
    """One of them follows up to 80 degrees of its arc: 0.4 % of the volume lie beside it. A radius
    that is a thousandth off is still told."""
    rig = replace(RIG, damper_radius=0.006, pitch=0.026)
    blades, solid = build(rig, "cylindrical", size)
    assert check(rig, "cylindrical", 2, blades, solid)
    off = solid.nodes.copy()
    off[:, [0, 2]] += 1e-4 * (off[:, [0, 2]] - contact(rig, "cylindrical").centre)
    with pytest.raises(MeshError, match="damper: volume"):
        check(rig, "cylindrical", 2, blades, replace(solid, nodes=off))


def test_refused_meshes_leave_no_files(tmp_path, monkeypatch, capsys):
    def refused(*_):
        raise MeshError("damper: volume")

    monkeypatch.setattr("tipdamp.meshes.two_blade_rig.check", refused)
    assert main([f"--size={SMALL}", f"--out={tmp_path}"]) == 2
    assert capsys.readouterr().err == "error: damper: volume\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name, value",
    [
        ("height", 0.009),
        ("root_thickness", 0.02),
        ("free_span", 0.05),
        ("free_span", 0.001),
        ("flat_width", 0.0041),
        ("contact_angle", 95.0),
        ("pitch", 0.011),
        ("length", -1.0),
        ("damper_radius", float("nan")),
        ("cover_margin_above", 0.01),
        ("size", 9.0),
        ("rows", 1),
    ],
)
def test_argument_out_of_range_is_refused_by_name(name, value, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([f"--size={SMALL}", f"--out={out}", f"--{name.replace('_', '-')}={value}"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and name in said
    assert not out.exists()


def test_every_length_is_an_argument(tmp_path):
    thicker = {f.name: 1.001 * getattr(RIG, f.name) for f in fields(Rig)}
    arguments = [f"--{k.replace('_', '-')}={v!r}" for k, v in thicker.items()]
    assert main([*arguments, f"--out={tmp_path}", f"--size={SMALL}"]) == 0
    from tipdamp.meshes.mesh_file import read

    check(
        Rig(**thicker),
        "asymmetric",
        2,
        *(read(tmp_path / f"asymmetric_{b}.msh") for b in ("blades", "damper")),
    )


def test_unknown_damper_names_the_nearest():
    with pytest.raises(InputError, match="did you mean 'cylindrical'"):
        build(RIG, "cylinder")
