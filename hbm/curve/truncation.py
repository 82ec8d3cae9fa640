"""What the orders that are left out would change: an estimate of the error of every point.

The motion of a point with the orders 0..H gives its contact forces at the orders above H, too. They
move the contacts at these orders, against the receptance and the tangents that the contacts show
there; an order at a time: what couples the orders is second to that. On the motion with these
orders the law gives other forces at the orders up to H, and the Jacobian of the point says what
that changes. A law of sampled forces is evaluated with the samples of the higher orders, so that
the error of the samples is in the estimate.

Krack, Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), sec. 2.3 and 4.3, for the
truncation; the correction is the first step of Newton's method with more orders, by parts.
"""

from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import Equation, Parameter
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.result import ForcedResponse

DOUBTFUL = 0.1  # of the vibration: a larger correction is none of first order


@dataclass(frozen=True)
class TruncationError:
    """Estimates for the n points and m outputs of a curve, at the value of its parameter.

    outputs : (n, m) m, root mean square over a cycle of what further orders change in the vibration
        of an output; NaN where a point failed
    relative : (n,) the largest over the outputs, of the largest vibration of an output at that
        point, both as root mean square
    doubtful : (n,) bool, the correction is too large to be linear, as beside a fold: the error is
        large, how large is not known
    """

    outputs: np.ndarray
    relative: np.ndarray
    doubtful: np.ndarray


def truncation_error(
    curve: ForcedResponse, problem: ContactProblem, parameter: Parameter | None = None
) -> TruncationError:
    """The error of every point of a curve by the orders that it leaves out.

    problem : the ContactProblem that the curve was made with; parameter : as in `find_peaks`
    Raises InputError where the problem does not fit the curve.

        error = truncation_error(curve, problem)
        print(error.relative.max(), error.doubtful.any())
    """
    equation, points = restored(curve, problem, parameter)
    wide = replace(equation, balance=_wider(equation.balance))
    outputs = np.full((len(points), len(curve.output_rows)), np.nan)
    size = np.full(len(points), np.nan)
    for i, point in enumerate(points):
        if point.converged:
            change = correction(equation, wide, point, curve.output_rows)
            outputs[i] = _root_mean_square(change)
            size[i] = _root_mean_square(curve.harmonics[i]).max(initial=0.0)
    relative = outputs.max(axis=1, initial=0.0) / np.maximum(size, np.finfo(float).tiny)
    with np.errstate(invalid="ignore"):
        return TruncationError(outputs, relative, relative > DOUBTFUL)


def correction(equation: Equation, wide: Equation, point: Point, rows: np.ndarray) -> np.ndarray:
    """(m, H'+1) complex, m: what further orders change in the outputs, rows (m, r), of a solved
    point; wide : the equation with orders up to H' > H."""
    more = wide.evaluate(_padded(point.x, equation.balance, wide.balance), point.parameter)
    high, x_high = _higher_orders(more, equation.balance.H)
    there = wide.evaluate(more.x + x_high, point.parameter)
    here = equation.evaluate(point.x, point.parameter)
    low = _lower_orders(here, there.forces.g - more.forces.g + _of_samples(here, more))
    found = rows @ (more.balance.receptance.shapes @ high)
    found[:, : equation.balance.H + 1] += rows @ (here.balance.receptance.shapes @ low)
    return found


def _wider(balance: HarmonicBalance) -> HarmonicBalance:
    """With orders up to 2 H + 1."""
    return HarmonicBalance(
        balance.problem, balance.forces, 2 * balance.H + 1, balance.given_start, None
    )


def _padded(x, balance, wide):
    found = np.zeros((balance.n_components, wide.nh))
    found[:, : balance.nh] = x.reshape(-1, balance.nh)
    return found.ravel()


def _higher_orders(more: Linearisation, H: int) -> tuple[np.ndarray, np.ndarray]:
    """(modal (m, H'+1), x (n',)) of the orders above H, each by itself: u = -G (g + D u)."""
    hb, b = more.balance, more.forces
    components = (b.contacts[:, None] * hb.nd + np.arange(hb.nd)).ravel()
    shapes = hb.shapes[components]
    g = fourier.to_complex(b.g.reshape(-1, hb.nh))
    modal = np.zeros_like(more.modal)
    for k in range(H + 1, hb.H + 1):
        push = g[:, k].copy()
        if len(components):
            G = _real_blocks((shapes * more.factors[:, k]) @ shapes.T)
            D = _of_order(b.D, k)
            free = -(shapes * more.factors[:, k]) @ (hb.shapes.T @ push)
            u = np.linalg.solve(np.eye(len(G)) + G @ D, _parts(free))
            push[components] += _complex(D @ u)
        modal[:, k] = -more.factors[:, k] * (hb.shapes.T @ push)
    return modal, fourier.to_real(hb.shapes @ modal).ravel()


def _lower_orders(here: Linearisation, dg: np.ndarray) -> np.ndarray:
    """(m, H+1) modal: the change of the orders up to H under a change of the contact forces (P, nd,
    nh'), with the derivative of the law."""
    hb = here.balance
    g = dg.reshape(-1, dg.shape[2])[:, : hb.nh]
    direct = -here.factors * (hb.shapes.T @ fourier.to_complex(g))
    R = -fourier.to_real(hb.shapes @ direct).ravel()
    dx, _ = here.solve(np.zeros_like(here.x), 1.0, 0.0, R)
    return direct + here.moved(dx, 0.0).modal - here.modal


def _of_samples(here, more):
    """What the samples of the higher orders change in the forces up to H: nothing for a law whose
    events are located."""
    change = np.zeros_like(more.forces.g)
    change[:, :, : here.balance.nh] = more.forces.g[:, :, : here.balance.nh] - here.forces.g
    return change


def _of_order(D, k):
    """(2 a nd, 2 a nd) derivative of the order k of the forces by that of the motion, block by
    block; D (a, nd, nh, nd, nh)."""
    a, nd = D.shape[:2]
    blocks = D[:, :, 2 * k - 1 : 2 * k + 1, :, 2 * k - 1 : 2 * k + 1]
    found = np.zeros((a, 2 * nd, a, 2 * nd))
    found[np.arange(a), :, np.arange(a), :] = blocks.reshape(a, 2 * nd, 2 * nd)
    return found.reshape(2 * a * nd, -1)


def _real_blocks(G):
    """(2n, 2n) real form of a complex matrix (n, n), real and imaginary part of each side by
    side."""
    n = len(G)
    found = np.empty((n, 2, n, 2))
    found[:, 0, :, 0] = found[:, 1, :, 1] = G.real
    found[:, 1, :, 0] = G.imag
    found[:, 0, :, 1] = -G.imag
    return found.reshape(2 * n, 2 * n)


def _parts(v):
    return np.column_stack([v.real, v.imag]).ravel()


def _complex(parts):
    return parts[::2] + 1j * parts[1::2]


def _root_mean_square(harmonics):
    """(m,) of the vibration with harmonics (m, H+1)."""
    return np.sqrt(0.5 * (np.abs(harmonics[:, 1:]) ** 2).sum(axis=1))
