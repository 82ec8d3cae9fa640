"""Inside of the contacts over one period of a solved point: motion, forces, sliders, friction work,
energy balance."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm import fourier, tables
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import AnyProblem
from tipdamp.hbm.curve.energy import EnergyBalance
from tipdamp.hbm.curve.equilibrium import KeptPoints
from tipdamp.hbm.curve.solutions import solved_point
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.records import Contacts, Motion
from tipdamp.hbm.laws.uncoupled.law import Jenkins1D
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.validation import check_whole

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes


SAMPLES = 8192  # a period; the friction work of a slip segment converges with their square
MAX_PERIODS = 50  # until the state of a law with memory repeats
REPEATS = 1e-10  # change of the state over a period, of its largest entry


@dataclass(frozen=True)
class ContactCycles:
    """One period of every contact, n instants from 0 to the period, both ends included.

    time : (n+1,) s; motion : (n+1, P, nd) m, relative, from rest; force : (n+1, P, nd) N of the
    law, the preload included; sliders : (n+1, P, s) m, s = 0 for a law without; components : names
    of the nd components
    energy : of the period, by the law itself

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> curve = damped.follow_band((600, 1000), outputs={"tip": 0})
    >>> cycles = contact_cycles(curve, damped, 3)
    >>> isinstance(cycles, ContactCycles), cycles.components
    (True, ('t1',))
    """

    time: np.ndarray
    motion: np.ndarray
    force: np.ndarray
    sliders: np.ndarray
    components: tuple[str, ...]
    energy: EnergyBalance

    def plot(
        self, pair: int = 0, unit: str = "m", ax: "Axes | None" = None, label: str = ""
    ) -> "Axes":
        """Draw the loops of a contact: force over the motion about its mean, a line for each
        component.

        unit : 'm', 'mm' or 'um'; ax : axes of matplotlib to draw on; new ones without;
        label : of the loop in place of its component, and then it has a colour of its own
        Returns the axes. Raises InputError where matplotlib is not installed or the pair is none.
        """
        if not 0 <= pair < self.force.shape[1]:
            raise InputError(f"pair = {pair}: must be 0 to {self.force.shape[1] - 1}")
        motion, force = self.motion[:, pair], self.force[:, pair]
        return pictures.loop(motion, force, self.components, unit, label, ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each instant and contact: time in s, motion in m and force in N of each
        component. Raises InputError where pandas is not installed."""
        instant, contact = np.indices(self.force.shape[:2]).reshape(2, -1)
        columns = {"time": self.time[instant], "contact": contact}
        for k, name in enumerate(self.components):
            columns[f"motion_{name}"] = self.motion[..., k].ravel()
            columns[f"force_{name}"] = self.force[..., k].ravel()
        return tables.frame(columns, "row")

    def to_xarray(self) -> "xarray.Dataset":
        """Motion, force and sliders by instant, contact and component, with their units. Raises
        InputError where xarray is not installed."""
        each = ("time", "contact", "component")
        data = {
            "motion": (each, self.motion, "m"),
            "force": (each, self.force, "N"),
            "sliders": (("time", "contact", "slider"), self.sliders, "m"),
            "friction_energy": (("contact",), self.energy.friction, "J"),
        }
        instants = ("time", self.time, {"units": "s"})
        return tables.dataset(data, {"time": instants, "component": list(self.components)})

    def _repr_html_(self) -> str:
        taken = self.energy.friction
        rows = {
            f"contact {c}": f"{taken[c]:.4g} J, "
            + ", ".join(
                f"{name} up to {f:.4g} N" for name, f in zip(self.components, force, strict=True)
            )
            for c, force in enumerate(np.abs(self.force).max(axis=0))
        }
        return tables.notebook_table(f"Contacts over a period of {self.time[-1]:.4g} s", rows)

    @property
    def friction_work(self) -> np.ndarray:
        """(P,) J per period, from the instants alone: of the tangential forces along the paths of
        their sliders, which move where a contact slips; of a law without sliders, of all its forces
        along the motion."""
        s = self.sliders.shape[2]
        path, force = (self.sliders, self.force[:, :, :s]) if s else (self.motion, self.force)
        return np.einsum("tpi,tpi->p", 0.5 * (force[1:] + force[:-1]), np.diff(path, axis=0))


def whole_motion(
    curve: ForcedResponse, problem: AnyProblem, point: int, parameter: Parameter | None = None
) -> np.ndarray:
    """(r, H+1) m: Fourier coefficients of all dofs of the model at a point of a curve, by its
    index; order 0 is from the state q = 0. Raises InputError as `contact_cycles`.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> motion = whole_motion(curve, problem, 0)
    >>> motion.shape, bool(np.isclose(motion[0, 1], curve.harmonics[0, 0, 1]))
    ((1, 6), True)
    """
    return _kept(curve, problem, point, parameter).motion()[0]


def contact_cycles(
    curve: ForcedResponse,
    problem: AnyProblem,
    point: int,
    n: int = SAMPLES,
    parameter: Parameter | None = None,
) -> ContactCycles:
    """The contacts over one period of a point of a curve, by its index.

    The law is stepped along the motion until its state repeats. Raises InputError where the point
    was not solved, or the problem is not that of the curve.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> cycle = contact_cycles(curve, problem, int(curve.amplitude()[:, 0].argmax()), n=512)
    >>> loop = cycle.motion[:, 0, 0], cycle.force[:, 0, 0]  # m, N: draw it
    >>> print(f"{loop[1].max():.1f} N")  # the limit mu N
    20.0 N
    """
    return _cycles(_kept(curve, problem, point, parameter), check_whole("contact_cycles: n", n, 8))


def energy_balance(
    curve: ForcedResponse, problem: AnyProblem, point: int, parameter: Parameter | None = None
) -> EnergyBalance:
    """Energies of one period of a point of a curve, by its index; friction by the slip of the
    contacts, not by the harmonics of their forces. Raises InputError as `contact_cycles`.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> energy = energy_balance(curve, problem, int(curve.amplitude()[:, 0].argmax()))
    >>> print(f"friction takes {energy.friction.sum() / energy.input:.0%}")
    friction takes 72%
    >>> bool(energy.error < 1e-6)
    True
    """
    return _kept(curve, problem, point, parameter).energies()[0]


def _kept(
    curve: ForcedResponse, problem: AnyProblem, point: int, parameter: Parameter | None
) -> KeptPoints:
    equation, at = solved_point(curve, problem, point, parameter)
    return KeptPoints(equation, [replace(at, detail=equation.evaluate(at.x, at.parameter))])


def _cycles(kept: KeptPoints, n: int) -> ContactCycles:
    balance = kept.balance
    law = kept.problem.law
    w = kept.w[0]
    contacts = kept.contacts[0]
    tau = 2 * np.pi * np.arange(n + 1) / n
    u = np.einsum("th,pdh->tpd", fourier.basis(tau, balance.H), kept.u[0])
    v = w * np.einsum("th,pdh->tpd", fourier.basis_rate(tau, balance.H), kept.u[0])
    start = law.start_at_rest(
        kept.sticks[0], kept.u[0, :, :, 0], kept.h[0, :, :, 0], balance.start, contacts
    )
    force, states = _periodic(law, law.initial_state(u[0], start, contacts), contacts, (u, v, w))
    return ContactCycles(
        tau / w, u, force, states[:, :, : law.sliders], law.components, kept.energies()[0]
    )


def _periodic(
    law: Jenkins1D,
    state: np.ndarray,
    contacts: Contacts,
    motion: tuple[np.ndarray, np.ndarray, float],
) -> tuple[np.ndarray, np.ndarray]:
    """(n+1, P, nd) forces and (n+1, P, ns) states of the law from a state, over the first period at
    whose end the states are those of its beginning; motion : u, v (n+1, P, nd) and rad/s."""
    u, v, w = motion
    n = len(u) - 1
    dt = 2 * np.pi / (w * n)
    for _ in range(MAX_PERIODS):
        forces = []
        states = [state]
        for i in range(1, n + 1):
            force, new = law.step(Motion(u[i], v[i], dt), states[-1], contacts)
            forces.append(force)
            states.append(new)
        change = np.abs(states[-1] - state).max(initial=0.0)
        state = states[-1]
        if change <= REPEATS * np.abs(state).max(initial=0.0):
            return np.array([forces[-1], *forces]), np.array(states)
    raise InputError(f"the state of a contact does not repeat within {MAX_PERIODS} periods")
