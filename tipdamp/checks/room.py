"""Whether the curves that are computed side by side fit into memory, asked before the first of
them."""

from collections.abc import Sequence

import numpy as np

from tipdamp.engine.curves import CurveCase, Curves
from tipdamp.hbm.balance.activity import Activity, activity, opening
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.memory import SMALL, available_bytes, curve_bytes


def check_room(curves: Curves, cases: Sequence[CurveCase], jobs: int) -> None:
    """InputError where the cases may need more memory than there is, `jobs` of them at once, with
    what would fit.

    Every kept pair can slip or lift off, whether an interface reduction follows it or not; where
    all of them would not fit, those are counted that the stuck response of a case moves.
    """
    P, nd = len(curves.problem.contacts), len(curves.problem.law.components)
    if Need(curves, cases, dict.fromkeys((case.Fe_N for case in cases), Activity(P, P * nd))).fits(
        jobs
    ):
        return
    levels = sorted({case.Fe_N for case in cases})
    need = Need(curves, cases, acting(curves, levels, cases[0].band))
    if not need.fits(jobs):
        raise InputError(need.message(min(jobs, len(cases))))


def acting(
    curves: Curves, levels: Sequence[float], band: tuple[float, float]
) -> dict[float, Activity]:
    """{Fe in N: what slips or lifts in a band, Hz}, by the stuck response."""
    start = _start(curves)
    return {Fe: activity(curves.problem, Fe * curves.force, band, start) for Fe in levels}


def lifting(curves: Curves, Fe: float, band: tuple[float, float]) -> int:
    """Number of the contacts closed at rest that lift off in a band at Fe, N; as `acting`."""
    return opening(curves.problem, Fe * curves.force, band, _start(curves))


def _start(curves: Curves) -> str | np.ndarray:
    return "zero_slider" if curves.start is None else curves.start


class Need:
    """Bytes of cases, with what is active at each level."""

    def __init__(
        self, curves: Curves, cases: Sequence[CurveCase], active: dict[float, Activity]
    ) -> None:
        self.contacts, self.nd = len(curves.problem.contacts), len(curves.problem.law.components)
        self.cases, self.active, self.available = cases, active, available_bytes()

    def of(self, case: CurveCase, most: float = float("inf")) -> float:
        """One case, with at most so many harmonics."""
        active = self.active[case.Fe_N].components / self.nd
        return curve_bytes(active, self.contacts, self.nd, int(min(case.H, most)))

    def bytes(self, jobs: int, most: float = float("inf")) -> float:
        """The largest that may run at once."""
        return sum(sorted((self.of(case, most) for case in self.cases), reverse=True)[:jobs])

    def fits(self, jobs: int, most: float = float("inf")) -> bool:
        """Whether there is room."""
        return self.bytes(jobs, most) <= max(SMALL, self.available)

    def message(self, jobs: int) -> str:
        """What is needed, and what would fit."""
        worst = max(self.cases, key=self.of)
        who = "a curve" if jobs == 1 else f"{jobs} curves side by side"
        fewer = next((n for n in range(jobs - 1, 0, -1) if self.fits(n)), 0)
        H = next((h for h in range(worst.H - 1, 0, -1) if self.fits(1, h)), 0)
        fits = [f"run with --jobs {fewer}"] * (fewer > 0) + [
            f"set [respond] harmonics to {H} or less" + " and run with --jobs 1" * (jobs > 1)
        ] * (H > 0)
        return (
            f"[respond]: {self.active[worst.Fe_N].contacts} of the {self.contacts} kept pairs may "
            f"slip or lift off at once at {worst.Fe_N:g} N: {who} may need "
            f"{self.bytes(jobs) / 1e9:.3g} GB of memory, {self.available / 1e9:.3g} GB are "
            "available: " + ", or ".join([*fits, "lower [respond] levels, or keep fewer pairs"])
        )
