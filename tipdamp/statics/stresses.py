"""Displacement and stress of whole bodies: under the preload, from the motion of their masters
([preload] stress), and of a vibration, from all reduced dofs ([respond] stress)."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg as sl

from tipdamp.bodies import DAMPER, loads
from tipdamp.bodies.assemble import assemble_bodies, materials
from tipdamp.bodies.read import read_meshes
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.fields.visualization import write_shapes
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.body import Body
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import Material
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.reduction import Reduction
from tipdamp.modal.stress import alternating_stress, half_range, nodal_stress, von_mises
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.study.view import Study

EQUAL = 1e-6  # relative distance of frequencies whose modes may be mixed
SAME = 1e-5  # of the largest coupling: more is not the stored model


class Rest(NamedTuple):
    """displacement : (r,) m; force : (P, 3) N - t1, t2, n of the pairs."""

    displacement: np.ndarray
    pairs: ContactTable
    force: np.ndarray


def keep_stress(
    study: Study, store: Store, shapes: Iterable[tuple[str, Mesh, np.ndarray]], tick: Tick
) -> list[str]:
    """stress_blades.vtu and stress_damper.vtu of the displacements (n, 3) m at rest; the names of
    what was written."""
    files = []
    for i, (name, mesh, shape) in enumerate(shapes):
        tick(0.4 + 0.3 * i, f"stresses of the {name}")
        own, others = materials(study, mesh)
        what = loads.rest_name(study).removeprefix("the ")
        fields = {
            f"displacement (m), {what}": shape,
            f"von Mises stress (Pa), {what}": von_mises(nodal_stress(mesh, own, shape, others)),
        }
        files += write_shapes(store, f"stress_{name}.vtu", mesh, fields)
    return files


def condensed_shapes(
    study: Study, model: ReducedModel, rest: Rest
) -> Iterator[tuple[str, Mesh, np.ndarray]]:
    """(name, mesh, (n, 3) m) of each body at rest, from the motion of its masters.

    The bodies are assembled again: beyond the masters the reduced model knows the static shape only
    as Psi, which costs a back-solve for each of them, and one back-solve with q given on the
    masters is exact for loads inside as well."""
    meshes = read_meshes(study)
    bodies = assemble_bodies(study, meshes, lambda *_: None)
    contact = contact_forces(bodies, rest.pairs, rest.force)
    for body in bodies:
        mesh = meshes[body.name]
        yield (
            body.name,
            mesh,
            static_shape(
                body, model, rest.displacement, body_load(study, body, mesh) - contact[body.name]
            ),
        )


def contact_forces(
    bodies: Sequence[Body], pairs: ContactTable, force: np.ndarray
) -> dict[str, np.ndarray]:
    """{body: (d,) N} what the pairs take off its free dofs, K u + B' f = load; force (P, 3) N along
    t1, t2, n."""
    whole = relative_motion(AssembledBodies(list(bodies)), pairs).T @ force.ravel()
    ends = np.cumsum([body.dofs for body in bodies])
    return {body.name: whole[end - body.dofs : end] for body, end in zip(bodies, ends, strict=True)}


def body_load(study: Study, body: Body, mesh: Mesh) -> np.ndarray:
    """(d,) N on the free dofs: what acts on a body at rest, the pull or the case that [preload]
    names."""
    case = study.preload.case
    force = loads.case_forces(study, case, body, mesh) if case else np.zeros(body.dofs)
    if body.name != DAMPER:
        return force
    return force + loads.case_pull(study, case) * loads.unit_pull(study, body, mesh).force


def static_shape(body: Body, model: ReducedModel, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(n, 3) m: K_II u_I = f_I - K_IB u_B, with the masters' displacement u_B from q."""
    place = {
        (int(body.node[n]), "xyz"[k]): i
        for i, (n, k) in enumerate(zip(body.dof_node, body.dof_direction, strict=True))
    }
    own = np.flatnonzero((model.body == body.name) & (model.direction != "mode"))
    boundary = np.array([place[int(model.node[i]), model.direction[i]] for i in own])
    u = np.zeros(body.dofs)
    u[boundary] = q[own]
    inner = np.setdiff1d(np.arange(body.dofs), boundary)
    u[inner] = Factor(body.K[inner][:, inner]).solve((force - body.K @ u)[inner])
    out = np.zeros((len(body.node), 3))
    out[body.dof_node, body.dof_direction] = u
    return out


@dataclass(frozen=True)
class VibrationStress:
    """Fields at the nodes of a mesh: mean (n,) Pa, von Mises stress of the mean; alternating (n,)
    Pa as in `modal.stress.alternating_stress`; amplitude (n,) m, half of the longest way between
    two places of the node."""

    mean: np.ndarray
    alternating: np.ndarray
    amplitude: np.ndarray


@dataclass(frozen=True)
class WholeBody:
    """A reduced body on its mesh, with the factor of its K_II; others - materials of groups of
    cells."""

    part: Reduction
    mesh: Mesh
    material: Material
    others: dict[str, Material]
    factor: Factor

    def at_rest(self, force: np.ndarray) -> tuple[np.ndarray, float]:
        """(n, 3) m under loads and contact forces (d,) N, and the part of these that is not
        balanced.

        A free body is held where it takes no force; what is not balanced is taken up by its inertia
        (inertia relief)."""
        part, body, b = self.part, self.part.body, len(self.part.boundary)
        held, lost = np.empty(0, dtype=int), 0.0
        if part.rigid:
            R = body.rigid_motions()
            # of forces and of moments
            size = (np.abs(R).T @ np.abs(force)).reshape(-1, 3).max(axis=1)
            lost = float(
                (np.abs(R.T @ force).reshape(-1, 3).max(axis=1) / np.maximum(size, 1e-300)).max()
            )
            force = force - body.M @ (R @ np.linalg.solve(R.T @ (body.M @ R), R.T @ force))
            held = sl.qr(R[part.boundary].T, mode="r", pivoting=True)[1][: R.shape[1]]
        q, moves = np.zeros(len(part.model.K)), np.setdiff1d(np.arange(b), held)
        q[moves] = sl.solve(
            part.model.K[np.ix_(moves, moves)], part.condense_dofs(force)[moves], assume_a="pos"
        )
        return part.recover(q) + self._inside(self.factor.solve(force[part.interior])), lost

    def motion(self, q: np.ndarray, w: float) -> np.ndarray:
        """(n, 3, H+1) m of q (b + m, H+1) m at w rad/s: u_I = Psi q_B + Phi eta          [Craig and
        Bampton 1968]

        and the static shape of those inertia forces that the modes leave out [mode acceleration,
        Williams 1945]."""
        part, body = self.part, self.part.body
        u = np.stack([part.recover(one) for one in q.T], axis=2)
        inertia = body.M @ u[body.dof_node, body.dof_direction] * (w * np.arange(q.shape[1])) ** 2
        for f, unit in ((inertia.real[part.interior], 1), (inertia.imag[part.interior], 1j)):
            left = self.factor.solve(f) - part.Phi @ (part.Phi.T @ f / part.omega[:, None] ** 2)
            u += unit * np.stack([self._inside(one) for one in left.T], axis=2)
        return u

    def vibration(self, rest: np.ndarray, q: np.ndarray, w: float) -> VibrationStress:
        """Of the displacement rest (n, 3) m and the motion q (b + m, H+1) m about it, order 0
        included, at w rad/s."""
        motion = self.motion(q, w)
        mean = self._stress(rest + motion[:, :, 0].real)
        orders = [self._stress(motion[:, :, k]) for k in range(1, q.shape[1])]
        return VibrationStress(
            von_mises(mean),
            alternating_stress(np.stack([0 * orders[0], *orders], axis=2)),
            half_range(motion),
        )

    def _inside(self, u):
        """(n, 3) of a motion of the interior dofs."""
        body, out = self.part.body, np.zeros((len(self.part.body.node), 3))
        out[body.dof_node[self.part.interior], body.dof_direction[self.part.interior]] = u
        return out

    def _stress(self, u):
        return nodal_stress(self.mesh, self.material, u, self.others)


def whole_body(study: Study, model: ReducedModel, part: Reduction, mesh: Mesh) -> WholeBody:
    """A body that was reduced again, for the motion of the stored model. Raises InputError where
    that is of another body."""
    inside = part.interior
    return WholeBody(
        with_modes_of(model, part),
        mesh,
        *materials(study, mesh),
        Factor(part.body.K[inside][:, inside]),
    )


def with_modes_of(model: ReducedModel, part: Reduction) -> Reduction:
    """A body that was reduced again, with the fixed-interface modes of the model: their signs, and
    the mixture of equal ones, are chosen anew each time. They follow from the coupling with the
    masters in the mass matrix, `M_BM`, and from the motion of the contact points, contact shapes
    from that alone; a mode with neither does not move. Raises InputError where the model is of
    another body."""
    own = np.flatnonzero(model.body == part.body.name)
    b = len(part.boundary)
    c = part.contact_shapes
    made, stored = part.model.M[:b, b:], model.M[np.ix_(own[:b], own[b:])]
    if made.shape == stored.shape:
        turned = np.zeros((made.shape[1],) * 2)
        if c:
            motions = [
                one.points[part.body.name].motion[:, columns].toarray()
                for one, columns in ((part.model, np.arange(b, part.model.size)), (model, own[b:]))
            ]
            turned[:c, :c] = np.linalg.lstsq(motions[0][:, :c], motions[1][:, :c], rcond=None)[0]
            size = [np.abs(block).max(initial=1e-300) for block in (made, motions[0])]
            made, stored = (
                np.vstack([mass / size[0], motion / size[1]])
                for mass, motion in zip((made, stored), motions, strict=True)
            )
        apart = np.abs(np.diff(part.omega[c:])) > EQUAL * part.omega[c + 1 :]
        for alike in np.split(np.arange(c, len(turned)), np.flatnonzero(apart) + 1):
            # nearest rotation [Schoenemann 1966]
            U, _, V = np.linalg.svd(made[:, alike].T @ stored[:, alike])
            turned[np.ix_(alike, alike)] = U @ V
        if np.abs(made @ turned - stored).max(initial=0.0) <= SAME * np.abs(stored).max(
            initial=0.0
        ):
            return replace(part, Phi=part.Phi @ turned)
    raise InputError(
        f"the {part.body.name}, reduced again for their stress, have other modes than the stored "
        "model; run the stage reduce again with --force"
    )
