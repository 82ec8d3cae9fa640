"""[respond] stress: what is written is the solution of the whole finite-element model."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.modal.craig_bampton import craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.stress_recovery import nodal_stress, von_mises
from tipdamp.results.response_results import StressResult
from tipdamp.stages.run import results_folder
from tipdamp.stages.stress import limits
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.statics.whole_body import WholeBody
from tipdamp.study.study import load_study

meshio = pytest.importorskip("meshio")
STEEL = Material(E=207e9, nu=0.3, density=7850.0)
LEVEL = 0.01  # N: nothing slips
# without damping, below the resonances: the two forces a quarter of a period apart make every node
# move on an ellipse
STUCK = [
    ("modes = 5", "modes = 30"),
    ("modes = 3\n", "modes = 20\n"),
    ("damping_ratio = 0.02", "damping_ratio = 0"),
    (
        'excitation = "touch_one"',
        'excitation = ["touch_one", "touch_two"]\nphase = [90]\nstress = true',
    ),
    ("levels = [1]", f"levels = [{LEVEL}]\nharmonics = [1, 3]\nboth_ways = false"),
    ("[respond]", "[tune]\nstations = 'all'\n[respond]"),
]


def bodies():
    return (
        elastic_body(corner_study.blades(), STEEL, "blades", clamp=["clamp_one", "clamp_two"]),
        elastic_body(corner_study.damper(), STEEL, "damper", free=True),
    )


def solved(folder, *change):
    path = corner_study.write(folder, change=[*STUCK, *change])
    for stage in ("reduce", "preload", "tune", "respond", "stress"):
        assert main([stage, str(path), "--quiet"]) == 0
    store = results_folder(load_study(path), None)
    return store, StressResult.load(store)


def whole_model(pairs, law):
    """Blades and damper unreduced: K, M, the relative motion B of the pairs, and K with the springs
    of their law."""
    parts = bodies()
    K, M = (sp.block_diag([getattr(body, name) for body in parts]).tocsc() for name in "KM")
    B = sp.csr_matrix(relative_motion(AssembledBodies(list(parts)), pairs))
    springs = (
        np.column_stack([law * pairs.kt, law * pairs.kt, pairs.kn]) * (pairs.preload > 0)[:, None]
    )
    return parts, K + B.T @ sp.diags(springs.ravel()) @ B, M


def shape_of(body, u):
    out = np.zeros((len(body.node), 3), dtype=u.dtype)
    out[body.dof_node, body.dof_direction] = u
    return out


@pytest.mark.parametrize(
    "band, basis",
    [
        ("[20000, 20500]", "craig_bampton"),
        ("[100000, 100500]", "craig_bampton"),
        ("[20000, 20500]", "contact_points"),
    ],
)
def test_stuck_stress_against_the_direct_solution(tmp_path, band, basis):
    """At every node to 1e-3 of the largest: alternating, by 720 instants, and mean, of the springs
    under the pull."""
    store, found = solved(
        tmp_path, ("[20000, 40000]", band), ("mu = 0.3", f'mu = 0.3\nreduction = "{basis}"')
    )
    (curve,) = found.curves
    assert curve.H == 3 and curve.files == (
        "vibration_Fe_0.01N_H3_blades.vtu",
        "vibration_Fe_0.01N_H3_damper.vtu",
    )
    pairs = ContactTable.load(store.path("kept.csv"))
    parts, K, M = whole_model(pairs, 1.0)
    force = np.zeros(K.shape[0], dtype=complex)
    for group, factor in (("touch_one", 1), ("touch_two", 1j)):
        for node in (nodes := corner_study.blades().groups[group]):
            force[parts[0].node_dofs([node])[0]] += factor * LEVEL / len(nodes)
    vibration = spsolve((K - (2 * np.pi * curve.hz) ** 2 * M).tocsc(), force)
    pull = np.zeros(K.shape[0])
    for node in (nodes := corner_study.damper().groups["load"]):
        pull[parts[0].dofs + parts[1].node_dofs([node])] = (
            10 * np.array([1, 0, 1]) / np.sqrt(2) / len(nodes)
        )
    rest = np.linalg.lstsq(whole_model(pairs, 0.0)[1].toarray(), pull, rcond=1e-10)[0]
    cut = [parts[0].dofs]
    for body, mesh, u, u_rest in zip(
        parts,
        (corner_study.blades(), corner_study.damper()),
        np.split(vibration, cut),
        np.split(rest, cut),
        strict=True,
    ):
        data = meshio.read(store.path(f"vibration_Fe_0.01N_H3_{body.name}.vtu")).point_data
        assert np.array_equal(data["node"], mesh.node)
        turns = np.exp(2j * np.pi * np.arange(720) / 720)
        motion, tensor = shape_of(body, u), nodal_stress(mesh, STEEL, shape_of(body, u))
        # of one order the range is twice the largest excursion
        alternating = np.max([von_mises((tensor * turn).real) for turn in turns], axis=0)
        amplitude = np.max([np.linalg.norm((motion * turn).real, axis=1) for turn in turns], axis=0)
        mean = von_mises(nodal_stress(mesh, STEEL, shape_of(body, u_rest)))
        for name, expected in (
            ("mean von Mises stress (Pa)", mean),
            ("alternating stress (Pa)", alternating),
            ("displacement amplitude (m)", amplitude),
        ):
            error = np.abs(data[name] - expected).max() / expected.max()
            assert error < 1e-3, (body.name, name)
        places = [p for p in found.curves[0].places if p.body == body.name]
        assert places[0].alternating_Pa == pytest.approx(alternating.max(), rel=1e-3)
        for place in places:
            (i,) = np.flatnonzero(mesh.node == place.node)
            assert place.position_m == tuple(mesh.position[i]) and place.mean_Pa == pytest.approx(
                mean[i]
            )
            assert place.alternating_Pa == pytest.approx(alternating[i], rel=1e-3)


def test_mean_stress_is_that_of_the_preload(tmp_path):
    """With friction that sticks, gravity on the interior and all stations: by the forces of the
    pairs what [preload] stress finds from the motion of the masters."""
    text = (
        "[loads.heavy]\npull = 20\ngravity = [300, 0, 0]\n[preload]\nfriction = true\nstress = "
        "true\ncase = 'heavy'\n[tune]"
    )
    store, _ = solved(
        tmp_path, ("[tune]", text), ("mu = 0.3", "mu = 3"), ("[20000, 40000]", "[20000, 20100]")
    )
    assert (
        np.abs(
            np.genfromtxt(store.path("kept_friction.csv"), delimiter=",", names=True)["T2_N"]
        ).max()
        > 0.1
    )
    for body in ("blades", "damper"):
        rest = meshio.read(store.path(f"stress_{body}.vtu")).point_data[
            "von Mises stress (Pa), load case 'heavy'"
        ]
        mean = meshio.read(store.path(f"vibration_Fe_0.01N_H3_{body}.vtu")).point_data[
            "mean von Mises stress (Pa)"
        ]
        assert np.abs(mean - rest).max() < 1e-8 * rest.max()


def whole_of(part, body=None):
    """The body by what is kept of its reduction."""
    b = len(part.boundary)
    kept = (part.boundary, part.Phi, part.omega, part.model.K[:b, :b])
    return WholeBody.of(body or part.body, *kept)


@pytest.mark.parametrize("which, group", [(0, "touch_one"), (1, "face_x")])
def test_motion_inside_by_one_solve_is_that_of_the_constraint_modes(which, group):
    """Of a held body and of a free one, real and complex; rigid motions to the last digit."""
    body, rng = bodies()[which], np.random.default_rng(0)
    part = craig_bampton(body, body.groups[group], 6, loads=[rng.standard_normal(body.dofs)])
    q = rng.standard_normal((part.model.size, 2)) + 1j * rng.standard_normal((part.model.size, 2))
    found = whole_of(part).recover(q)
    for k in range(2):
        expected = part.recover(q[:, k])[body.dof_node, body.dof_direction]
        assert np.abs(found[:, k] - expected).max() < 1e-9 * np.abs(expected).max()
    if body.free:
        R = body.rigid_motions()
        q = np.vstack([R[part.boundary], np.zeros((len(part.omega), 6))])
        assert np.abs(whole_of(part).recover(q) - R).max() < 1e-13 * np.abs(R).max()


def test_modes_of_another_body_are_refused():
    blades, damper = bodies()
    with pytest.raises(InputError, match="the damper has other dofs than the modes that were kept"):
        whole_of(craig_bampton(blades, blades.groups["touch_one"], 4), damper)


def test_inertia_takes_up_what_is_not_balanced():
    """A free cube pulled on one edge accelerates as a rigid body: K u = f - M a, with the
    resultants of f."""
    body, mesh = bodies()[1], corner_study.damper()
    part = craig_bampton(body, body.groups["face_x"], 4)
    whole = whole_of(part)
    force = np.zeros(body.dofs)
    force[body.node_dofs(body.groups["load"])] = np.tile([1.0, 0, 0], 3)
    shape, lost = whole.at_rest(force)
    left = force - body.K @ shape[body.dof_node, body.dof_direction]
    R = body.rigid_motions()
    assert lost == pytest.approx(1) and R.T @ left == pytest.approx(R.T @ force, abs=1e-9)
    a = np.linalg.lstsq(R, spsolve(body.M.tocsc(), left), rcond=None)[0]
    assert np.linalg.norm(body.M @ (R @ a) - left) < 1e-8 * np.linalg.norm(force)
    edge = np.intersect1d(body.groups["face_x"], corner_study.on(mesh, 2, 0.0))  # straight across
    force[body.node_dofs(edge)] = np.tile([-1.0, 0, 0], 3)
    assert whole.at_rest(force)[1] < 1e-12


def test_safety_by_goodman(tmp_path, capsys):
    """At every node the factor that brings both stresses to the line; twice the limits, twice the
    safety; one of them alone is refused."""
    limits = "fatigue_limit = 2e6\ntensile_strength = 1e7"
    store, found = solved(
        tmp_path,
        ("[20000, 40000]", "[20000, 20100]"),
        ("density = 7850", f"density = 7850\n{limits}"),
    )
    (curve,) = found.curves
    assert [place.body for place in curve.least] == ["blades", "damper"]
    for place, file in zip(curve.least, curve.files, strict=True):
        mesh = meshio.read(store.path(file))
        used = (
            mesh.point_data["alternating stress (Pa)"] / 2e6
            + mesh.point_data["mean von Mises stress (Pa)"] / 1e7
        )
        assert mesh.point_data["safety by Goodman"] == pytest.approx(1 / used, rel=1e-6)
        assert place.safety == pytest.approx(1 / np.nanmax(used), rel=1e-6)
        assert place.alternating_Pa / 2e6 + place.mean_Pa / 1e7 == pytest.approx(1 / place.safety)
    study = tmp_path / "corner.toml"
    study.write_text(study.read_text().replace("fatigue_limit = 2e6\n", ""))
    assert main(["inspect", str(study), "--quiet"]) == 2
    assert "[material] fatigue_limit is missing: safety by Goodman" in capsys.readouterr().err


def test_limits_are_those_of_the_materials():
    """The lower ones at nodes where two materials meet, none where a material has none."""
    mesh = replace(corner_study.damper(), cell_groups={})
    kind, numbers = next(iter(mesh.number.items()))
    mesh = replace(mesh, cell_groups={"tip": numbers[:1]})

    def limits_with(tip, rest):
        study = SimpleNamespace(
            material=SimpleNamespace(fatigue_limit=rest, tensile_strength=2.0),
            materials={"a": SimpleNamespace(group="tip", fatigue_limit=tip, tensile_strength=3.0)},
        )
        return limits(study, mesh)

    tip = np.unique(mesh.cells[kind][:1])
    fatigue, strength = limits_with(5.0, 4.0)
    other = np.setdiff1d(np.unique(mesh.cells[kind][:1]), np.unique(mesh.cells[kind][1:]))
    assert (fatigue[other] == 5.0).all() and (strength[other] == 3.0).all()
    rest = np.setdiff1d(np.arange(len(fatigue)), other)
    assert (fatigue[rest] == 4.0).all() and (strength[rest] == 2.0).all()
    fatigue, _ = limits_with(5.0, None)
    assert (fatigue[tip] == 5.0).all() and np.isnan(np.delete(fatigue, tip)).all()


def test_matrices_have_no_stress(matrices_study, capsys):
    text = matrices_study.read_text()
    assert "[respond]\n" in text
    matrices_study.write_text(text.replace("[respond]\n", "[respond]\nstress = true\n"))
    assert main(["inspect", str(matrices_study), "--quiet"]) == 2
    assert "[respond] stress needs meshes, and the study gives matrices" in capsys.readouterr().err


def test_stage_that_is_not_asked_for(tmp_path, capsys):
    path = corner_study.write(tmp_path, change=[STUCK[-1]])
    assert main(["stress", str(path), "--quiet"]) == 2
    assert (
        "[respond] stress = true is missing, the stage 'stress' needs it" in capsys.readouterr().err
    )
