"""What an integrator offers to `shooting` and `comparison`, and what it gives back."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.time.settings import IntegrationSettings
from tipdamp.hbm.time.stuck_system import StuckSystem


@dataclass(frozen=True)
class IntegratedCycle:
    """Where an integration over whole periods ends, and what its last period was.

    state : at the end, of the kind that the integrator takes
    force : (P nd, H+1) complex harmonics of the nonlinear force g = f - K_c u - f_rest, N
    dissipated : (P,) J that each contact took out of the motion
    finished : False where a period took more steps than allowed, then the rest means nothing
    steps, events : how many there were, over all periods
    """

    state: Any
    force: np.ndarray
    dissipated: np.ndarray
    finished: bool
    steps: int
    events: int


class Integrator(Protocol):
    """Time integration of the contact problem of a harmonic balance under its periodic forces.

    stuck : the linear side; settings; size : m, largest motion so far; method : how it integrates,
    for messages"""

    stuck: StuckSystem
    settings: IntegrationSettings
    method: str

    @property
    def size(self) -> float:
        """m, largest motion so far."""

    def at_rest(self) -> Any:
        """State at t = 0 on the steady stuck motion, the sliders where the start of the balance
        puts them."""

    def on_orbit(self, point: Point) -> Any:
        """State at t = 0 of a solution of the harmonic balance."""

    def periods(self, state: Any, n: int = 1) -> IntegratedCycle:
        """n periods from a state at the begin of a period."""

    def vector(self, state: Any) -> np.ndarray:
        """(k,) the state as numbers in m, the unknowns of shooting."""

    def from_vector(self, v: np.ndarray) -> Any:
        """The state that `vector` makes of it, brought to where the motion allows it."""

    def change(self, before: Any, cycle: IntegratedCycle) -> float:
        """Change of motion and memory over a cycle from the state before, relative to the vibration
        in it."""
