"""Free modes of the blades by shape: which is the out-of-phase one, which the in-phase one, and whether any is.

Weakly coupled blades vibrate one at a time: no mode involves both, and none is named. The motion that is then tracked
into the stuck assembly, where the damper couples the blades, is the sum or the difference of the two blades' own modes.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from hbm.model import ReducedModel
from tipdamp.stages.results import TuneResult
from tipdamp.study.view import Study

NAMES = ("out_of_phase", "in_phase")
BOTH = 0.1               # a mode involves both blades when each moves at least this part of what the other does
LOWEST_MAC = 0.5          # below, the tracked mode hardly resembles the free one
REPEATED = 1e-7          # of a frequency: modes nearer to each other have no shapes of their own, by the digits of K
BESIDE = (0.88, 1.14)    # default band of the free response: of the lower and of the upper of the two modes


@dataclass(frozen=True)
class FreeModes:
    """hz (m,) lowest modes; named {name of NAMES: Hz}, empty where one mode would bear both names
    follow {name: (r,) mass-normalised shape}, always both; pair - Hz of the two modes that they were made from."""

    hz: np.ndarray
    named: dict
    follow: dict
    pair: tuple

    @property
    def warnings(self) -> list[str]:
        """Sentences where no mode is named, and where modes have one frequency and so no shapes of their own."""
        return [*repeated_warnings(self.hz, "free", self.pair), *self._unnamed]

    @property
    def _unnamed(self):
        if self.named:
            return []
        a, b = self.pair
        made = f"the difference or sum of the motions at {a:.1f} and {b:.1f} Hz" if a != b else f"that at {a:.1f} Hz"
        return [f"no free mode involves both blades (lowest: {_list(self.hz)} Hz), so none is called out of phase or "
                f"in phase: the blades are weakly coupled without the damper; tune tracks {made}"]


def lowest_modes(model: ReducedModel, count: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Hz (m,) and mass-normalised shapes (r, m)."""
    lam, shapes = eigh(model.K, model.M, subset_by_index=(0, min(count, model.size) - 1))
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi), shapes


def named_modes(blades: ReducedModel, one: np.ndarray, two: np.ndarray) -> FreeModes:
    """From the rows (r,) of the mean motion of the two patches.

    The mode that contributes most to the static compliance of their difference (sum), each measured by its patch's own
    compliance, is the out-of-phase (in-phase) one: found by shape, whatever its number.
    """
    hz, shapes = lowest_modes(blades)
    # patches may lie at different heights
    one, two = (motion / (np.linalg.norm(motion / hz) or 1.0) for motion in (one @ shapes, two @ shapes))
    best = [int((motion**2 / hz**2).argmax()) for motion in (one - two, one + two)]
    part = np.abs([one[best], two[best]])
    if best[0] != best[1] and (part.min(axis=0) >= BOTH * part.max(axis=0)).all():
        found = {name: (float(hz[k]), shapes[:, k]) for name, k in zip(NAMES, best, strict=True)}
        return FreeModes(hz[:10], {n: f for n, (f, _) in found.items()}, {n: s for n, (_, s) in found.items()},
                         tuple(f for f, _ in found.values()))
    own = [int((motion**2 / hz**2).argmax()) for motion in (one, two)]
    a, b = (np.sign(motion[k]) * shapes[:, k] for motion, k in zip((one, two), own, strict=True))
    follow = {"out_of_phase": a - b, "in_phase": a + b} if own[0] != own[1] else dict.fromkeys(NAMES, a)
    size = np.sqrt(2) if own[0] != own[1] else 1.0        # M-orthogonal shapes of unit mass
    return FreeModes(hz[:10], {}, {n: s / size for n, s in follow.items()}, tuple(float(hz[k]) for k in own))


def repeated_warnings(hz: np.ndarray, which: str, used: Iterable[float]) -> list[str]:
    """One sentence where modes of the frequencies `used` share theirs with another one of hz (m,)."""
    for f in used:
        same = np.abs(hz - f) <= REPEATED * f
        if same.sum() > 1:
            return [f"{same.sum()} {which} modes have the same frequency, {f:.1f} Hz: any mixture of their shapes is a "
                    "mode too, so which of them is out of phase, in phase or tracked is arbitrary; make the blades "
                    "differ by what real ones do"]
    return []


def band(given: tuple[float, float] | None, modes: FreeModes) -> tuple[float, float]:
    """Band of the free response, Hz: the study's, or around the two modes."""
    low, high = (float(f"{f(modes.pair) * c:.2g}") for f, c in zip((min, max), BESIDE, strict=True))
    return given or (low, high)


def band_warnings(limits: tuple[float, float], modes: FreeModes) -> list[str]:
    """One sentence when no free mode lies in the band."""
    low, high = limits
    if ((modes.hz >= low) & (modes.hz <= high)).any():
        return []
    return [f"[free] band = {low:g} to {high:g} Hz contains no resonance of the blades; their lowest modes are at "
            f"{_list(modes.hz)} Hz"]


def tracking_warnings(study: Study, tune: TuneResult) -> list[str]:
    """Sentences where the tracked mode hardly resembles the free one, or lies outside the band of the response."""
    labels = {"full_area": "on the whole area", **({} if tune.line_is_whole else {"full_line": "on the whole line"}),
              "tuned": f"on the {tune.kept_name}"}
    hz = dict(tune.stuck_hz)
    found = [f"the tracked mode, stuck {labels[name]} ({hz[name]:.0f} Hz), has a MAC of {mac:.2f} with the free one: "
             "check its shape before relying on its frequency" for name, mac in tune.mac
             if name in labels and mac < LOWEST_MAC]
    (low, high), tuned = study.respond.band, tune.stuck_hz.tuned
    found += repeated_warnings(np.array(tune.stuck_modes_hz.tuned), "stuck", [tuned])
    if not low <= tuned <= high:
        inside = [f"{f:.1f}" for f in tune.stuck_modes_hz.tuned if low <= f <= high]
        found.append(f"the tracked mode, stuck {labels['tuned']} ({tuned:.0f} Hz), lies outside [respond] band = "
                     f"{low:g} to {high:g} Hz, " + (f"where there are stuck modes at {', '.join(inside)} Hz: [tune] "
                     "follow may be the other one" if inside else "which contains no stuck mode"))
    return found


def _list(hz: np.ndarray) -> str:
    return ", ".join(f"{f:.1f}" for f in hz[:3])
