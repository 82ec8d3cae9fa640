"""The highest of several branches of peaks, over the parameter.

A branch is followed until it ends; there, and at the last value, a whole curve tells the highest
peak. Where that is another one it is followed back to the place at which both are as high, and
taken up there.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.following.case import Case, Extreme
from tipdamp.hbm.following.run import Run, begin_at, near, run_from

if TYPE_CHECKING:
    from tipdamp.hbm.following.extremum import Extremum

MOST_TAKEN_UP = 20  # times that a peak is taken up
BEYOND = 1e-3  # of the range: how far past an end a peak is looked for
HIGHER = 1e-6  # of a height: another peak is higher by more
FITTED = 0.01  # of the range: steps in which a peak with a kink is found again
EQUAL = 1e-9  # of a height: two peaks are as high
SECANTS = 12
HALVINGS = 8  # of the way on which a peak joins the curve


@dataclass
class Path:
    """Runs in their order, and what is said where one follows the other, at the end too; complete :
    the last value is reached."""

    case: Case
    ends: tuple[float, float]
    runs: list[Run] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    complete: bool = False

    @property
    def sense(self) -> float:
        """Of the parameter along the runs."""
        return float(np.sign(self.ends[1] - self.ends[0]))

    def passes(self, p: float, q: float) -> bool:
        """Whether p lies beyond q."""
        return self.sense * (p - q) > 0

    def height(self, p: float) -> float | None:
        """m, at a value between two places of a run; None in a gap."""
        for run in self.runs:
            values = self.sense * run.values
            if values[0] <= self.sense * p <= values[-1] and len(values) > 1:
                return float(_line(run, self.case, self.sense)(self.sense * p))
        return None


def highest(case: Case, top: Extreme, ends: tuple[float, float]) -> Path:
    """The highest peak from a top at the first of two values, in units of the branch."""
    path, value, back = Path(case, ends), ends[0], None
    for _ in range(MOST_TAKEN_UP):
        run = _forward(path, top, value)
        if back is not None and not run.fitted:  # one branch, to both sides of its top
            path.runs.pop()
            run = replace(run, points=[*back.points, *run.points[1:]], calls=back.calls + run.calls)
        path.runs.append(run)
        path.complete = run.points[-1].parameter == ends[1]
        other, value = _other(path)
        if other is None:
            break
        if _continues(run, other):
            path.said.append(f"{run.why}; it was found again beyond")
            back = None
        else:
            back = _take_up(path, other, value)
        if path.complete:
            break
        top = other
    why = path.runs[-1].why
    path.said += [why] if why else []
    path.said += ["reached the last value"] if path.complete else []
    return path


def _forward(path: Path, top: Extreme, value: float) -> Run:
    """The run from a top; where a kink stands at the peak, one of fitted places up to its end."""
    case, (first, last) = path.case, path.ends

    def watch(point: Point) -> bool:
        heights = case.heights(point.detail.found)
        return heights[list(case.columns)].max() > (1 + HIGHER) * heights[top.column]

    run = run_from(case, top, (value, last), watch)
    if run is not None and (not run.why or len(run.points) > 1):
        return run
    equation, _ = begin_at(case, top, value)
    points = [_fitted(equation, top, value)]
    step = FITTED * (last - first)
    while value != last:
        value = last if path.passes(value + step, last) else value + step
        again = case.again(top, value / case.parameter.scale)
        if again is None:
            break
        top = again
        points.append(_fitted(equation, top, value))
        if begin_at(case, top, value)[1] is not None:
            break
    place = f"{case.named(points[0].parameter)} to {case.named(points[-1].parameter)}"
    why = f"from {place} the curve has a kink at its peak, places are fitted"
    return Run(equation, points, top.column, len(points), why, fitted=True)


def _fitted(equation: "Extremum", top: Extreme, value: float) -> Point:
    y = equation.unknowns(top.x, top.w)
    return Point(y, value, True, 1, equation.evaluate(y, value))


def _other(path: Path) -> tuple[Extreme | None, float]:
    """(the highest peak of the whole curve beyond the last run, the value there); None where it is
    that of the run, or none is left."""
    case, run, (first, last) = path.case, path.runs[-1], path.ends
    end = run.points[-1].parameter
    known = case.heights(run.points[-1].detail.found)
    value = end if path.complete or run.enough else end + BEYOND * (last - first)
    if not path.complete and not path.passes(last, value):
        return None, value
    top = case.begin(value / case.parameter.scale)
    if top is None or not path.complete:
        return top, value
    higher = _height(case, top, value) > (1 + HIGHER) * known[run.column]
    return (top if higher else None), value


def _height(case: Case, top: Extreme, p: float) -> float:
    found = case.parameter.held(case.balance(), top.x, top.w, p)
    return float(case.heights(found)[top.column])


def _continues(run: Run, top: Extreme) -> bool:
    end = run.points[-1].detail.found
    return run.column == top.column and near(end, top.x, top.w)


def _take_up(path: Path, top: Extreme, value: float) -> Run | None:
    """Follow another peak back to where it is as high as the runs, which end there; the run from
    there, None where it has a kink at once."""
    case = path.case

    def until_lower(point: Point) -> bool:
        known = path.height(point.parameter)
        return known is not None and case.heights(point.detail.found)[top.column] < known

    why, end = path.runs[-1].why, path.runs[-1].points[-1]
    back = run_from(case, top, (value, path.ends[0]), until_lower)
    if back is None:
        path.said.append(f"{why}; another peak was taken up" if why else _at_the_end(path, top))
        if path.complete:
            equation, _ = begin_at(case, top, value)
            point = _fitted(equation, top, value)
            path.runs.append(Run(equation, [point], top.column, 1, fitted=True))
        return None
    back = back.backwards()
    crosses = _as_high(path, back)
    at = _on_the_curve(path, back, crosses, value)
    kept = [p for p in back.points if not path.passes(at, p.parameter)]
    whole = not path.passes(end.parameter, at)
    while path.runs and path.passes(path.runs[-1].values[0], at):
        path.runs.pop()
        path.said[len(path.runs) - 1 :] = []
    if path.runs:
        run = path.runs[-1]
        before = [p for p in run.points if not path.passes(p.parameter, at)]
        path.runs[-1] = replace(run, points=before)
    back = replace(back, points=kept, why="")
    path.runs.append(back)
    said = f"{why}; another peak was taken up" if whole and why else _said(path, at)
    path.said.append(said + _apart(path, crosses, at))
    return back


def _on_the_curve(path: Path, back: Run, at: float, value: float) -> float:
    """The first value, from `at` on, where the curve over the band has the peak of a run that it
    has at `value`: a peak may stand on a branch of its own before it joins the curve.

    By halving, as a branch joins at once."""
    case, way = path.case, path.ends[1] - path.ends[0]
    low, high = at + BEYOND * way, value
    if not path.passes(high, low) or not back.at(low) or _has(case, back, low):
        return at
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if not back.at(middle):
            break
        low, high = (low, middle) if _has(case, back, middle) else (middle, high)
    back.at(high)
    return high


def _has(case: Case, back: Run, p: float) -> bool:
    place = back.points[back.values.tolist().index(p)].detail.found
    top = case.begin(p / case.parameter.scale)
    return top is not None and near(place, top.x, top.w)


def _apart(path: Path, crosses: float, at: float) -> str:
    if at == crosses:
        return ""
    return (
        f" (from {path.case.named(crosses)} on it is higher, but stands on a branch apart from the "
        "curve)"
    )


def _said(path: Path, at: float) -> str:
    case, (a, b) = path.case, path.runs[-2:] if len(path.runs) > 1 else path.runs * 2
    low, high = (run.points[i].detail.found.w / (2 * np.pi) for run, i in ((a, -1), (b, 0)))
    if a.column != b.column:
        names = case.names[a.column], case.names[b.column]
        return f"at {case.named(at)} the peak of '{names[1]}' becomes higher than '{names[0]}'"
    return (
        f"at {case.named(at)} another peak becomes the highest, at {high:.6g} Hz instead of "
        f"{low:.6g} Hz, and was taken up"
    )


def _at_the_end(path: Path, top: Extreme) -> str:
    hz = top.w / (2 * np.pi)
    return f"at the last value another peak is the highest, at {hz:.6g} Hz, and was taken up"


def _as_high(path: Path, back: Run) -> float:
    """The value from which on a run is higher than those of the path; solved there where it is
    between two places of both."""
    case, sense = path.case, path.sense
    for _ in range(SECANTS):
        over = _line(back, case, sense) if len(back.points) > 1 else None
        below = [
            p.parameter
            for p, h in zip(back.points, back.heights(case), strict=True)
            if (known := path.height(p.parameter)) is not None and h < known
        ]
        if not below or over is None:
            return back.points[0].parameter
        low = below[-1]
        high = next(p for p in back.values if path.passes(p, low))
        run = next(
            (
                r
                for r in path.runs
                if not path.passes(r.values[0], low)
                and len(r.points) > 1
                and path.passes(r.values[-1], low)
            ),
            None,
        )
        if run is None:
            return float(high)
        high = high if not path.passes(high, run.values[-1]) else float(run.values[-1])
        under = _line(run, case, sense)

        def apart(s: float, over: Callable = over, under: Callable = under) -> float:
            return float(over(s) - under(s))

        a, b = sense * low, sense * high
        if not apart(a) < 0 <= apart(b):
            return float(high)
        at = sense * brentq(apart, a, b, xtol=1e-14 * abs(a))
        if not (back.at(at) and run.at(at)):
            return float(high)
        heights = [one.heights(case)[one.values.tolist().index(at)] for one in (run, back)]
        if abs(heights[1] - heights[0]) <= EQUAL * heights[0]:
            return float(at)
    return float(at)


def _line(run: Run, case: Case, sense: float) -> PchipInterpolator:
    """Height of a run as a function of sense times the value."""
    values, at = np.unique(sense * run.values, return_index=True)
    return PchipInterpolator(values, run.heights(case)[at])
