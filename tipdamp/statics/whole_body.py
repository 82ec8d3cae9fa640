"""Displacement and stress of whole bodies: under the preload, from the motion of their masters
([preload] stress), and of a vibration, from all reduced dofs ([respond] stress)."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as sl

from tipdamp.bodies.assemble import MeshedBody, meshed_bodies
from tipdamp.bodies.loads import RestLoad, rest_load
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.fields.visualization import write_shapes
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.array_files import open_npz, save_npz
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.body import Body
from tipdamp.modal.eigen import Factor
from tipdamp.modal.reduction import Reduction
from tipdamp.modal.stress_recovery import alternating_stress, half_range, von_mises
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.study.view import Study

KEPT = "inner_modes.npz"  # of the reductions, where [respond] stress asks for the whole bodies
KEPT_OF_EACH = ("boundary", "Phi", "omega")


class Rest(NamedTuple):
    """displacement : (r,) m under a load; force : (P, 3) N - t1, t2, n of the pairs."""

    load: RestLoad
    displacement: np.ndarray
    pairs: ContactTable
    force: np.ndarray


def on_nodes(body: Body, u: np.ndarray) -> np.ndarray:
    """(n, 3, ...) of values (d, ...) on the free dofs of a body; 0 on the others."""
    out = np.zeros((len(body.node), 3, *u.shape[1:]), dtype=u.dtype)
    out[body.dof_node, body.dof_direction] = u
    return out


def keep_stress(
    store: Store, shapes: Iterable[tuple[MeshedBody, np.ndarray]], load: RestLoad, tick: Tick
) -> list[str]:
    """stress_blades.vtu and stress_damper.vtu of the displacements (n, 3) m at rest; the names of
    what was written."""
    files = list[str]()
    what = load.name.removeprefix("the ")
    for i, (one, shape) in enumerate(shapes):
        name = one.body.name
        tick(0.4 + 0.3 * i, f"stresses of the {name}")
        fields = {
            f"displacement (m), {what}": shape,
            f"von Mises stress (Pa), {what}": von_mises(one.stress(shape)),
        }
        files += write_shapes(store, f"stress_{name}.vtu", one.mesh, fields)
    return files


def full_shapes(
    meshed: Sequence[MeshedBody], rest: Rest
) -> Iterator[tuple[MeshedBody, np.ndarray]]:
    """Each body and its displacement (n, 3) m at rest, that of all free dofs."""
    ends = np.cumsum([one.body.dofs for one in meshed])
    for one, own in zip(meshed, np.split(rest.displacement, ends[:-1]), strict=True):
        yield one, on_nodes(one.body, own)


def condensed_shapes(
    assembled: Callable[[], Sequence[MeshedBody]], model: ReducedModel, rest: Rest
) -> Iterator[tuple[MeshedBody, np.ndarray]]:
    """Each body and its displacement (n, 3) m at rest, from the motion of its masters.

    The bodies are assembled again: beyond the masters the reduced model knows the static shape only
    as Psi, which costs a back-solve for each of them, and one back-solve with q given on the
    masters is exact for loads inside as well."""
    meshed = assembled()
    contact = contact_forces([one.body for one in meshed], rest.pairs, rest.force)
    for one in meshed:
        force = rest.load.on(one.body) - contact[one.body.name]
        yield one, on_nodes(one.body, static_shape(one.body, model, rest.displacement, force))


def contact_forces(
    bodies: Sequence[Body], pairs: ContactTable, force: np.ndarray
) -> dict[str, np.ndarray]:
    """{body: (d,) N} what the pairs take off its free dofs, K u + B' f = load; force (P, 3) N along
    t1, t2, n."""
    whole = relative_motion(AssembledBodies(list(bodies)), pairs).T @ force.ravel()
    ends = np.cumsum([body.dofs for body in bodies])
    return {body.name: whole[end - body.dofs : end] for body, end in zip(bodies, ends, strict=True)}


def static_shape(body: Body, model: ReducedModel, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(d,) m: K_II u_I = f_I - K_IB u_B, with the masters' displacement u_B from q."""
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
    return u


@dataclass(frozen=True)
class VibrationStress:
    """Fields at the nodes of a mesh: mean (n,) Pa, von Mises stress of the mean; alternating (n,)
    Pa as `alternating_stress` of the bodies; amplitude (n,) m, half of the longest way between two
    places of the node."""

    mean: np.ndarray
    alternating: np.ndarray
    amplitude: np.ndarray


@dataclass(frozen=True)
class WholeBody:
    """A body as it was reduced: boundary, interior - its dofs; Phi (i, m), omega (m,) rad/s -
    contact shapes, modes and load modes of the reduction; S (b, b) - its stiffness on the masters;
    factor - of K_II. Constraint modes are not kept: a back-solve takes the place of all of them."""

    body: Body
    boundary: np.ndarray
    interior: np.ndarray
    Phi: np.ndarray
    omega: np.ndarray
    S: np.ndarray
    factor: Factor

    @classmethod
    def of(
        cls, body: Body, boundary: np.ndarray, Phi: np.ndarray, omega: np.ndarray, S: np.ndarray
    ) -> "WholeBody":
        """Raises InputError where the modes are of another body."""
        interior = np.setdiff1d(np.arange(body.dofs), boundary)
        if Phi.shape != (len(interior), len(omega)) or S.shape != (len(boundary),) * 2:
            raise InputError(
                f"the {body.name} has other dofs than the modes that were kept of it; run the "
                "stage reduce again with --force"
            )
        K = body.K[interior][:, interior]
        return cls(body, boundary, interior, Phi, omega, S, Factor(K))

    @property
    def rigid(self) -> np.ndarray:
        """(d, 6) rigid motions of a free body, (d, 0) of one that is held."""
        return self.body.rigid_motions() if self.body.free else np.empty((self.body.dofs, 0))

    def recover(self, q: np.ndarray) -> np.ndarray:
        """(d, n) m of the free dofs by q (b + m, n): u_I = Psi q_B + Phi eta [Craig and Bampton
        1968]. Rigid motions are exact to the last digit."""
        q_B, eta = np.split(q, [len(self.boundary)])
        u = self.rigid @ np.linalg.lstsq(self.rigid[self.boundary], q_B, rcond=None)[0]
        bent = q_B - u[self.boundary]
        u[self.boundary] = q_B
        u[self.interior] += self.Phi @ eta - self._solve(
            self.body.K[self.interior][:, self.boundary] @ bent
        )
        return u

    def at_rest(self, force: np.ndarray) -> tuple[np.ndarray, float]:
        """(n, 3) m under loads and contact forces (d,) N, and the part of these that is not
        balanced.

        A free body is held where it takes no force; what is not balanced is taken up by its inertia
        (inertia relief)."""
        body = self.body
        b = len(self.boundary)
        R = self.rigid
        held = np.empty(0, dtype=int)
        lost = 0.0
        if R.shape[1]:
            lost = _unbalanced(R, force)
            force = force - body.M @ (R @ np.linalg.solve(R.T @ (body.M @ R), R.T @ force))
            held = sl.qr(R[self.boundary].T, mode="r", pivoting=True)[1][: R.shape[1]]
        inside = self.factor.solve(force[self.interior])
        condensed = (force - body.K[:, self.interior] @ inside)[self.boundary]
        q = np.zeros((b + len(self.omega), 1))
        moves = np.setdiff1d(np.arange(b), held)
        q[moves, 0] = sl.solve(self.S[np.ix_(moves, moves)], condensed[moves], assume_a="pos")
        u = self.recover(q)
        u[self.interior, 0] += inside
        return on_nodes(body, u)[:, :, 0], lost

    def motion(self, q: np.ndarray, w: float) -> np.ndarray:
        """(n, 3, H+1) m of q (b + m, H+1) m at w rad/s, with the static shape of those inertia
        forces that the modes leave out [mode acceleration, Williams 1945]."""
        u = self.recover(q)
        f = (self.body.M @ u * (w * np.arange(q.shape[1])) ** 2)[self.interior]
        u[self.interior] += self._solve(f) - self.Phi @ (self.Phi.T @ f / self.omega[:, None] ** 2)
        return on_nodes(self.body, u)

    def _solve(self, f: np.ndarray) -> np.ndarray:
        """K_II^-1 f of real or complex columns."""
        if not np.iscomplexobj(f):
            return self.factor.solve(f)
        real, imag = np.split(self.factor.solve(np.hstack([f.real, f.imag])), 2, axis=1)
        return real + 1j * imag


def _unbalanced(rigid: np.ndarray, force: np.ndarray) -> float:
    """The largest part of the forces (d,) N that is left over, of forces and of moments."""
    size = (np.abs(rigid).T @ np.abs(force)).reshape(-1, 3).max(axis=1)
    left = np.abs(rigid.T @ force).reshape(-1, 3).max(axis=1)
    return float((left / np.maximum(size, 1e-300)).max())


@dataclass(frozen=True)
class Stressed:
    """A whole body on its mesh."""

    whole: WholeBody
    on_mesh: MeshedBody

    def vibration(self, rest: np.ndarray, q: np.ndarray, w: float) -> VibrationStress:
        """Of the displacement rest (n, 3) m and the motion q (b + m, H+1) m about it, order 0
        included, at w rad/s."""
        motion = self.whole.motion(q, w)
        mean = self.on_mesh.stress(rest + motion[:, :, 0].real)
        orders = [self.on_mesh.stress(motion[:, :, k]) for k in range(1, q.shape[1])]
        return VibrationStress(
            von_mises(mean),
            alternating_stress(np.stack([0 * orders[0], *orders], axis=2)),
            half_range(motion),
        )


def whole_bodies(study: Study, store: Store, tick: Tick) -> list[Stressed]:
    """The bodies, assembled again, with the modes that `reduce` kept of them and the stiffness of
    its model, to which no springs are added."""
    model = ReducedModel.load(store.path("model.npz"))
    found = []
    with open_npz(store.path(KEPT)) as kept:
        for one in meshed_bodies(study, rest_load(study).cases, tick):
            body = one.body
            tick(0.5, f"the {body.name} inside of its masters")
            boundary, Phi, omega = (kept[f"{body.name}.{name}"] for name in KEPT_OF_EACH)
            own = np.flatnonzero(model.body == body.name)[: len(boundary)]
            S = model.K[np.ix_(own, own)]
            found.append(Stressed(WholeBody.of(body, boundary, Phi, omega, S), one))
    return found


def keep_modes(store: Store, parts: Iterable[Reduction]) -> list[str]:
    """What `whole_bodies` needs of the reductions; the name of what was written."""
    with store.writing(KEPT) as path:
        arrays: dict[str, Any] = {
            f"{part.body.name}.{name}": value
            for part in parts
            for name, value in zip(KEPT_OF_EACH, (part.boundary, part.Phi, part.omega), strict=True)
        }
        save_npz(path, **arrays)
    return [KEPT]
