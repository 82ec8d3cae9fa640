"""Event-driven time integration of piecewise-linear laws: an independent check of a periodic
solution.

Every change of state of a contact (stick, slip, lift-off, contact) is located, so that the
integration is of fourth order through all of them. The law comes as a table
(`tipdamp.hbm.laws.piecewise`), the kernels are in `events`.
"""

from dataclasses import dataclass

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.piecewise import PiecewiseLinear
from tipdamp.hbm.time import events, guards
from tipdamp.hbm.time.base import IntegratedCycle
from tipdamp.hbm.time.settings import IntegrationSettings
from tipdamp.hbm.time.stuck_system import OnStuckSystem, stuck_system


@dataclass(frozen=True)
class ExactState:
    """Begin of a period: z (2n,) [Re y, Im y] of the poles; state (P,) and memory (P, m) of the
    contacts."""

    z: np.ndarray
    state: np.ndarray
    memory: np.ndarray


class ExactIntegrator(OnStuckSystem):
    """Event-driven integration of the problem of a HarmonicBalance at angular frequency w (see
    `base.Integrator`).

    Raises InputError where the law has no piecewise-linear table.
    """

    method = "event-driven"

    def __init__(
        self, balance: HarmonicBalance, w: float, settings: IntegrationSettings | None = None
    ) -> None:
        law, contacts = balance.problem.law, balance.problem.contacts
        table = law.piecewise_linear(contacts)
        if table is None:
            raise InputError(f"event-driven integration: law {law.name} is not piecewise linear")
        self.settings = settings = settings or IntegrationSettings()
        self.stuck = stuck_system(balance, w, settings)
        self.piecewise = table
        self.table = _for_kernels(table, balance.springs, balance.own.rest)
        nc, n = len(self.stuck.system.stuck), len(self.stuck.system.s)
        levels = settings.halvings if settings.tolerance > 0 else 1
        self.steps = events.Steps(
            2 * np.pi / (w * settings.steps) / 2.0 ** np.arange(levels),
            np.zeros(levels + 1, bool),
            np.empty((levels + 1, 5, n), complex),
            np.empty((levels + 1, nc, nc)),
        )
        self.control = events.Control(
            settings.tolerance,
            settings.curvature,
            settings.tiny,
            settings.max_steps,
            np.array([self.stuck.motion, self.stuck.force]),
        )

    @property
    def size(self) -> float:
        """m, largest motion so far."""
        return float(self.control.size[0])

    def at_rest(self) -> ExactState:
        """As in `Integrator`."""
        known = self.stuck.known(np.zeros(1))[0].reshape(self.stuck.shape)
        return self._settled(self.stuck.resting(), self._memory(known))

    def on_orbit(self, point: Point) -> ExactState:
        """As in `Integrator`."""
        b, w, shape = self.stuck.balance, self.stuck.w, self.stuck.shape
        tau = np.linspace(0, 4 * np.pi, 2 * self.settings.orbit_samples + 1)
        x = point.x.reshape(*shape, b.nh)
        u, v = x @ fourier.basis(tau, b.H).T, w * x @ fourier.basis_rate(tau, b.H).T
        state, memory = self.piecewise.initial, self._memory(u[:, :, 0])
        for i in range(len(tau)):
            state, memory = self.piecewise.settled(u[:, :, i], v[:, :, i], state, memory)
        return self._settled(self.stuck.on_orbit(point), memory)

    def _memory(self, u: np.ndarray) -> np.ndarray:
        """Memory at t = 0 of a motion u (P, nd): the leading entries of the state of the law."""
        stuck = self.stuck
        state = stuck.law.initial_state(u, stuck.balance.start, stuck.contacts)
        return state[:, : self.piecewise.follows.shape[1]]

    def _settled(self, z: np.ndarray, memory: np.ndarray) -> ExactState:
        """The state at the poles z with a memory (P, m), changed where the motion does not leave it
        there."""
        found = ExactState(np.array(z, dtype=float), self.piecewise.initial, memory)
        for _ in range(60):  # the motion depends on the states where some modes follow statically
            u = self._motion(found)[0].reshape(self.stuck.shape)
            state, settled = self.piecewise.settled(u, 0 * u, self.piecewise.initial, memory)
            moved = np.abs(settled - found.memory).max(initial=0.0)
            same = np.array_equal(state, found.state) and moved <= self.settings.tiny * self.size
            found = ExactState(found.z, state, settled)
            if same or not self.stuck.system.static.any():
                break
        return found

    def _motion(self, state: ExactState) -> np.ndarray:
        """(4, nc) relative motion, its rate, nonlinear force and its rate, at the begin of a
        period."""
        present = self._present(state)
        motion = np.zeros((4, len(present.a)))
        guards.freeze(self.table, present)
        events.instant(self.stuck.system, present, 0.0, present.z, motion)
        return motion

    def _present(self, state: ExactState) -> guards.Present:
        P, nd = self.stuck.shape
        return guards.Present(
            state.z.copy(),
            np.array(state.state, dtype=np.int64),
            np.array(state.memory, dtype=float, order="C"),
            np.zeros((P * nd, nd)),
            np.zeros(P * nd),
        )

    def periods(self, state: ExactState, n: int = 1) -> IntegratedCycle:
        """As in `Integrator`."""
        present, H = self._present(state), self.stuck.balance.H
        record = events.Record(
            np.zeros((len(present.a), H + 1), complex),
            np.zeros(len(present.state)),
            np.zeros(2, np.int64),
        )
        try:
            going = events.begin(self.stuck.system, self.table, present)
            for left in reversed(range(n)):
                going = events.run(
                    self.stuck.system,
                    self.table,
                    self.steps,
                    self.control,
                    present,
                    record,
                    going._replace(recorded=left == 0),
                )
                if going is None:
                    break
        except np.linalg.LinAlgError:  # out of double precision
            going = None
        force = record.G * (self.stuck.w / np.pi)
        force[:, 0] /= 2
        return IntegratedCycle(
            ExactState(present.z, present.state, present.memory),
            force,
            record.dissipated,
            going is not None,
            int(record.count[0]),
            int(record.count[1]),
        )

    def from_vector(self, v: np.ndarray) -> ExactState:
        """As in `Integrator`."""
        n = len(self.stuck.weight)
        return self._settled(v[:n] / self.stuck.weight, v[n:].reshape(self.stuck.shape[0], -1))


def _for_kernels(
    piecewise: PiecewiseLinear, stiffness: np.ndarray, rest: np.ndarray
) -> guards.Table:
    """The table of the nonlinear force g = f - K_c u - f_rest, its guards in the order of their
    states."""
    t, rows = piecewise.resolved(), np.ascontiguousarray
    gamma, diagonal = t.stiffness.copy(), np.arange(t.stiffness.shape[2])
    gamma[:, :, diagonal, diagonal] -= stiffness[:, None]
    order = np.argsort(t.state, kind="stable")
    return guards.Table(
        gamma,
        t.offset - rest[:, None],
        rows(t.by_memory),
        t.follows,
        rows(t.follow_u),
        rows(t.follow_0),
        np.searchsorted(t.state[order], np.arange(len(t.follows) + 1)),
        t.next_state[order],
        t.of_rate[order],
        t.entry[order],
        rows(t.guard_u[:, order]),
        rows(t.guard_memory[:, order]),
        rows(t.guard_0[:, order]),
        rows(t.watched[:, order]),
    )
