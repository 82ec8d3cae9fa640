"""Derivatives of peaks, points and stuck frequencies beside differences, and what they cost."""

import time

from tests.hbm.cases import rig
from tests.hbm.modes.test_derivatives import (
    OWN,
    VARIED,
    by_matrix,
    by_ratio,
    chain,
    difference,
    peak,
    peak_by_own,
    turning,
)
from tests.validation import Row, Subject, row
from tipdamp import follow_band, peak_derivatives, stuck_frequency_derivatives

KINDS = {"ratios": by_ratio, "matrix": by_matrix, "gyroscopic": turning}
STUCK = "difference of the stuck frequency"
COST = "curves' time (asked: at most 3)"


def rows():
    for setting, c in (("mu", 0), ("kt", 1), ("preload", 0)):
        yield from _setting("ratios", setting, c)
    yield from _own("ratios")
    yield from _stuck()
    yield from _cost()


def quick():
    """One of each kind: tests of the room hold every setting, and nothing is asked of the cost."""
    yield from _setting("ratios", "mu", 0)
    yield from _stuck()


def long():
    """Every setting with every kind of damping."""
    for kind in KINDS:
        for setting, c in VARIED:
            yield from _setting(kind, setting, c)
        yield from _own(kind)
    yield from _stuck()
    yield from _cost()


def _setting(kind, setting, c):
    found = peak(chain(KINDS[kind]))
    by = found.frequency_by[setting][c], found.amplitude_by[setting][c]
    case = f"chain, {kind}, {setting} of contact {c}"
    yield from _beside(case, found, by, lambda s: peak(chain(KINDS[kind], (setting, c), s)))


def _own(kind):
    found = peak_by_own(KINDS[kind], parameters=OWN)
    by = [
        sum(part[one.name][0] for one in OWN) for part in (found.frequency_by, found.amplitude_by)
    ]
    case = f"chain, {kind}, a mass and a spring"
    yield from _beside(case, found, by, lambda s: peak_by_own(KINDS[kind], s))


def _beside(case, found, by, at):
    """Small derivatives are compared in tenths of the quantity itself."""
    known = {}

    def values(factor):
        if factor not in known:
            one = at(factor)
            known[factor] = one.frequency, one.amplitude
        return known[factor]

    for k, name in enumerate(("frequency", "height")):
        reference = difference(lambda s, k=k: values(s)[k])
        scale = max(abs(reference), 0.1 * (found.frequency, found.amplitude)[k])
        yield row(f"{case}, {name}", by[k], reference, f"difference of the peak's {name}", scale)


def _stuck():
    problem = chain().contact_problem
    found = stuck_frequency_derivatives(problem, 1, parameters=OWN)
    for one in OWN:
        reference = difference(
            lambda s, one=one: stuck_frequency_derivatives(one.of_value(problem, s), 1).frequency
        )
        yield row(f"chain, {one.name}", found.total(one.name)[0], reference, STUCK)


def _cost():
    """Of 18 pairs x 4 settings and two common ones."""
    problem, force, outputs = rig()
    name = next(iter(outputs))
    for _ in range(2):  # the first loads kernels
        began = time.process_time()
        curve = follow_band(
            problem,
            20 * force,
            (1450, 1600),
            outputs={name: outputs[name]},
            harmonics=3,
            truncation=False,
        )
        between = time.process_time()
        peak_derivatives(curve, problem, name)
    share = (time.process_time() - between) / (between - began)
    yield Row("rig, 20 N, H = 3", share, 3.0, share, COST)


SUBJECT = Subject(
    "Derivatives of peaks and stuck frequencies",
    "Of a chain of three masses with two contacts, H = 5, by relative changes: beside differences "
    "of fourth order of peaks that are solved anew. The cost is CPU time on one thread, in that of "
    "the curve; it is reported.",
    rows,
    {
        "difference of the peak's frequency": 1e-6,
        "difference of the peak's height": 1e-6,
        STUCK: 1e-6,
    },
    long=long,
    quick=quick,
)
