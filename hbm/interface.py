"""Interface reduction: a model of hundreds of pairs in the few shapes that a forced response needs.

With all closed pairs stuck, K_s = K + B' K_c B, the contact acts on the vibration by what some
pairs do beyond their springs: those that slip or lift. Kept are, in the energy of K_s,

    the static shapes of the forces and of unit forces on the followed pairs, those nearest to slip
    or lift-off, and on the motions that are held, with the motions themselves,
    and of their moments (w^2 K_s^-1 M)^j the directions that matter up to the highest frequency,

a block Krylov space with deflation [Bai, Su 2005], in the place of the constraint modes of all
pairs: their characteristic modes [Castanier, Tan, Pierre 2001] would not hold what single points
do. The motion of every pair is kept in these shapes; forces on followed pairs move them exactly in
statics.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from tipdamp.hbm.balance.aft import sample_grid
from tipdamp.hbm.balance.reduced import Space, StuckMatrices
from tipdamp.hbm.balance.restraint import stiff_factor
from tipdamp.hbm.contact import GROUND, ContactTable, relative_motion
from tipdamp.hbm.hold.spring import HeldMotion, with_springs
from tipdamp.hbm.io.array_files import open_npz, save_npz
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.records import Contacts, SliderStart
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.points import ContactPoints
from tipdamp.hbm.ties import levels


@dataclass(frozen=True)
class InterfaceSettings:
    """Of the interface reduction."""

    followed: int = 64  # pairs whose own compliance is kept
    static: float = 1e-9  # of a unit force: less follows from the other ones
    # of a static shape: directions of its moments that are smaller are left out
    moment: float = 2e-3
    moments: int = 12  # at most
    ratio: float = 0.01  # damping ratio of the stuck response by which that is told
    # frequencies of the band at which the nearness to slip is seen, beside its resonances
    grid: int = 41
    steps: int = 81  # factors on the motion by which pairs are ranked
    # of a range of 1e4 of these factors, for laws that are asked for their forces
    halvings: int = 11
    # of the force of the stuck springs: a force that differs by less is theirs
    sticks: float = 1e-3
    # shares of the highest frequency where the error is estimated
    checks: tuple = (0.2, 0.5, 0.8, 1.0)


SETTINGS = InterfaceSettings()


@dataclass(frozen=True)
class InterfaceReduction:
    """model - of modal dofs alone, with a contact point for each node of the pairs; basis : (r, m)
    - q = basis q_m held - what is held, on these dofs: `dataclasses.replace(problem, held=...)` of
    a ContactProblem of the model
    followed : (P,) bool; response_error - estimate of the error of the response to forces and
    followed pairs, of its energy; frequency_error - largest possible error of the stuck frequencies
    up to the end of the band."""

    model: ReducedModel
    basis: np.ndarray
    held: tuple[HeldMotion, ...]
    followed: np.ndarray
    response_error: float
    frequency_error: float

    def save(self, model: str | Path, shapes: str | Path) -> None:
        """Write two .npz files: the model, and all else."""
        self.model.save(model)
        save_npz(
            shapes,
            basis=self.basis,
            followed=self.followed,
            error=[self.response_error, self.frequency_error],
            motion=[one.motion for one in self.held],
            extent=[one.extent for one in self.held],
        )

    @classmethod
    def load(
        cls, model: str | Path, shapes: str | Path, held: Sequence[HeldMotion] = ()
    ) -> "InterfaceReduction":
        """Read what `save` wrote; held - what was held, on the dofs of the whole model."""
        with open_npz(shapes) as z:
            V, followed, error, motion, extent = (
                z[k] for k in ("basis", "followed", "error", "motion", "extent")
            )
        there = tuple(
            replace(one, row=one.row @ V, motion=own, extent=float(far))
            for one, own, far in zip(held, motion, extent, strict=True)
        )
        return cls(ReducedModel.load(model), V, there, followed, *error.tolist())


class Excitation(NamedTuple):
    """forces : (r,) N each, at their largest; band : Hz; harmonics : highest order."""

    forces: Sequence[np.ndarray]
    band: Sequence[float]
    harmonics: int


def reduce_interface(
    model: ReducedModel,
    pairs: ContactTable,
    law: ContactLaw,
    excitation: Excitation,
    held: Sequence[HeldMotion] = (),
    settings: InterfaceSettings = SETTINGS,
) -> InterfaceReduction | None:
    """The model in the shapes that its response takes, all pairs kept.

    pairs : those that carry; held : motions of the model that are held
    (`tipdamp.hbm.hold.spring.held_motions`)
    None where that makes nothing smaller, and where stuck pairs leave a motion free.
    """
    contacts = Contacts(pairs.kn * pairs.weight, pairs.kt * pairs.weight, pairs.mu, pairs.preload)
    B = _motion_of_law(model, pairs, law)
    k = (law.stuck_stiffness(contacts) * (pairs.preload > 0)[:, None]).ravel()
    K = with_springs(model.K + (B.T * k) @ B, [one for one in held if not one.mean])
    factor = stiff_factor(K)
    if factor is None:
        return None
    system = StuckMatrices(model.M, K, None, settings.ratio, *factor)
    top = 2 * np.pi * max(excitation.band)
    parts = [part for f in excitation.forces for part in (np.real(f), np.imag(f))]
    loads = np.column_stack([part for part in parts if np.any(part)])
    space = Space(system, system.force(loads / np.linalg.norm(loads, axis=0)))
    grow(space, space.force, top, settings)
    followed = nearest_to_slip(space, law, contacts, B, loads, np.array(excitation.band), settings)
    holds = [row for one in held for row in (one.row, K @ one.motion)]
    columns = np.vstack([B[np.repeat(followed, len(law.components))], *holds]).T
    columns = columns[:, columns.any(axis=0)]  # a side that cannot move takes no force
    grow(space, system.force(columns), top * excitation.harmonics, settings)
    basis = space.basis
    if basis.shape[1] > model.size // 2:
        return None
    errors = estimated(space, np.hstack([space.force, system.force(columns)]), top, settings)
    V = system.motion(basis)
    there = _held_in_shapes(held, V, K, loads)
    return InterfaceReduction(_in_shapes(model, pairs, V), V, there, followed, *errors)


def _held_in_shapes(
    held: Sequence[HeldMotion], V: np.ndarray, K: np.ndarray, loads: np.ndarray
) -> tuple[HeldMotion, ...]:
    """What is held, on the shapes V (r, m); K : stuck; loads : (r, n)."""
    # of forces, on the dofs and on the new ones
    size = float(np.linalg.norm(loads) / np.linalg.norm(V.T @ loads))
    return tuple(
        replace(one, row=one.row @ V, motion=V.T @ (K @ one.motion), extent=size * one.extent)
        for one in held
    )


def _in_shapes(model: ReducedModel, pairs: ContactTable, V: np.ndarray) -> ReducedModel:
    """The model in the shapes V (r, m), with the points of the pairs."""
    bodies = dict.fromkeys([*pairs.blade_body.tolist(), *pairs.damper_body.tolist()])
    return ReducedModel.from_matrices(
        *(_projected(V, matrix) for matrix in (model.M, model.K, model.C)),
        body="modes",
        points={body: _points(model, pairs, body, V) for body in bodies if body != GROUND},
        loads={name: V.T @ f for name, f in model.loads.items()},
        provenance=model.provenance,
    )


def grow(space: Space, block: np.ndarray, top: float, settings: InterfaceSettings) -> None:
    """Take in the columns (r, n) of a block and the directions of their moments at `top` rad/s that
    matter."""
    block = block / np.linalg.norm(block, axis=0)
    for j in range(settings.moments + 1):
        for _ in range(2):
            block = block - space.basis @ (space.basis.T @ block)
        Q, R = la.qr(block, mode="economic", check_finite=False)
        U, size, _ = la.svd(R)
        good = size > (settings.moment if j else settings.static)
        if not good.any():
            return
        new = Q @ U[:, good]
        space.add(new)
        block = top**2 * space.system.times(space.system.mass, new * size[good])


def nearest_to_slip(
    space: Space,
    law: ContactLaw,
    contacts: Contacts,
    B: np.ndarray,
    loads: np.ndarray,
    band: np.ndarray,
    settings: InterfaceSettings,
) -> np.ndarray:
    """(P,) bool: the pairs that stick up to the smallest multiple of the stuck response to the
    loads (r, n)."""
    amplitude = _largest_motion(space, B, loads, band, settings).reshape(len(contacts), -1)
    factors = np.logspace(-4, 4, settings.steps)
    sticks = np.sum([law.sticks_surely(contacts, one * amplitude) for one in factors], axis=0)
    if sticks.any():
        order = np.argsort(sticks, kind="stable")
    else:
        order = by_force(law, contacts, amplitude, np.pi * band.sum(), settings)
    found = np.zeros(len(contacts), dtype=bool)
    found[order[: settings.followed]] = True
    return found


def _largest_motion(
    space: Space, B: np.ndarray, loads: np.ndarray, band: np.ndarray, settings: InterfaceSettings
) -> np.ndarray:
    """(P nd,) m, of the stuck response over the band, of all loads together."""
    receptance = space.receptance()
    own, low, high = receptance.frequencies, band.min(), band.max()
    hz = np.r_[np.linspace(low, high, settings.grid), own[(own > low) & (own < high)]]
    factors = receptance.factors(2 * np.pi * hz)[0]
    shapes, push = B @ receptance.shapes, receptance.shapes.T @ loads
    return sum(np.abs(shapes @ (factors * one[:, None])).max(axis=1) for one in push.T)


def by_force(
    law: ContactLaw,
    contacts: Contacts,
    amplitude: np.ndarray,
    omega: float,
    settings: InterfaceSettings,
) -> np.ndarray:
    """(P,) contacts in the order in which they leave their stuck springs as their motion grows from
    small multiples of the amplitude (P, nd): by the vibrating part of the force that their law
    gives; then by the size of that part."""
    grid = sample_grid(1, law.default_samples(1))
    start = SliderStart(np.zeros((len(contacts), law.sliders)), False)
    springs = np.linalg.norm(law.stuck_stiffness(contacts) * amplitude, axis=1)

    def off(factor: np.ndarray) -> np.ndarray:
        x = np.zeros((*amplitude.shape, 3))
        x[:, :, 1] = factor[:, None] * amplitude
        g = law.harmonics(contacts, x, start, grid, omega).g
        return np.linalg.norm(g[:, :, 1:], axis=(1, 2))

    low, high = np.full(len(contacts), -2.0), np.full(len(contacts), 2.0)
    for _ in range(settings.halvings):
        middle = (low + high) / 2
        sticks = off(10**middle) <= settings.sticks * 10**middle * springs
        low, high = np.where(sticks, middle, low), np.where(sticks, high, middle)
    return np.lexsort((levels(-off(np.ones(len(contacts)))), low))


def estimated(
    space: Space, columns: np.ndarray, top: float, settings: InterfaceSettings
) -> tuple[float, float]:
    """(error of the response to columns (r, n) up to `top` rad/s, of the frequencies below it).

    The residual of the undamped response is orthogonal to the basis: w^2 P y, P = (1 - V V') M V. A
    frequency is as far from a true one as the residual of its shape lets it be
    [Weinstein 1934]."""
    (mass,), products = space.projected(), space.products[0]
    outside = products - space.basis @ (space.basis.T @ products)
    period2, modes = la.eigh(mass)
    push = modes.T @ (space.basis.T @ (columns / np.linalg.norm(columns, axis=0)))
    left = outside @ modes
    response = 0.0
    for w in top * np.array(settings.checks):
        gain = 1 / (
            1 - w**2 * period2 + 2j * space.system.ratio * w * np.sqrt(np.maximum(period2, 0))
        )
        y = gain[:, None] * push
        error = w**2 * np.linalg.norm(left @ y, axis=0) / np.linalg.norm(y, axis=0)
        response = max(response, float(error.max()))
    low = period2 > 1 / top**2
    frequency = np.linalg.norm(left[:, low], axis=0) / (2 * period2[low])
    return response, float(frequency.max(initial=0.0))


def _motion_of_law(model: ReducedModel, pairs: ContactTable, law: ContactLaw) -> np.ndarray:
    """(P nd, r) relative motion of the pairs along the components of the law."""
    rows = [["t1", "t2", "n"].index(c) for c in law.components]
    return relative_motion(model, pairs)[
        (3 * np.arange(len(pairs))[:, None] + rows).ravel()
    ].toarray()


def _projected(V: np.ndarray, matrix: np.ndarray | None) -> np.ndarray | None:
    if matrix is None:
        return None
    small = V.T @ matrix @ V
    return (small + small.T) / 2


def _points(model: ReducedModel, pairs: ContactTable, body: str, V: np.ndarray) -> ContactPoints:
    """Every node of the pairs on a body as a contact point on the new dofs."""
    bodies = np.r_[pairs.blade_body, pairs.damper_body]
    numbers = np.unique(np.r_[pairs.blade_node, pairs.damper_node][bodies == body])
    return ContactPoints(numbers, np.zeros((len(numbers), 3)), model.motion_of(body, numbers) @ V)
