"""Where another peak becomes the highest: it is followed back to the value at which both are as
high, and taken up there."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.following.case import Case, Extreme
from tipdamp.hbm.following.extremum import Extremum
from tipdamp.hbm.following.run import Run, begin_at, equation_of, height_of, near, run_from

MOST_TAKEN_UP = 100  # times that a peak is taken up, and found again on its way back
TOLD = 0.2  # of the parameter: a peak is followed past kinks so far without a whole curve
BEYOND = 1e-3  # of the range: how far past an end a peak is looked for
HIGHER = 1e-6  # of a height: another peak is higher by more
FITTED = 0.01  # of the range: steps in which a peak with a kink is found again
WIDEST = 3.0  # times the parameter: the range, for that, of one that is wider
ABOUT = 1e-3  # the same, beside a height that is interpolated
EQUAL = 1e-9  # of a height: two peaks are as high
SECANTS = 12
HALVINGS = 8  # of the way on which a peak joins the curve


@dataclass
class Path:
    """Runs in their order, and what is said where one follows the other, at the end too.

    complete : the last value is reached; doubtful : where another peak becomes the highest is not
    known
    """

    case: Case
    ends: tuple[float, float]
    runs: list[Run] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    complete: bool = False
    doubtful: bool = False

    @property
    def sense(self) -> float:
        """Of the parameter along the runs."""
        return float(np.sign(self.ends[1] - self.ends[0]))

    @property
    def beyond(self) -> float:
        """Step to a value past an end, along the runs."""
        return BEYOND * (self.ends[1] - self.ends[0])

    def passes(self, p: float, q: float) -> bool:
        """Whether p lies beyond q."""
        return self.sense * (p - q) > 0

    def run_at(self, p: float) -> Run | None:
        """With a value between two of its places; None in a gap."""
        for run in self.runs:
            values = self.sense * run.values
            if values[0] <= self.sense * p <= values[-1] and len(values) > 1:
                return run
        return None

    def height(self, p: float) -> float | None:
        """m, at a value between two places of a run; None in a gap."""
        run = self.run_at(p)
        return None if run is None else float(_line(run, self.case, self.sense)(self.sense * p))


def stretch(
    path: Path,
    top: Extreme,
    ends: tuple[float, float],
    found: Callable[[Point], bool],
) -> Run:
    """The run from a top at the first of two values towards the second; where a kink stands at the
    peak, one of fitted places up to its end, or until `found`."""
    case = path.case
    value, end = ends
    column = top.column
    if value == end:
        equation, begin = begin_at(case, top, value)
        if begin is not None:
            return Run(equation, [begin], column, begin.iterations)
    else:
        run = run_from(case, top, ends, found)
        if run is not None and (not run.why or len(run.points) > 1):
            return run
        equation = equation_of(case, top)
    return _past_a_kink(path, equation, top, ends, found)


def _past_a_kink(
    path: Path,
    equation: Extremum,
    top: Extreme,
    ends: tuple[float, float],
    found: Callable[[Point], bool],
) -> Run:
    """The run of fitted places of `stretch`, up to the first beside which the equation is solved
    again."""
    case = path.case
    value, end = ends
    column = top.column
    points = [_fitted(equation, top, value)]
    way = np.sign(end - value)
    while value != end and not found(points[-1]):
        step = way * FITTED * min(abs(path.ends[1] - path.ends[0]), WIDEST * abs(value))
        # a rest of rounding is no step
        value = end if abs(end - value) <= 1.001 * abs(step) else value + step
        again = case.again(top, value / case.parameter.scale)
        if again is None or not case.inside(again.w):
            break
        top = again
        points.append(_fitted(equation, top, value))
        if begin_at(case, top, value)[1] is not None:
            break
    low, high = sorted((points[0].parameter, points[-1].parameter), reverse=path.sense < 0)
    place = f"{case.named(low)} to {case.named(high)}"
    why = f"from {place} the curve has a kink at its peak, places are fitted"
    goes_on = value != end and len(points) > 1
    return Run(equation, points, column, len(points), why, fitted=True, kink=goes_on)


def past_kinks(
    path: Path, top: Extreme, ends: tuple[float, float], found: Callable[[Point], bool]
) -> list[Run]:
    """`stretch`, and those that follow past kinks beside which the same peak goes on, up to where a
    whole curve is to tell whether it still is the highest."""
    runs = [stretch(path, top, ends, found)]
    far = TOLD * abs(ends[0])
    while abs(runs[-1].points[-1].parameter - ends[0]) < far:
        beyond = _past(path, runs[-1], ends[1])
        if beyond is None:
            break
        runs.append(stretch(path, *beyond, found))
    return runs


def _past(path: Path, run: Run, end: float) -> tuple[Extreme, tuple[float, float]] | None:
    """(the peak beyond the kink that ends a run, (its value, end)); None where the same peak is not
    found beside it."""
    case = path.case
    last = run.points[-1]
    if not run.kink:
        return None
    way = abs(path.beyond) * np.sign(end - last.parameter)
    value = last.parameter + way
    value = end if (value - end) * way > 0 else value
    here = Extreme(last.detail.found.x, last.detail.found.w, run.column)
    top = case.again(here, value / case.parameter.scale)
    return (top, (value, end)) if top and continues(run, top) else None


def solve_at(path: Path, value: float) -> None:
    """Solve the runs at a value between two of their places; of fitted ones by a piece of the
    curve."""
    case = path.case
    for run in path.runs:
        if not run.fitted:
            run.at(value)
            continue
        order = path.sense * run.values
        if not order[0] < path.sense * value < order[-1] or value in run.values:
            continue
        near_by = run.points[int(np.abs(run.values - value).argmin())].detail.found
        beside = Extreme(near_by.x, near_by.w, run.column)
        top = case.again(beside, value / case.parameter.scale)
        if top is not None:
            place = int(np.searchsorted(order, path.sense * value))
            run.points.insert(place, _fitted(run.equation, top, value))


def _fitted(equation: Extremum, top: Extreme, value: float) -> Point:
    y = equation.unknowns(top.x, top.w)
    return Point(y, value, True, 1, equation.evaluate(y, value))


def continues(run: Run, top: Extreme) -> bool:
    """Whether a top is that of the end of a run."""
    end = run.points[-1].detail.found
    return run.column == top.column and near(end, top.x, top.w)


def take_up(path: Path, top: Extreme, value: float) -> Run:
    """Follow another peak back to where it is as high as the runs, which end there; its run that
    ends at the top."""
    why = path.runs[-1].why
    end = path.runs[-1].points[-1].parameter
    back, known = _back(path, top, value)
    crosses = _as_high(path, back[0])
    at = _on_the_curve(path, back[0], crosses)
    _end_at(path, at)
    beyond = [p for p in back[0].points if not path.passes(at, p.parameter)]
    path.runs.append(replace(back[0], points=beyond))
    whole = not path.passes(end, at)
    said = f"{why}; another peak was taken up" if whole and why else _said(path, at)
    path.said.append(said + _apart(path, crosses, at) + _doubt(path, known))
    for run in back[1:]:
        _add(path, run)
    last = path.runs[-1]
    if not last.fitted:  # what ended it on the way back is said
        last = path.runs[-1] = replace(last, why="")
    elif len(back) > 1:  # it says at its end that it is fitted
        path.said[-1] = ""
    return last


def _end_at(path: Path, at: float) -> None:
    """Leave out the places of the runs beyond a value, and what is said there."""
    while path.runs and path.passes(path.runs[-1].values[0], at):
        path.runs.pop()
        path.said[len(path.runs) - 1 :] = []
    if path.runs:
        run = path.runs[-1]
        before = [p for p in run.points if not path.passes(p.parameter, at)]
        path.runs[-1] = replace(run, points=before)


def _add(path: Path, run: Run) -> None:
    """A run that goes on from the last one, and what is said between."""
    before, begin = (r.points[i].detail.found for r, i in ((path.runs[-1], -1), (run, 0)))
    again = near(before, begin.x, begin.w)
    path.runs.append(run)
    if run.fitted:
        path.said.append(run.why)
    elif again:
        path.said.append(f"{run.why}; it was found again beyond")
    else:
        path.said.append(_said(path, run.values[0]))


def _back(path: Path, top: Extreme, value: float) -> tuple[list[Run], bool]:
    """(runs of another peak from a value back to where it is the highest no more, in the order of
    the path; whether they lead there).

    Where a run ends before, a whole curve tells the highest peak beyond its end, as on the way
    forward."""
    case = path.case
    first = path.ends[0]

    def until_lower(point: Point) -> bool:
        known = path.height(point.parameter)
        return known is not None and case.heights(point.detail.found)[top.column] < known

    runs: list[Run] = []
    for _ in range(MOST_TAKEN_UP):
        ways = past_kinks(path, top, (value, first), until_lower)
        runs[:0] = [run.backwards() for run in ways[::-1]]
        run = ways[-1]
        value = run.points[-1].parameter
        if run.enough or until_lower(run.points[-1]):
            return runs, True
        known = None
        while known is None and path.passes(value, first):
            value -= path.beyond
            known = path.run_at(value)
        if known is None:  # at the first value a whole curve has told: it stands apart from that
            return runs, True
        exact = known.at(value)
        again = case.begin(value / case.parameter.scale)
        if again is None:
            break
        height = path.height(value)
        more = HIGHER if exact else ABOUT
        if height is not None and height_of(case, again, value) <= (1 + more) * height:
            return runs, True
        top = again
    return runs, False


def _doubt(path: Path, known: bool) -> str:
    if known:
        return ""
    path.doubtful = True
    case = path.case
    low, high = path.ends[0], path.runs[-1].values[0]
    if len(path.runs) > 1:
        low = path.runs[-2].values[0]
    return (
        f" (its way back ends there: between {case.named(low)} and {case.named(high)} another peak "
        "may be the highest)"
    )


def _on_the_curve(path: Path, back: Run, at: float) -> float:
    """The first value, from `at` on, where the curve over the band has the peak of a run that it
    has at the end of the run: a peak may stand on a branch of its own before it joins the curve.

    By halving, as a branch joins at once."""
    low, high = at + path.beyond, float(back.values[-1])
    if not path.passes(high, low) or not back.at(low) or _has(path.case, back, low):
        return at
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if not back.at(middle):
            break
        low, high = (low, middle) if _has(path.case, back, middle) else (middle, high)
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
    case = path.case
    a, b = path.runs[-2:] if len(path.runs) > 1 else path.runs * 2
    low, high = (run.points[i].detail.found.w / (2 * np.pi) for run, i in ((a, -1), (b, 0)))
    if a.column != b.column:
        names = case.names[a.column], case.names[b.column]
        return f"at {case.named(at)} the peak of '{names[1]}' becomes higher than '{names[0]}'"
    begin = b.points[0].detail.found
    if near(a.points[-1].detail.found, begin.x, begin.w):
        return f"at {case.named(at)} a peak close beside it becomes the highest, and was taken up"
    return (
        f"at {case.named(at)} another peak becomes the highest, at {high:.6g} Hz instead of "
        f"{low:.6g} Hz, and was taken up"
    )


def _as_high(path: Path, back: Run) -> float:
    """The value from which on a run is higher than those of the path; solved there where it is
    between two places of both."""
    case = path.case
    sense = path.sense
    for _ in range(SECANTS):
        low, high, run = _enclosed(path, back)
        if run is None:
            return float(high)
        over, under = (_line(one, case, sense) for one in (back, run))

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


def _enclosed(path: Path, back: Run) -> tuple[float, float, Run | None]:
    """(low, high, run of the path) between which values a run becomes higher than that one; None
    where no run leads on from the last value at which it is lower: it is higher from `high` on."""
    below = [
        p.parameter
        for p, h in zip(back.points, back.heights(path.case), strict=True)
        if (known := path.height(p.parameter)) is not None and h < known
    ]
    if not below or len(back.points) < 2:
        return back.points[0].parameter, back.points[0].parameter, None
    low = below[-1]
    high = next((p for p in back.values if path.passes(p, low)), None)
    if high is None:
        return low, low, None
    for run in path.runs:
        begun = not path.passes(run.values[0], low) and len(run.points) > 1
        if begun and path.passes(run.values[-1], low):
            end = run.values[-1]
            return low, end if path.passes(high, end) else high, run
    return low, high, None


def _line(run: Run, case: Case, sense: float) -> PchipInterpolator:
    """Height of a run as a function of sense times the value."""
    values, at = np.unique(sense * run.values, return_index=True)
    return PchipInterpolator(values, run.heights(case)[at])
