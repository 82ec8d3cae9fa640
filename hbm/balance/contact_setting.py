"""A setting of the contacts as the parameter of a branch."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import DIFFERENCE, SMALLEST, Rebuild, Scaling
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance, Terms
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.laws.records import Contacts
from tipdamp.hbm.validation import brief, numbers

SETTINGS = ("preload", "mu", "kn", "kt")
HELD = {"pull": "preload", "gap": "preload"}  # by what contacts hold it
NAMES = (*SETTINGS, *HELD)


@dataclass(frozen=True)
class ContactSetting(Scaling):
    """A factor on kn, kt, mu or the preload of every contact, or of some.

    setting : 'kn', 'kt', 'mu', 'preload', 'pull' or 'gap'; contacts : index or indices of these
        contacts of the problem, None takes all
    A pull is a factor on the preloads, as where the contacts stay closed that carry it; a pull that
    moves them makes other preloads. Gaps that the pull has opened follow it, too; the clearance of
    a stop does not: name the contacts that are pressed by the pull. A gap is that of contacts open
    at rest, the negative preload -kn gap, and stays where kn varies.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> ContactSetting("mu", contacts=0).scaled(problem, 0.5).mu  # what it is at 0.5
    array([0.25])
    """

    setting: str
    contacts: tuple | int | None = None
    name: str = field(init=False)

    def __post_init__(self) -> None:
        if self.setting not in NAMES:
            raise InputError(
                f"contact setting '{self.setting}' is unknown; {nearest(str(self.setting), NAMES)}"
            )
        some = ""
        if self.contacts is not None:
            chosen = np.atleast_1d(
                numbers("contacts", self.contacts, "must be indices of contacts")
            )
            if chosen.ndim > 1 or not chosen.size or (chosen % 1).any():
                raise InputError(f"contacts = {brief(self.contacts)}: must be indices of contacts")
            contacts = tuple(map(int, chosen))
            object.__setattr__(self, "contacts", contacts)
            some = f" of contacts {', '.join(map(str, contacts))}"
        object.__setattr__(self, "name", self.setting + some)

    @property
    def stiffens(self) -> bool:
        """kn and kt do."""
        return self.setting in ("kn", "kt")

    @property
    def _held(self) -> str:
        """The field of the contacts that varies."""
        return HELD.get(self.setting, self.setting)

    def check(self, problem: ContactProblem) -> None:
        """Preloads are those of the preloaded origin, gaps are there, and the contacts those of the
        problem."""
        if self.setting in ("preload", "pull") and not problem.preloaded:
            raise InputError(
                f"parameter '{self.setting}': the unloaded origin has gaps, not preloads; "
                "use origin = 'preloaded'"
            )
        P = len(problem.contacts)
        chosen = np.atleast_1d(0 if self.contacts is None else self.contacts)
        if chosen.min() < 0 or chosen.max() >= P:
            raise InputError(
                f"contacts = {brief(self.contacts)}: must be indices from 0 to {P - 1}"
            )
        if self.setting == "gap" and not self.chosen(problem).any():
            raise InputError(
                f"parameter '{self.name}': no contact is open at rest; give one a negative preload "
                "-kn gap"
            )
        if not vars(problem.contacts)[self._held][self.chosen(problem)].any():
            raise InputError(
                f"parameter '{self.name}': is 0 at these contacts, and a factor changes nothing; "
                "give them a value"
            )

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces) at a value."""
        return problem.with_contacts(self.scaled(problem, value)), forces

    def evaluate(
        self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float
    ) -> Linearisation:
        """Linearisation at x (n,) and the factor p."""

        def derivative(balance: HarmonicBalance, t: Terms) -> np.ndarray:
            return -balance.modal_response(t, self.force_rate(balance, t, max(p, SMALLEST)))

        return self._evaluate_at(balance, p)(x, w, derivative=derivative)

    def _evaluate_at(self, balance: HarmonicBalance, p: float) -> Callable[..., Linearisation]:
        """With the factor p."""
        return partial(balance.evaluate, contacts=self.settings_at(balance.problem, p))

    def settings_at(self, problem: ContactProblem, p: float) -> Contacts:
        """Those with the factor; a long Newton step may ask for a negative stiffness: the settings
        end at zero."""
        return self.scaled(problem, max(p, SMALLEST))

    def chosen(self, problem: ContactProblem) -> np.ndarray:
        """(P,) bool, the contacts whose setting varies."""
        mine = np.full(len(problem.contacts), self.contacts is None)
        if self.contacts is not None:
            mine[np.atleast_1d(self.contacts)] = True
        return mine & (problem.contacts.preload < 0) if self.setting == "gap" else mine

    def scaled(self, problem: ContactProblem, value: float) -> Contacts:
        """The settings of the contacts at a value."""
        factor = np.where(self.chosen(problem), value, 1.0)
        changed = {self._held: factor * vars(problem.contacts)[self._held]}
        if self.setting == "kn":
            preload = problem.contacts.preload
            changed["preload"] = np.where(_gaps(problem), factor * preload, preload)
        return replace(problem.contacts, **changed)

    def force_rate(self, balance: HarmonicBalance, t: Terms, value: float) -> np.ndarray:
        """(P, nd, nh) derivative of the contact forces by the factor at a given motion."""
        problem = balance.problem
        if self._held == "preload" and t.forces.by_preload is not None:
            preload = problem.contacts.preload * self.chosen(problem)
            rate = preload[:, None, None] * t.forces.by_preload
            rate[:, :, 0] += balance.own.beyond_rest * self.chosen(problem)[:, None]
            return rate
        scaled = self.scaled(problem, value)
        known = None
        if self.setting == "mu":
            known = problem.law.by_friction(scaled, t.u, t.forces)
        elif self.stiffens:
            known = self._stiffness_rate(balance, t, scaled)
        if known is not None:
            return known * self.chosen(problem)[:, None, None] / value
        h = DIFFERENCE * max(value, 1e-3)
        value = max(value, h)
        after, before = (
            balance.contact_forces(t.u, t.w, self.scaled(problem, value + s)).g for s in (h, -h)
        )
        return (after - before) / (2 * h)

    def _stiffness_rate(
        self, balance: HarmonicBalance, t: Terms, contacts: Contacts
    ) -> np.ndarray | None:
        """(P, nd, nh) derivative of the contact forces by a relative change of kn or kt; None where
        the law does not know it."""
        law = balance.problem.law
        cycle = balance.cycle(contacts)
        if t.forces.by_preload is None:
            return None
        force = t.forces.g + balance.springs[:, :, None] * t.u
        force[:, :, 0] += cycle.rest
        further = cycle.further_springs
        own = t.forces if further is None else t.forces.with_springs(-further, t.u)
        rates = law.by_stiffness(contacts, t.u, force, own)
        if rates is None:
            return None
        if self.setting == "kt":
            return rates[1]
        gaps = _gaps(balance.problem)[:, None]
        with_gap = contacts.preload[:, None, None] * t.forces.by_preload
        with_gap[:, :, 0] += law.stuck_force(contacts)
        return rates[0] + gaps[:, :, None] * with_gap


def _gaps(problem: ContactProblem) -> np.ndarray:
    """(P,) bool, contacts whose preload is -kn gap: their gap stays where kn varies."""
    return (problem.contacts.preload < 0) | (not problem.preloaded)
