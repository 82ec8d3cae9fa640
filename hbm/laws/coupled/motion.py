"""The motion of a contact in forces, and when a slider at rest slips.

The spring carries T = p - r, with p = kt u and r = kt w of the slider w, under the limit L = mu N;
a slider at rest slips where |T| reaches L, a root in time.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws import sampled
from tipdamp.hbm.laws.uncoupled.breaks import TWO_PI

TINY = 1e-150  # of what is divided by: products with the quotient neither overflow nor vanish
P1, P2, LIMIT, RATE1, RATE2, LIMIT_RATE = range(6)  # of the motion at an instant, in forces


class CoupledSettings(NamedTuple):
    """Tolerances of the periodic cycle."""

    max_periods: int = 60  # a slider that creeps longer is taken as it is then
    repeats: float = sampled.SETTINGS.repeats
    regular: float = 1e-5  # of det(I - A): below, what a period does to the slider is not inverted
    forgets: float = 1e-12  # of A: a period leaves nothing of where the slider was before
    # of the limit force: a slider that near slips on from the period before
    on_limit: float = 1e-12
    discs: int = 40  # of limits between which a slider comes to rest; five are enough
    nearly: float = 1e-5  # of the limit force, by which it may miss a place of rest
    corner: float = 1e-9  # sine of the angle between two limits: less is none
    # rad: highest term of the angle over a panel; its square is the error of the order
    degree: float = 1e-6
    widest: float = 2.0  # of a panel, over the highest harmonic, whose wave it resolves ...
    wide: float = 0.5  # ... in rad, where that is low
    narrowest: float = 1e-9  # rad
    # of a change of the motion, to the force at a node; it is 0.3 but where limits vanish
    adds: float = 2.0
    newton: int = 12  # steps of the collocation, else the panel is too wide
    turned: float = 1e-8  # rad: Newton's method squares the error once more
    pieces: int = 400  # of a period, of stick and of slip ...
    panels: int = 20  # ... and more of them for each harmonic


SETTINGS = CoupledSettings()

Contact = namedtuple("Contact", "c wave rate tau opened size scale")
Contact.__doc__ = """Motion of a contact in forces: p1, p2 and L.

c (3, nh) : its series; wave, rate (3, n) : at the samples tau (n + 1,), and by tau
opened (k, 2) : times in which it is open; size, scale : largest |p| and L at the samples
"""


@njit(cache=True)
def motion(c: np.ndarray, t: float, e: np.ndarray, at: np.ndarray) -> None:
    """Fill the basis e (nh,) and p1, p2, L with their rates (6,) at an instant."""
    c1, s1 = np.cos(t), np.sin(t)
    ck, sk = 1.0, 0.0
    e[0] = 1.0
    for d in range(3):
        at[d], at[3 + d] = c[d, 0], 0.0
    for k in range(1, (len(e) - 1) // 2 + 1):
        ck, sk = ck * c1 - sk * s1, sk * c1 + ck * s1
        e[2 * k - 1], e[2 * k] = ck, -sk
        for d in range(3):
            at[d] += c[d, 2 * k - 1] * ck - c[d, 2 * k] * sk
            at[3 + d] -= k * (c[d, 2 * k - 1] * sk + c[d, 2 * k] * ck)


@njit(cache=True)
def basis_rate(e: np.ndarray, m: int) -> float:
    """Rate of term m of the basis e (nh,) of an instant."""
    if m == 0:
        return 0.0
    k = (m + 1) // 2
    return k * (e[m + 1] if m % 2 else -e[m - 1])


@njit(cache=True)
def bend(c: np.ndarray, e: np.ndarray, psi: float) -> float:
    """Acceleration across the direction of slip, by the phase, at the instant of the basis e."""
    across = 0.0
    for m in range(1, len(e)):
        k = (m + 1) // 2
        across -= k * k * e[m] * (c[1, m] * np.cos(psi) - c[0, m] * np.sin(psi))
    return across


@njit(cache=True)
def direction(at: np.ndarray, r: np.ndarray) -> float:
    """Angle of the force that the spring of a slider at r carries."""
    return np.arctan2(at[P2] - r[1], at[P1] - r[0])


@njit(cache=True)
def excess(at: np.ndarray, r: np.ndarray) -> tuple[float, float]:
    """|p - r|^2 - L^2, and half its rate."""
    T1, T2 = at[P1] - r[0], at[P2] - r[1]
    return T1 * T1 + T2 * T2 - at[LIMIT] ** 2, T1 * at[RATE1] + T2 * at[RATE2] - at[LIMIT] * at[
        LIMIT_RATE
    ]


@njit(cache=True)
def slides(at: np.ndarray, psi: float) -> float:
    """Rate at which a slider in slip is pulled along: positive, or it comes to rest."""
    return at[RATE1] * np.cos(psi) + at[RATE2] * np.sin(psi) - at[LIMIT_RATE]


@njit(cache=True)
def secant(a: float, fa: float, b: float, fb: float) -> float:
    """Where the line through two values of opposite sign is zero, or the middle."""
    x = (a * fb - b * fa) / (fb - fa)
    return x if a < x < b else 0.5 * (a + b)


@njit(cache=True)
def narrowed(
    beyond: bool, x: float, f: float, a: float, fa: float, b: float, fb: float, side: int
) -> tuple[float, float, float, float, int]:
    """The bracket with x, which is `beyond` the root or not, as an end; an end that stays twice
    counts half [Dowell, Jarratt 1971: Illinois method]."""
    if beyond:
        return a, fa * (0.5 if side == 1 else 1.0), x, f, 1
    return x, f, b, fb * (0.5 if side == -1 else 1.0), -1


@njit(cache=True)
def excess_root(
    contact: Contact,
    r: np.ndarray,
    of_rate: bool,
    a: float,
    b: float,
    e: np.ndarray,
    at: np.ndarray,
) -> float:
    """Where the excess (falling: its rate) changes sign in [a, b], at b beyond it; bisection with
    secant steps."""
    x, side = 0.5 * (a + b), 0
    fa = fb = np.nan
    for _ in range(100):
        motion(contact.c, x, e, at)
        value, rate = excess(at, r)
        f = -rate if of_rate else value
        if f == 0:
            return x
        a, fa, b, fb, side = narrowed(f > 0, x, f, a, fa, b, fb, side)
        if b - a <= 4e-16 * (1 + b):
            break
        x = secant(a, fa, b, fb)
    return b


@njit(cache=True)
def onset(
    contact: Contact, r: np.ndarray, t: float, stop: float, e: np.ndarray, at: np.ndarray
) -> tuple[float, bool]:
    """First instant in [t, stop] at which a slider at rest slips, and whether there is one; it may
    begin and end between two samples."""
    tau, n = contact.tau, len(contact.tau) - 1
    motion(contact.c, t, e, at)
    a, rate_a = t, excess(at, r)[1]
    value_a = min(excess(at, r)[0], 0.0)
    i = min(int(t / TWO_PI * n), n - 1)
    while a < stop:
        i += 1
        b = min(tau[min(i, n)], stop)
        if b <= a:
            continue
        if b == stop:
            motion(contact.c, b, e, at)
        else:
            for d in range(3):
                at[d], at[3 + d] = contact.wave[d, i % n], contact.rate[d, i % n]
        value_b, rate_b = excess(at, r)
        if value_b > 0:
            return excess_root(contact, r, False, a, b, e, at), True
        if rate_a > 0 > rate_b:
            # tangents at both ends meet no lower than a maximum between them
            meet = (value_b - value_a - 2 * rate_b * (b - a)) / (rate_a - rate_b) / 2
            if value_a + 2 * rate_a * min(max(meet, 0.0), b - a) > 0:
                top = excess_root(contact, r, True, a, b, e, at)
                motion(contact.c, top, e, at)
                if excess(at, r)[0] > 0:
                    return excess_root(contact, r, False, a, top, e, at), True
        a, value_a, rate_a = b, value_b, rate_b
    return stop, False
