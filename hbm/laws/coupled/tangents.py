"""What coupled friction does with a disturbance between the instants of a cycle.

With n the direction of the force T = L n of a contact that slips, t across it, and w the slider,

    dT = dL n + kt t t.(du - dw),       L t.dw' = (p'.n - L') t.(du - dw) - p'.t (n.du - dL/kt)

(positions in m, rates by the phase); n.dw follows at once. The equation across is integrated by
Radau collocation, as the angle itself is: it is stiff where the limit vanishes, and there t.dw is
t.du. While the contact is open the slider follows the motion.
"""

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.coupled.motion import (
    LIMIT,
    LIMIT_RATE,
    RATE1,
    RATE2,
    bend,
    motion,
    slides,
)
from tipdamp.hbm.laws.coupled.slip import INVERSE, NODES, OF_START, STAGES, between, invert
from tipdamp.hbm.laws.uncoupled.breaks import FORWARD as SLIP
from tipdamp.hbm.laws.uncoupled.breaks import STICK


@njit(cache=True)
def angle(path: np.ndarray, j: int, last: int, t: float) -> float:
    """Angle of slip at t, from the pieces j to `last`."""
    while j < last and path[j, 2] < t and path[j + 1, 0] == SLIP:
        j += 1
    share = (t - path[j, 1]) / (path[j, 2] - path[j, 1])
    return between(path[j, 4:], path[j, 3], min(max(share, 0.0), 1.0))


@njit(cache=True)
def at_end(
    c: np.ndarray,
    at: np.ndarray,
    e: np.ndarray,
    psi: float,
    settings: tuple[float, float, float],
    blocks: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Fill blocks (nd, nd): of the force by motion and slider, and of its rate beside the former
    times their rates; settings : kt, mu kn, and the limit below which there is none.

    Where the limit vanishes so does t.(du - dw), and its rate is L'/|p'| of that of t.du."""
    kt, slope, least = settings
    gamma, rate, memory, turning = blocks
    normal = (np.cos(psi), np.sin(psi))
    across = (-normal[1], normal[0])
    share, by_limit, q = 1.0, 0.0, (0.0, 0.0)
    if at[LIMIT] > least:
        away, along = at[RATE1] * across[0] + at[RATE2] * across[1], slides(at, psi)
        q = (
            (away * normal[0] + along * across[0]) / at[LIMIT],
            (away * normal[1] + along * across[1]) / at[LIMIT],
        )
    else:
        speed = np.hypot(at[RATE1], at[RATE2])
        share = at[LIMIT_RATE] / max(speed, least)
        if at[LIMIT_RATE] > 0:  # the contact closes
            by_limit = slope * (1 - share) * bend(c, e, psi) / (speed + at[LIMIT_RATE])
    for i in range(2):
        gamma[i, 2] = slope * normal[i]
        rate[i, 2] = by_limit * across[i]
        for j in range(2):
            gamma[i, j] = share * kt * across[i] * across[j]
            memory[i, j] = -gamma[i, j]
            rate[i, j] = -kt * q[i] * across[j]
            turning[i, j] = kt * q[i] * across[j]


@njit(cache=True)
def carry_across(
    c: np.ndarray,
    path: np.ndarray,
    pieces: tuple[int, int],
    ends: tuple[float, float],
    settings: tuple[float, float],
    into: tuple[np.ndarray, np.ndarray],
) -> None:
    """Fill what an interval of slip keeps of the slider (nd, nd), and how it follows the motion (4,
    nd, nd): by its begin, its rate there, its end, and the defect of its rate at the end."""
    (a, b), (kt, slope), (kept, follows) = ends, settings, into
    h, e, at = b - a, np.empty(c.shape[1]), np.empty(6)
    J, inverse = np.empty((STAGES, STAGES)), np.empty((STAGES, STAGES))
    right = np.empty((STAGES, 4))  # by the slider before, and by the motion
    for i in range(STAGES):
        t = a + h * NODES[i]
        motion(c, t, e, at)
        psi = angle(path, *pieces, t)
        n1, n2, along = np.cos(psi), np.sin(psi), slides(at, psi)
        away = at[RATE2] * n1 - at[RATE1] * n2
        for j in range(STAGES):
            J[i, j] = at[LIMIT] * INVERSE[i, j]
        J[i, i] += h * along
        right[i, 0] = at[LIMIT] * OF_START[i]
        right[i, 1] = h * (-along * n2 - away * n1)
        right[i, 2] = h * (along * n1 - away * n2)
        right[i, 3] = h * away * slope / kt
    if not invert(J, inverse):
        return
    keeps, by = 0.0, np.zeros((4, 3))
    for i in range(STAGES):
        x, weight = NODES[i], inverse[STAGES - 1, i]
        keeps += weight * right[i, 0]
        shape = (1 - x * x, h * (x - x * x), x * x, h * (x - 1) * x * x)
        for m in range(4):
            for d in range(3):
                by[m, d] += weight * shape[m] * right[i, 1 + d]
    before, psi = angle(path, *pieces, a), angle(path, *pieces, b)
    n1, n2 = np.cos(psi), np.sin(psi)
    for i in range(2):
        across = n1 if i else -n2
        kept[i, 0], kept[i, 1] = -across * keeps * np.sin(before), across * keeps * np.cos(before)
        along = n2 if i else n1
        for d in range(3):
            for m in range(4):
                follows[m, i, d] = across * by[m, d]
        follows[2, i, 0] += along * n1
        follows[2, i, 1] += along * n2
        follows[2, i, 2] -= along * slope / kt


@njit(cache=True)
def fill(
    c: np.ndarray,
    path: np.ndarray,
    instants: np.ndarray,
    settings: tuple[float, float, float],
    into: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Fill in the tangents of a contact that moves c (3, nh), in forces, and of the pieces path (m,
    PIECE) of its cycle; settings : kt, mu kn, and the limit below which there is none; into : gamma
    and rate (2, K, nd, nd) and the arrays of `Turning`."""
    gamma, rate, memory, turning, kept, follows = into
    kt, slope, _ = settings
    e, at, j, last = np.empty(c.shape[1]), np.empty(6), 0, len(path) - 1
    for k in range(len(instants) - 1):
        a, b = instants[k], instants[k + 1]
        while j < last and path[j, 2] < 0.5 * (a + b):
            j += 1
        first = j
        while first > 0 and path[first, 1] > a and path[first - 1, 0] == SLIP:
            first -= 1
        if path[j, 0] == SLIP:
            for end in range(2):
                motion(c, instants[k + end], e, at)
                psi = angle(path, first, last, instants[k + end])
                blocks = gamma[end, k], rate[end, k], memory[end, k], turning[end, k]
                at_end(c, at, e, psi, settings, blocks)
            own = kept[k], follows[:, k]
            carry_across(c, path, (first, last), (a, b), (kt, slope), own)
            continue
        motion(c, b, e, at)
        closes = path[j, 0] != STICK and b >= path[j, 2] and at[LIMIT_RATE] > 0
        for d in range(2):
            if path[j, 0] == STICK:
                gamma[:, k, d, d], memory[:, k, d, d], kept[k, d, d] = kt, -kt, 1.0
            else:
                gamma[:, k, d, d], follows[2, k, d, d] = 0.0, 1.0
                if closes:  # the sooner, the more it is loaded
                    follows[2, k, d, 2] = -at[RATE1 + d] / kt * slope / at[LIMIT_RATE]
