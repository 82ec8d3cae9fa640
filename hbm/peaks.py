"""Peaks: local maxima of the outputs along a curve, each solved."""

import numpy as np

from hbm.continuation.branch import Branch
from hbm.continuation.maxima import PeakRefinement
from hbm.continuation.settings import DEFAULT, Settings
from hbm.parameter import Equation, Parameter
from hbm.problem import ContactProblem
from hbm.result import KINDS, ForcedResponse, amplitude, local_maxima
from hbm.solutions import restored
from hbm.tracing import Outputs


def refine_largest(equation: Equation, branch: Branch, rows: np.ndarray, settings: Settings) -> np.ndarray:
    """Insert solved points at the largest local maximum of half peak to peak of every output, and say which they are.

    rows : (m, r) outputs. Returns (n, m) bool, for the branch as it is afterwards.
    """
    outputs = Outputs(rows)
    table = list(amplitude(outputs.of_branch(branch, equation.balance.H), KINDS[0]))
    refinement = _refinement(equation, branch, table, (outputs, KINDS[0]), settings)
    found = []
    for j in np.flatnonzero(np.nanmax(table, axis=0) > _noise(branch, rows)):
        column = np.array(table)[:, j]
        largest = sorted(local_maxima(column, [p.parameter for p in branch.points]), key=lambda i: -column[i])
        if largest:
            found.append((refinement.run(largest[0], j), j))
    place = {id(point): i for i, point in enumerate(branch.points)}
    marks = np.zeros((len(branch.points), len(rows)), dtype=bool)
    for point, j in found:
        marks[place[id(point)], j] = True
    return marks


def find_peaks(curve: ForcedResponse, problem: ContactProblem, name: str, kind: str = "half_peak_to_peak",
          parameter: Parameter | None = None) -> np.ndarray:
    """(k, 2) Hz and m of every local maximum of an output inside the band, the largest first, solved to 1e-8.

    problem : the ContactProblem that the curve was made with; kind : as in ForcedResponse.amplitude
    parameter : as given to `follow_parameter`, where that was no name; then its values stand in place of Hz
    Ripples are left out: what is less than a thousandth of its height above the saddles beside it. Raises InputError
    for an unknown output or kind, and where the problem does not fit the curve.
    """
    j, settings = curve.column(name), DEFAULT
    a = curve.amplitude(kind)[:, j]
    equation, points = restored(curve, problem, parameter)
    branch, rows = Branch(points), curve.output_rows[[j]]
    if not np.nanmax(a, initial=0.0) > _noise_of(curve, equation, points, rows):
        return np.empty((0, 2))
    table = [np.array([value]) for value in a]
    refinement, found = _refinement(equation, branch, table, (Outputs(rows), kind), settings), []
    solved = curve.peak_points[:, j] if kind == KINDS[0] and curve.peak_points.size else np.zeros(len(a), dtype=bool)
    for begin, done in [(branch.points[i], solved[i]) for i in local_maxima(a, [p.parameter for p in points])]:
        top = begin if done else refinement.run(branch.points.index(begin))
        found.append((top.parameter / equation.parameter.scale, float(table[branch.points.index(top)][0])))
    table_of = np.reshape(found, (-1, 2))
    return table_of[np.argsort(-table_of[:, 1], kind="stable")]


def _refinement(equation, branch, table, quantity, settings):
    outputs, kind = quantity

    def heights(point):
        found = amplitude(outputs.of_point(point), kind)
        point.detail.forget()
        return found

    return PeakRefinement(equation.evaluate, branch, table, heights, equation.weights, settings)


def _noise(branch, rows):
    """(m,) amplitudes of the outputs, rows (m, r), that are rounding beside the motion of the whole model."""
    point = max((p for p in branch.points if p.converged), key=lambda p: np.linalg.norm(p.detail.modal[:, 1:]))
    return DEFAULT.peak_noise * np.linalg.norm(rows, axis=1) * np.linalg.norm(point.detail.displacement()[:, 1:])


def _noise_of(curve, equation, points, rows):
    """The same for a curve: at the point whose contacts move most."""
    i = int(np.nanargmax(np.linalg.norm(curve.unknowns, axis=1)))
    detail = equation.evaluate(points[i].x, points[i].parameter)
    return DEFAULT.peak_noise * np.linalg.norm(rows, axis=1)[0] * np.linalg.norm(detail.displacement()[:, 1:])
