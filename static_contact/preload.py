"""Unilateral static contact of the free damper: the signed preload of every pair.

    K q + B_n' N = f,    N = max(0, kn (B_n q - g0))

The elastic bodies are already condensed on the pairs (Schur stiffness), so that what remains is a small
complementarity problem. With all pairs closed A = K + B_n' kn B_n is factored once; each set of open pairs is a
low-rank correction on the compliance G = B_n A^-1 B_n', and a further load or gap costs milliseconds.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.model import ReducedModel

_NEWTON_STEPS = 60
_PIVOTS_PER_PAIR = 20
LOAD_TOLERANCE = 1e-7   # of the load's reach: matrices from text files have eight digits
FREE_STIFFNESS = 3e-7   # of the stiffness of the nodes held one by one


@dataclass(frozen=True)
class Motion:
    """A rigid motion of the bodies that no contact normal resists, and how the load acts along it.

    name - for example 'roll about the damper axis'; unit - 'N' or 'N m'; load - of the applied loads along it.
    """

    name: str
    unit: str
    load: float


@dataclass(frozen=True)
class Preload:
    """pairs - the table with its preload; displacement : (r,) m; motions - free ones and the load along each
    held : {name: amount} - load along free motions that was taken up in the reference state (empty by default)
    residual - |K q + B' N - f| / |f|
    balance - |sum of contact forces and loads| / |sum of loads| on the floating dampers, None where none floats
    iterations - Newton steps; method - 'newton', or 'pivoting' after cycling
    """

    pairs: ContactTable
    displacement: np.ndarray
    motions: tuple
    held: dict
    residual: float
    balance: float | None
    iterations: int
    method: str


class StaticContact:
    """The frictionless problem of one model and one set of pairs, factored once, solved for many loads."""

    def __init__(self, model: ReducedModel, pairs: ContactTable):
        if not len(pairs) or not pairs.carrying.any():
            raise InputError("no contact pairs: a free damper needs at least one pair on two sides")
        self.model, self.pairs = model, pairs
        self.B = relative_motion(model, pairs)[2::3].toarray()
        self.kn = pairs.kn * pairs.weight
        K = model.K + self.B.T * self.kn @ self.B
        self.rigid = _rigid_motions(model)
        self.free, self.names, self.coefficients, gauge = _free_motions(self.rigid, model, K)
        try:
            # the gauge carries no force (no load along it is accepted), it only makes the free motions definite
            self.factor = sl.cho_factor(K + gauge)
        except np.linalg.LinAlgError:
            raise InputError("a motion meets no stiffness and is not a rigid motion of a body whose node positions "
                             "are known: the model's K is singular") from None
        self.compliance = self.B @ sl.cho_solve(self.factor, self.B.T)

    def solve(self, load: np.ndarray, *, hold: bool = False) -> Preload:
        """Preloads under load (r,) N on the dofs of the model.

        A load along a motion that no contact resists raises InputError with its amount; with hold=True it is taken
        up in the reference state instead, and reported.
        """
        load = np.asarray(load, dtype=float)
        motions = tuple(Motion(name, unit, float(amount)) for (name, unit), amount
                        in zip(self.names, self.free.T @ load, strict=True))
        scale = np.abs(self.free).max(axis=0, initial=0.0) * np.abs(load).sum()
        loaded = [m for m, s in zip(motions, scale, strict=True) if abs(m.load) > LOAD_TOLERANCE * s]
        if loaded and not hold:
            raise InputError("; ".join(f"{m.name} is loaded: {abs(m.load):.3g} {m.unit}, and no contact resists it"
                                       for m in loaded))
        applied = load - self._taken_up(loaded) if loaded else load
        start = self.B @ sl.cho_solve(self.factor, applied)
        u, iterations, method = self._active_set(start)
        force = np.where(self.pairs.weight > 0, np.maximum(0.0, self.kn * (u - self.pairs.gap)), 0.0)
        q = sl.cho_solve(self.factor, applied - self.B.T @ (force - self.kn * u))
        left = self.model.K @ q + self.B.T @ force - applied
        preload = self.kn * (u - self.pairs.gap)
        return Preload(pairs=self.pairs.replace(preload=preload), displacement=q, motions=motions,
                       held={m.name: m.load for m in loaded}, residual=_ratio(left, applied),
                       balance=self._balance(load, force), iterations=iterations, method=method)

    def _taken_up(self, loaded):
        """Nodal forces that do the loads' work along the loaded free motions: pure couples against rolls, pure forces
        against slides, so that the balance of forces on the normals stays what it was."""
        taken = np.zeros(self.model.size)
        for motion in loaded:
            coefficients = self.coefficients[:, self.names.index((motion.name, motion.unit))]
            lead = np.tile(np.repeat([motion.unit == "N", motion.unit == "N m"], 3), len(coefficients) // 6)
            part = np.where(lead, coefficients, 0.0)
            resultant = motion.load * part / (part @ part)
            taken += self.rigid @ np.linalg.lstsq(self.rigid.T @ self.rigid, resultant, rcond=None)[0]
        return taken

    def _displacement(self, start, closed):
        """Normal motion at the pairs for a given set of closed ones."""
        kn, gap = self.kn, self.pairs.gap
        open_ = ~closed
        A = np.eye(len(kn)) - self.compliance * (kn * open_)
        right = start + self.compliance @ (kn * gap * closed)
        u = np.linalg.solve(A, right)
        if not np.isfinite(u).all() or np.linalg.norm(A @ u - right) > 1e-8 * (np.linalg.norm(right) + 1e-300):
            raise InputError(f"the {int(closed.sum())} pairs that stay closed do not hold the damper")
        return u

    def _active_set(self, start):
        """Semismooth Newton on the closed set, then one pair at a time (least index), which cannot cycle."""
        closed = self.pairs.carrying.copy()
        seen = set()
        for step in range(1, _NEWTON_STEPS + 1):
            u = self._displacement(start, closed)
            new = (u > self.pairs.gap) & self.pairs.carrying
            if (new == closed).all():
                return u, step, "newton"
            if new.tobytes() in seen or not new.any():
                break
            seen.add(new.tobytes())
            closed = new
        for step in range(1, _PIVOTS_PER_PAIR * len(closed) + 1):
            wrong = np.flatnonzero(((u > self.pairs.gap) & self.pairs.carrying) != closed)
            if not len(wrong):
                return u, step, "pivoting"
            closed = closed.copy()
            closed[wrong[-1]] ^= True
            u = self._displacement(start, closed)
        raise RuntimeError("the set of closed pairs was not found: this should not happen, please report the case")

    def _balance(self, load, force):
        """Sum of the contact forces and the load on the dampers that float, against the load; None where none does."""
        total, left = 0.0, 0.0
        for body in dict.fromkeys(self.pairs.damper_body.tolist()):
            motions = np.array([(self.model.body == body) & (self.model.direction == d) for d in "xyz"], dtype=float).T
            stiffness = np.abs(self.model.K @ motions).max(initial=0.0)
            if motions.any() and stiffness < FREE_STIFFNESS * np.abs(self.model.K).max():
                total += np.linalg.norm(motions.T @ load) ** 2
                left += np.linalg.norm(motions.T @ (load - self.B.T @ force)) ** 2
        return float(np.sqrt(left / total)) if total > 0 else None


def preload(model: ReducedModel, pairs: ContactTable, load: np.ndarray, *, hold: bool = False) -> Preload:
    """One load case of `StaticContact`."""
    return StaticContact(model, pairs).solve(load, hold=hold)


def _ratio(a, b):
    size = np.linalg.norm(b)
    return float(np.linalg.norm(a) / size) if size > 0 else float(np.linalg.norm(a))


def _rigid_motions(model: ReducedModel) -> np.ndarray:
    """(r, 6 b): unit translations along and rotations about x, y, z of every body whose node positions are known.

    Rotations are about the mean position of the body's nodes.
    """
    blocks = []
    for body in dict.fromkeys(model.body.tolist()):
        rows = np.flatnonzero((model.body == body) & (model.direction != "mode"))
        if not len(rows) or not np.isfinite(model.position[rows]).all():
            continue
        axis = np.array([("x", "y", "z").index(d) for d in model.direction[rows]])
        arm = model.position[rows] - model.position[rows].mean(axis=0)
        motions = np.zeros((model.size, 6))
        motions[rows, axis] = 1.0
        for k in range(3):
            motions[rows, 3 + k] = np.cross(np.eye(3)[k], arm)[np.arange(len(rows)), axis]
        blocks.append(motions)
    return np.hstack(blocks) if blocks else np.zeros((model.size, 0))


def _free_motions(rigid, model, K):
    """Rigid motions that neither the bodies nor the contact normals resist: (r, m), names, their coefficients in the
    columns of `rigid`, and the gauge (r, r).

    The stiffness that each rigid motion meets is measured against that of its nodes held one by one.
    """
    scale = np.sqrt(np.einsum("ij,i,ij->j", rigid, model.K.diagonal(), rigid))
    used = np.flatnonzero(scale > 0)
    unit = rigid[:, used] / scale[used]
    lam, z = np.linalg.eigh(unit.T @ K @ unit)
    count = int((lam < FREE_STIFFNESS).sum())
    if not count:
        return np.zeros((model.size, 0)), [], np.zeros((rigid.shape[1], 0)), 0.0
    coefficients = np.zeros((rigid.shape[1], count))
    coefficients[used] = z[:, :count] / scale[used, None]
    reduced, names = _name_motions(rigid, coefficients.T)
    free = rigid @ reduced.T
    basis = np.linalg.qr(free)[0]
    return free, names, reduced.T, np.median(model.K.diagonal()) * (basis @ basis.T)


def _name_motions(rigid, coefficients):
    """Unit rigid motions that span the free ones: each named after the slide or rotation that leads it.

    Row reduction of coefficients (m, 6 f) with complete pivoting, rotations weighed by the size of the body.
    """
    arm = np.linalg.norm(rigid[:, 3:6]) / np.linalg.norm(rigid[:, :3])
    weight = np.tile([1.0, 1.0, 1.0, arm, arm, arm], rigid.shape[1] // 6)
    rows, names = coefficients.copy(), [None] * len(coefficients)
    label = [(f"slide along {a}", "N") for a in "xyz"] + [(f"roll about {a}", "N m") for a in "xyz"]
    for _ in names:
        left = [i for i, name in enumerate(names) if name is None]
        i, j = np.unravel_index(np.abs(rows[left] * weight).argmax(), (len(left), rows.shape[1]))
        i = left[i]
        names[i] = label[j % 6]
        rows[i] /= rows[i, j]
        for other in range(len(rows)):
            if other != i:
                rows[other] -= rows[other, j] * rows[i]
    return rows, names
