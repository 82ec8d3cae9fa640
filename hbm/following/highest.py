"""The highest of several branches of peaks, over the parameter.

A branch is followed until it ends; there, and at the last value, a whole curve tells the highest
peak. Where that is another one it is followed back to the place at which both are as high, and
taken up there.
"""

from dataclasses import replace

from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.trace import NO_PERIOD
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.following.case import Case, Extreme
from tipdamp.hbm.following.run import Run, height_of
from tipdamp.hbm.following.taken_up import (
    HIGHER,
    MOST_TAKEN_UP,
    Path,
    continues,
    past_kinks,
    take_up,
)


def highest(case: Case, top: Extreme, ends: tuple[float, float]) -> Path:
    """The highest peak from a top at the first of two values, in units of the branch."""
    path = Path(case, ends)
    value = ends[0]
    back = None
    for _ in range(MOST_TAKEN_UP):
        _add_forward(path, top, value, back)
        run = path.runs[-1]
        other, value = (None, value) if run.refused else _other(path)
        if other is None:
            break
        if run.why and continues(run, other):
            path.said.append(f"{run.why}; it was found again beyond")
            back = None
        else:
            back = take_up(path, other, value)
        if path.complete:
            break
        top = other
    else:
        path.said.append(f"left after {MOST_TAKEN_UP} whole curves: ask for a shorter range")
    why = path.runs[-1].why
    path.said += [why] if why else []
    path.said += ["reached the last value"] if path.complete else []
    path.complete = path.complete and not path.doubtful
    return path


def _add_forward(path: Path, top: Extreme, value: float, back: Run | None) -> None:
    """Follow a top at a value towards the last one; back : the run that leads to it from before."""
    case = path.case

    def watch(point: Point) -> bool:
        heights = case.heights(point.detail.found)
        return heights[list(case.columns)].max() > (1 + HIGHER) * heights[top.column]

    run, *more = past_kinks(path, top, (value, path.ends[1]), watch)
    if back is not None and back.fitted == run.fitted:  # one branch, to both sides of its top
        path.runs.pop()
        run = replace(run, points=[*back.points, *run.points[1:]], calls=back.calls + run.calls)
    elif back is not None:
        path.said.append("")
    path.runs += [run, *more]
    path.said += [run.why if run.fitted else "" for run in [run, *more][:-1]]
    path.complete = path.runs[-1].points[-1].parameter == path.ends[1]


def _other(path: Path) -> tuple[Extreme | None, float]:
    """(the highest peak of the whole curve beyond the last run, the value there); None where it is
    that of the run, or none is left."""
    case = path.case
    run = path.runs[-1]
    last = path.ends[1]
    end = run.points[-1].parameter
    known = case.heights(run.points[-1].detail.found)
    value = end if path.complete or run.enough else end + path.beyond
    value = last if path.passes(value, last) else value
    try:
        top, why = case.highest_at(value / case.parameter.scale)
    except InputError as error:
        path.runs[-1] = replace(run, why=f"{run.why}; {case.named(value)}: {error}")
        return None, value
    if why:
        # a drift that ends both is said once: its words differ by rounding
        own = run.why.removesuffix(run.drift) if NO_PERIOD in why else run.why
        path.runs[-1] = replace(run, why=f"beyond {case.named(end)} {why}; {own}")
    if top is None or not path.complete:
        return top, value
    higher = height_of(case, top, value) > (1 + HIGHER) * known[run.column]
    return (top if higher else None), value
