"""Further curves beside those of the levels of a study: one branch over the level of the force at
each of some frequencies serves them all, and what it crosses that no curve holds is followed.

responses/Fe_5N_H3_beside.json       what was looked for beside a curve, in words ...
responses/Fe_5N_H3_beside1.npz       ... and each curve that was found
.stages/Fe_beside.<key>.<n>.npz      what one branch has crossed, until that is followed
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tipdamp.engine.curves import CurveCase, Curves, files_of
from tipdamp.engine.store import fingerprint
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.io.array_files import open_npz, save_npz
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.search.beside import Search
from tipdamp.hbm.search.curves import curves_beside
from tipdamp.hbm.search.levels import AtLevel, over_levels, places

MOST = 4  # further curves of one curve that are followed
LEAST = 40  # residual calls of a branch: with fewer it does not get far
SMALL = 150  # unknowns of a curve: up to there an evaluation takes a millisecond, and a share of
# few of them would not lead round once


@dataclass(frozen=True)
class LevelSearch:
    """cases : the curves of the levels beside which is looked, with the key of this search; calls :
    of the residual, that it may make for all of them"""

    cases: tuple[CurveCase, ...]
    calls: float

    @property
    def branches(self) -> int:
        """How many branches over the level it may follow."""
        return max(min(Search().frequencies, int(self.calls / LEAST)), 1)


@dataclass(frozen=True)
class LevelBranch:
    """A branch over the level of the force: its number, and the frequency in Hz; complete : the
    curves of the search that are complete, of rising levels."""

    search: LevelSearch
    complete: tuple[CurveCase, ...]
    number: int
    hz: float

    @property
    def file(self) -> str:
        """Of what it has crossed."""
        return f".stages/Fe_beside.{self.search.cases[0].search}.{self.number:05d}.npz"


def level_search(
    curves: Curves, cases: Sequence[CurveCase], efforts: Sequence[float]
) -> LevelSearch:
    """The search beside finished curves; efforts : of each, in evaluations of its own. Of small
    models it may make as many as that of a single call in any case."""
    key = fingerprint(*map(curves.key, cases), *efforts)
    finest = max((case.H for case in cases), default=0)
    beside = [_curve(curves, case) for case in cases]
    calls = sum(
        effort * curve.residual_calls * (2 * case.H + 1) / (2 * finest + 1)
        for case, curve, effort in zip(cases, beside, efforts, strict=True)
    )
    if calls > 0 and max(curve.unknowns.shape[1] for curve in beside) <= SMALL:
        calls = max(calls, Search().least_calls)
    return LevelSearch(tuple(replace(case, search=key) for case in cases), calls)


def level_branches(curves: Curves, search: LevelSearch) -> list[LevelBranch]:
    """The branches that are to be followed; none where no curve is complete."""
    rising = sorted(search.cases, key=lambda case: case.Fe_N)
    complete = tuple(case for case in rising if _curve(curves, case).complete)
    if not complete:
        return []
    highest = _curve(curves, complete[-1])
    equation, _ = restored(highest, curves.problem)
    values = places(highest, equation, Search().frequencies)[: search.branches]
    return [LevelBranch(search, complete, i, hz) for i, hz in enumerate(values)]


def cross_levels(curves: Curves, branch: LevelBranch, report: Callable[[float, str], None]) -> None:
    """Work of one process: one branch, and what it has crossed into the store."""
    report(0.0, f"over the level at {branch.hz:.1f} Hz")
    found = over_levels(
        [_curve(curves, case) for case in branch.complete],
        curves.problem,
        branch.hz,
        Search().level,
        int(branch.search.calls / branch.search.branches),
    )
    arrays = {f"further_{k}": np.array(one.further) for k, one in enumerate(found)}
    arrays["reach"] = np.array([one.reach for one in found])
    arrays["calls"] = np.array(found[0].calls)
    with curves.store.writing(branch.file) as path:
        save_npz(path, packed=False, **arrays)


def follow_further(
    curves: Curves,
    task: tuple[CurveCase, Sequence[LevelBranch]],
    report: Callable[[float, str], None],
) -> None:
    """Work of one process: what the branches have crossed beside one curve is followed, and kept
    with what was looked for."""
    case, branches = task
    began, curve = time.perf_counter(), _curve(curves, case)
    words, found = f"{curve.searched}: the curve is incomplete", tuple[ForcedResponse, ...]()
    if curve.complete:
        crossed, left = _left(curves, case, branches)
        search = Search(effort=0.0, least_calls=left, curves=MOST)
        beside = curves_beside(
            curve,
            curves.problem,
            search,
            progress=lambda looked, _: report(looked / search.frequencies, case.title),
            crossed=crossed,
        )
        words, found = beside.curve.searched, beside.curves
    store, before = curves.store, files_of(case.beside, curves.store.outputs(case.beside))
    files = [f"responses/{case.beside}.json"]
    store.write_json(files[0], {"searched": words})
    for i, one in enumerate(found):
        files.append(f"responses/{case.beside}{i + 1}.npz")
        with store.writing(files[-1]) as path:
            one.save(path)
    seconds = time.perf_counter() - began
    store.finish(case.beside, curves.search_key(case), files, seconds, before)


def _curve(curves: Curves, case: CurveCase) -> ForcedResponse:
    return curves.load(replace(case, search=""))


def _left(
    curves: Curves, case: CurveCase, branches: Sequence[LevelBranch]
) -> tuple[list[AtLevel], int]:
    """(what the branches have crossed beside a curve, residual calls that are left for it)."""
    found, used = list[AtLevel](), 0
    for branch in branches:
        k = [one.Fe_N for one in branch.complete].index(case.Fe_N)
        with open_npz(curves.store.path(branch.file)) as z:
            further, reach, calls = z[f"further_{k}"], z["reach"][k], int(z["calls"])
        found.append(AtLevel(branch.hz, tuple(further), float(reach), calls))
        used += calls
    search = branches[0].search
    return found, max(int((search.calls - used) / len(branches[0].complete)), 0)
