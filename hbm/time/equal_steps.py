"""Equal steps under laws that are linear in the motion: the compiled part of `sampled`.

Of every sample a law gives force and state at a trial motion, with their tangents. Steps that
follow these lines are one step of Newton's method for all samples together.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.time.events import System, times

EqualSteps = namedtuple("EqualSteps", "h W D Dv slope smooth")
EqualSteps.__doc__ = """Steps of h s; W (5, n) : weights as of `events.fill_weights`

D, Dv (nc, nc) : motion and velocity at the end by the nonlinear force there, with the sign changed
slope : 1/s, of the force over the step, which massless modes feel
smooth : whether the force has a rate, and the step its fourth order; none of a law with a state
"""

Lines = namedtuple("Lines", "u v memory g state g_u g_v g_memory state_u state_v state_memory")
Lines.__doc__ = """A law at k samples, as lines about a trial.

u, v (k, nc) m, m/s; memory (k, P ns) : the trial, memory before each step
g (k, nc) N; state (k, P ns) : nonlinear force and state that it gives
g_u ... (k, P, nd or ns, nd or ns) : their tangents, those of g less the stuck springs
"""

Path = namedtuple("Path", "u v g memory")
Path.__doc__ = """At k samples, filled by `follow_lines`: u, v, g (k, nc); memory (k, P ns) after
each step."""


@njit(cache=True)
def add_product(blocks: np.ndarray, x: np.ndarray, into: np.ndarray) -> None:
    """into (P i, m) += blocks (P, i, j) along the diagonal times x (P j, m)."""
    P, rows, columns = blocks.shape
    for p in range(P):
        for i in range(rows):
            for j in range(columns):
                value = blocks[p, i, j]
                if value != 0.0:
                    for c in range(x.shape[1]):
                        into[p * rows + i, c] += value * x[p * columns + j, c]


@njit(cache=True)
def on_line(
    value: np.ndarray,
    slopes: tuple[np.ndarray, np.ndarray, np.ndarray],
    du: np.ndarray,
    dv: np.ndarray,
    moved: np.ndarray,
) -> np.ndarray:
    """(n, 1) value (n,) of a line at motion, velocity (nc,) and memory (P ns, 1) beside its trial;
    slopes : (P, ., .) by each."""
    found = value.copy().reshape(-1, 1)
    add_product(slopes[0], du.reshape(-1, 1), found)
    add_product(slopes[1], dv.reshape(-1, 1), found)
    add_product(slopes[2], moved, found)
    return found


@njit(cache=True)
def rate_of_force(
    system: System,
    known: np.ndarray,
    g_u: np.ndarray,
    g_v: np.ndarray,
    z: np.ndarray,
    g: np.ndarray,
) -> np.ndarray:
    """g' (nc,) at the poles z under the force g; known : (3, nc) at that instant."""
    z_rate = times(system.s, z) - np.dot(system.into, g)
    v = known[1] + np.dot(system.out, z_rate)  # less static g'
    a = known[2] + np.dot(system.out, times(system.s, z_rate))
    turning, matrix = np.zeros((len(g), 1)), np.eye(len(g))
    add_product(g_u, v.reshape(-1, 1), turning)
    add_product(g_v, a.reshape(-1, 1), turning)
    add_product(g_u, system.static, matrix)
    return np.linalg.solve(matrix, turning).ravel()


@njit(cache=True)
def follow_lines(
    system: System,
    steps: EqualSteps,
    known: np.ndarray,
    first: int,
    lines: Lines,
    begin: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    path: Path,
) -> tuple[np.ndarray, np.ndarray]:
    """(z, g') after the samples of `path` from number `first` on; NaN where motion is no number.

    known : of `StuckSystem.known` at all samples; begin : z (2n,), g, g' (nc,) and memory (P ns,)
    """
    z, g, rate, memory = begin
    W = steps.W
    for k in range(len(path.u)):
        free = (
            times(W[0], z)
            - times(W[1], np.dot(system.into, g))
            - times(W[2], np.dot(system.into, rate))
        )
        u0 = known[0, first + k] + np.dot(system.out, free)
        v0 = known[1, first + k] + np.dot(system.out, times(system.s, free))
        v0 += np.dot(system.static, steps.slope * g + rate)
        moved = (memory - lines.memory[k]).reshape(-1, 1)
        right = on_line(
            lines.g[k],
            (lines.g_u[k], lines.g_v[k], lines.g_memory[k]),
            u0 - lines.u[k],
            v0 - lines.v[k],
            moved,
        )
        if not np.isfinite(right).all():
            return z * np.nan, rate
        matrix = np.eye(len(g))
        add_product(lines.g_u[k], steps.D, matrix)
        add_product(lines.g_v[k], steps.Dv, matrix)
        end = np.linalg.solve(matrix, right).ravel()
        path.u[k], path.v[k] = u0 - np.dot(steps.D, end), v0 - np.dot(steps.Dv, end)
        memory = on_line(
            lines.state[k],
            (lines.state_u[k], lines.state_v[k], lines.state_memory[k]),
            path.u[k] - lines.u[k],
            path.v[k] - lines.v[k],
            moved,
        ).ravel()
        z = free - times(W[3], np.dot(system.into, end))
        if steps.smooth:
            end_rate = rate_of_force(
                system, known[:, first + k], lines.g_u[k], lines.g_v[k], z, end
            )
            defect = end_rate - (2 / steps.h * (end - g) - rate)
            z = z - times(W[4], np.dot(system.into, defect))
            rate = end_rate
        g = end
        path.g[k], path.memory[k] = g, memory
    return z, rate
