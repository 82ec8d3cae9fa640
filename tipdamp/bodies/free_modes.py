"""Free modes of the blades by shape: which is the out-of-phase one, which the in-phase one, and
whether any is.

Weakly coupled blades vibrate one at a time: no mode involves both, and none is named. The motion
that is then tracked into the stuck assembly, where the damper couples the blades, is the sum or the
difference of the two blades' own modes."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.ties import REPEATED, first_largest, turned
from tipdamp.results.static_results import TuneResult
from tipdamp.study.view import Study

NAMES = ("out_of_phase", "in_phase")
BOTH = 0.1  # a mode involves both blades when each moves at least this part of what the other does
LOWEST_MAC = 0.5  # below, the tracked mode hardly resembles the free one
SURE_MAC = 0.75  # above, no other mode can take its place
JUMP = 0.1  # of the frequency from one share of the area to the next: another mode is tracked there
ALIKE = 0.5  # MAC of the two blades' own motions above which they are one
# default band of the free response: of the lower and of the upper of the two modes
BESIDE = (0.88, 1.14)


@dataclass(frozen=True)
class FreeModes:
    """hz (m,) lowest modes; named {name of NAMES: Hz}, empty where one mode would bear both names
    follow {name: (r,) mass-normalised shape}, always both; pair - Hz of the two modes that they
    were made from."""

    hz: np.ndarray
    named: dict
    follow: dict
    pair: tuple

    @property
    def warnings(self) -> list[str]:
        """Sentences where no mode is named, and where modes have one frequency and so no shapes of
        their own."""
        return [*repeated_warnings(self.hz, "free", self.pair), *self._unnamed]

    @property
    def _unnamed(self) -> list[str]:
        if self.named:
            return []
        a, b = self.pair
        made = (
            f"the difference or sum of the motions at {a:.1f} and {b:.1f} Hz"
            if a != b
            else f"that at {a:.1f} Hz"
        )
        return [
            f"no free mode involves both blades (lowest: {_list(self.hz)} Hz), so none is called "
            "out of phase or in phase: the blades are weakly coupled without the damper; tune "
            f"tracks {made}"
        ]


def lowest_modes(model: ReducedModel, count: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Hz (m,) and mass-normalised shapes (r, m)."""
    lam, shapes = eigh(model.K, model.M, subset_by_index=(0, min(count, model.size) - 1))
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi), shapes


def named_modes(blades: ReducedModel, one: np.ndarray, two: np.ndarray) -> FreeModes:
    """From the rows (r,) of the mean motion of the two patches.

    The mode that contributes most to the static compliance of their difference (sum), each measured
    by its patch's own compliance, is the out-of-phase (in-phase) one: found by shape, whatever its
    number. Of modes with one frequency the mixture is taken that has all of this motion.
    """
    hz, shapes = lowest_modes(blades)
    # patches may lie at different heights
    one, two = (row / (np.linalg.norm(row @ shapes / hz) or 1.0) for row in (one, two))
    best = [_most(hz, shapes, row) for row in (one - two, one + two)]
    part = np.abs([[row @ shape for _, shape in best] for row in (one, two)])
    if best[0][0] != best[1][0] and (part.min(axis=0) >= BOTH * part.max(axis=0)).all():
        return FreeModes(
            hz[:10],
            {name: float(hz[k]) for name, (k, _) in zip(NAMES, best, strict=True)},
            {name: shape for name, (_, shape) in zip(NAMES, best, strict=True)},
            tuple(float(hz[k]) for k, _ in best),
        )
    return _of_each_blade(blades, hz, *(_most(hz, shapes, row) for row in (one, two)))


def _of_each_blade(
    blades: ReducedModel,
    hz: np.ndarray,
    one: tuple[int, np.ndarray],
    two: tuple[int, np.ndarray],
) -> FreeModes:
    """Sum and difference of the two blades' own modes, (number, shape), which may be one."""
    (i, a), (j, b) = one, two
    alike = (a @ blades.M @ b) ** 2 > ALIKE
    follow = {name: a if alike else made for name, made in zip(NAMES, (a - b, a + b), strict=True)}
    return FreeModes(
        hz[:10],
        {},
        {name: s / np.sqrt(s @ blades.M @ s) for name, s in follow.items()},
        (float(hz[i]), float(hz[j])),
    )


def _most(hz: np.ndarray, shapes: np.ndarray, row: np.ndarray) -> tuple[int, np.ndarray]:
    """(number, shape) of the mode that contributes most to the static compliance of a row (r,)."""
    shapes = turned(hz, shapes, row)
    k = first_largest((row @ shapes / hz) ** 2, REPEATED.alike)
    return k, shapes[:, k]


def repeated_warnings(hz: np.ndarray, which: str, used: Iterable[float]) -> list[str]:
    """One sentence where modes of the frequencies `used` share theirs with another one of hz
    (m,)."""
    for f in used:
        same = np.abs(hz - f) <= REPEATED.equal * f
        if same.sum() > 1:
            return [
                f"{same.sum()} {which} modes have the same frequency, {f:.1f} Hz: any mixture of "
                "their shapes is a mode too; that with most of the motion looked for is taken; "
                "make the blades differ by what real ones do"
            ]
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
    return [
        f"[free] band = {low:g} to {high:g} Hz contains no resonance of the blades; their lowest "
        f"modes are at {_list(modes.hz)} Hz"
    ]


def tracking_warnings(study: Study, tune: TuneResult) -> list[str]:
    """Sentences where the tracked mode hardly resembles the free one, or lies outside the band of
    the response."""
    labels = {
        "full_area": "on the whole area",
        **({} if tune.line_is_whole else {"full_line": "on the whole line"}),
        "tuned": f"on the {tune.kept_name}",
    }
    hz = dict(tune.stuck_hz)
    sets: dict[tuple[str, str], list[str]] = {}  # of the same numbers: one sentence
    for name, mac in tune.mac:
        if name in labels and mac < LOWEST_MAC:
            sets.setdefault((f"{hz[name]:.0f}", f"{mac:.2f}"), []).append(labels[name])
    found = [
        f"the tracked mode, stuck {' and '.join(on)} ({at} Hz), has a MAC of {mac} with the free "
        "one: check its shape before relying on its frequency"
        for (at, mac), on in sets.items()
    ]
    found += _jumps(tune, study.tune.follow)
    (low, high), tuned = study.respond.band, tune.stuck_hz.tuned
    found += repeated_warnings(np.array(tune.stuck_modes_hz.tuned), "stuck", [tuned])
    if high and not low <= tuned <= high:
        inside = [f"{f:.1f}" for f in tune.stuck_modes_hz.tuned if low <= f <= high]
        found.append(
            f"the tracked mode, stuck {labels['tuned']} ({tuned:.0f} Hz), lies outside [respond] "
            f"band = {low:g} to {high:g} Hz, "
            + (
                f"where there are stuck modes at {', '.join(inside)} Hz: [tune] "
                "follow may be the other one"
                if inside
                else "which contains no stuck mode"
            )
        )
    return found


def _jumps(tune: TuneResult, follow: str) -> list[str]:
    """A sentence where the tracked mode becomes another one between the whole and the kept area."""
    steps = [s for s in tune.area.history if s.share >= tune.area.share] if tune.area else []
    jumps = [
        (a, b)
        for a, b in pairwise(steps)
        if abs(a.hz - b.hz) > JUMP * max(a.hz, b.hz) and max(a.mac, b.mac) < SURE_MAC
    ]
    if not jumps:
        return []
    at = ", ".join(
        f"from {a.hz:.0f} to {b.hz:.0f} Hz (MAC {a.mac:.2f} and {b.mac:.2f}) between "
        f"{100 * a.share:.3g} and {100 * b.share:.3g} % of it"
        for a, b in jumps
    )
    return [
        f"the stuck mode most like the free {words_of(follow)} one is not the same one for all "
        f"shares of the area: it jumps {at}; the {tune.stuck_hz.full_area:.0f} Hz of the whole "
        f"area and the {tune.stuck_hz.tuned:.0f} Hz of the {tune.kept_name} need not be of one mode"
    ]


def words_of(follow: str) -> str:
    """The name of a free mode as it stands in a sentence: "out-of-phase"."""
    return follow.replace("_", "-")


def _list(hz: np.ndarray) -> str:
    return ", ".join(f"{f:.1f}" for f in hz[:3])
