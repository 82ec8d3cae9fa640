"""What an evaluation of a contact law of the user's own takes: one is made, with as many contacts
and samples as the run will have."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from tipdamp.hbm.balance.aft import evaluate, sample_grid, slider_start
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import Contacts
from tipdamp.study.own_law import own_law
from tipdamp.study.schema import Respond


@dataclass(frozen=True)
class LawCostSettings:
    """The motion at which a law is timed, and what is taken where its file may not run."""

    contact: tuple[float, float, float, float] = (1e6, 1e6, 0.5, 20.0)  # kn, kt, mu, preload
    omega: float = 6e3  # rad/s
    # m of the first component, some hundredths of the way to slip as at most points of a curve; and
    # what each next one has of it: along its axis a damper hardly moves
    motion: float = 3e-7
    next: float = 1e-5
    instants: int = 256  # of a period, where the study names no other number of samples
    # s an instant, and s an instant and contact more [Dahl, creeping]
    instant: float = 1e-4
    instant_and_contact: float = 3e-6


SETTINGS = LawCostSettings()


def cycles(settings: Respond, contacts: int, orders: Sequence[int]) -> dict[int, float]:
    """{H: s} of an evaluation over a period; empty for shipped laws, whose kernels cost little."""
    choice = settings.law
    if not choice.file or choice.folder is None:
        return {}
    file, _, name = choice.name.rpartition(":")
    parameters = tuple(sorted(choice.parameters.items()))
    law = choice.folder / file, choice.content, name, parameters
    found = {}
    for H in orders:
        instants = settings.samples or SETTINGS.instants
        try:
            found[H] = _timed(*law, contacts, H, instants)
        except InputError:  # its file may not run
            found[H] = instants * (SETTINGS.instant + SETTINGS.instant_and_contact * contacts)
    return found


@cache
def _timed(
    path: Path,
    content: str,
    name: str,
    parameters: tuple[tuple[str, float], ...],
    contacts: int,
    H: int,
    samples: int,
) -> float:
    """CPU s of the second of two evaluations: the first one loads kernels."""
    law = own_law(path, content, name, dict(parameters))
    settings = Contacts(*np.tile(np.array(SETTINGS.contact)[:, None], contacts))
    moved = np.zeros((contacts, len(law.components), 2 * H + 1))
    each = SETTINGS.motion * SETTINGS.next ** np.arange(len(law.components))
    moved[:, :, 1] = each * np.linspace(0.2, 1.0, contacts)[:, None]
    moved[:, 1:, 2] = moved[:, 1:, 1]  # out of phase with the first
    start = slider_start("zero_force", contacts, law.sliders)
    grid = sample_grid(H, samples)
    with np.errstate(all="ignore"):
        evaluate(law, settings, moved, start, grid, SETTINGS.omega)
        began = time.process_time()
        evaluate(law, settings, moved, start, grid, SETTINGS.omega)
    return time.process_time() - began
