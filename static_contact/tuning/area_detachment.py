"""Detachment by area: the closed part of every side shrinks by the same share until the stuck
frequency meets a target.

Contact points of unlike meshes lie in no stations. What is kept of them is an area: continuous, the
point at its edge with a part of its own, so that it does not depend on where the mesh has its
points; or cell by cell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.contact.contact_cells import Fade
from tipdamp.static_contact.tuning.station_detachment import (
    DetachmentOptions,
    NotReachable,
    search_of,
)
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly

if TYPE_CHECKING:
    from tipdamp.static_contact.tuning.stuck_search import StuckSearch


@dataclass(frozen=True)
class AreaStep:
    """share - kept part of the closed area of every side; Hz; mac as in `StuckModes`."""

    share: float
    hz: float
    mac: float


@dataclass(frozen=True)
class AreaDetachment:
    """pairs - the table with its weights times what is kept of each contact; history - the shares
    that were tried, the largest first; hz_per_share - change of the stuck frequency with the share;
    target_hz - None where it was given."""

    pairs: ContactTable
    chosen: AreaStep
    history: tuple[AreaStep, ...]
    hz_per_share: float
    target_hz: float | None


@dataclass(frozen=True)
class AreaSettings:
    """Of the search for a share."""

    # shares at first; two crossings of a target between two of them are not told apart
    tried: int = 33
    nearest: float = 1e-9  # of the whole area: to which the share is found


SETTINGS = AreaSettings()


def detach_area(
    assembly: StuckAssembly,
    pairs: ContactTable,
    fade: Fade,
    target_hz: float,
    follow: np.ndarray,
    options: DetachmentOptions,
    progress: Callable | None = None,
) -> AreaDetachment:
    """Shrink the closed part of all sides until the tracked stuck frequency meets the target, or as
    nearly as whole cells let it (`fade.whole()`).

    follow (r,) : mass-normalised shape of the tracked mode; progress(step, part done); of the
    options springs, load, conserve and met_hz count. The largest share that meets the target is
    taken. Raises InputError "not reachable: a..b Hz" where none does.
    """
    search = search_of(assembly, pairs, follow, options)
    whole, shares, tried = _tried(fade)
    history: list[AreaStep] = []
    for k, i in enumerate(tried):
        history.append(_step(search, fade, shares[i]))
        if progress:
            progress(history[-1], (k + 1) / len(tried))
    i = _crossing(history, target_hz, whole)
    if whole:
        history[i + 1 : i + 1] = [
            _step(search, fade, s) for s in shares[tried[i] + 1 : tried[i + 1]]
        ]
        chosen = min(history[i:], key=lambda step: abs(step.hz - target_hz))
    else:
        ends = history[i + 1].share, history[i].share
        chosen = _between(search, fade, ends, target_hz)
        if abs(chosen.hz - target_hz) > options.met_hz:
            raise InputError(
                f"target {target_hz:g} Hz: the tracked mode jumps from one mode to another where "
                f"{100 * chosen.share:.3g} % of the closed area are kept, and no share meets the "
                f"target (nearest {chosen.hz:.1f} Hz)"
            )
    return _found(search, fade, chosen, history, target_hz)


def keep_area(
    assembly: StuckAssembly,
    pairs: ContactTable,
    fade: Fade,
    share: float,
    follow: np.ndarray,
    options: DetachmentOptions,
) -> AreaDetachment:
    """Keep a share (0..1] of the closed area of every side. Raises InputError where that is less
    than one cell."""
    search = search_of(assembly, pairs, follow, options)
    whole, shares, tried = _tried(fade)
    if whole:
        if share < shares[-1] - SETTINGS.nearest:
            raise InputError(
                f"{100 * share:.3g} % of the closed area is less than one cell, which is "
                f"{100 * shares[-1]:.3g} %: keep more, or take smaller cells"
            )
        share = shares[shares <= share + SETTINGS.nearest][0]
    chosen = _step(search, fade, share)
    return _found(search, fade, chosen, [_step(search, fade, s) for s in shares[tried]], None)


def _tried(fade: Fade) -> tuple[bool, np.ndarray, np.ndarray]:
    """Whether cells leave whole, all shares that differ then, or evenly spread ones, and which of
    them are tried."""
    whole = bool((fade.begins == fade.gone).all())
    shares = fade.shares if whole else np.linspace(1, 0, SETTINGS.tried)[:-1]
    return whole, shares, np.unique(np.linspace(0, len(shares) - 1, SETTINGS.tried).astype(int))


def _between(
    search: "StuckSearch", fade: Fade, ends: tuple[float, float], target_hz: float
) -> AreaStep:
    """Where the frequency passes the target between two shares."""
    share = brentq(lambda s: _step(search, fade, s).hz - target_hz, *ends, xtol=SETTINGS.nearest)
    return _step(search, fade, share)


def _step(search: "StuckSearch", fade: Fade, share: float) -> AreaStep:
    return AreaStep(float(share), *search.find(fade.factors(share) * search.pairs.weight))


def _crossing(history: Sequence[AreaStep], target_hz: float, whole: bool) -> int:
    """The first step after which the frequency has passed the target; half a cell beyond the ends
    is still nearest."""
    hz = np.array([step.hz for step in history])
    over = (hz[:-1] - target_hz) * (hz[1:] - target_hz) <= 0
    if over.any():
        return int(over.argmax())
    reach = np.abs(np.diff(hz)).max() / 2 if whole else 0.0
    if not hz.min() - reach <= target_hz <= hz.max() + reach:
        raise NotReachable(
            f"target {target_hz:g} Hz is not reachable: {hz.min():.0f}..{hz.max():.0f} Hz with "
            f"{100 * history[-1].share:.3g}..100 % of the closed area kept",
            above=bool(target_hz > hz.max()),
        )
    return min(int(np.abs(hz - target_hz).argmin()), len(hz) - 2)


def _found(
    search: "StuckSearch",
    fade: Fade,
    chosen: AreaStep,
    history: list[AreaStep],
    target_hz: float | None,
) -> AreaDetachment:
    history = sorted(
        {step.share: step for step in (*history, chosen)}.values(), key=lambda step: -step.share
    )
    slope = (
        np.gradient([s.hz for s in history], [s.share for s in history])
        if len(history) > 1
        else [0.0]
    )
    return AreaDetachment(
        search.table(fade.factors(chosen.share) * search.pairs.weight),
        chosen,
        tuple(history),
        float(slope[history.index(chosen)]),
        target_hz,
    )
