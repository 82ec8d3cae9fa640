"""Random beams on springs and hard supports against Macaulay brackets.

Up to 8 supports every one of the 2^n sets is tried; above, the forces on the set that was found are
worked out anew by Macaulay brackets and must satisfy every condition, which for a convex problem
proves the set.
"""

import numpy as np

from tests.static_contact.beams import (
    beam,
    by_trying_all_sets,
    is_solution,
    macaulay,
    random_case,
    supports,
)
from tests.validation import Row, Subject, row
from tipdamp.static_contact.contact.preload import StaticContact


def compare(case):
    """(largest force error / largest force, same set, method)."""
    x, EI, kn, gap, load = case
    result = StaticContact(beam(x, EI), supports(x, kn, gap)).solve(load)
    closed = result.force > 0
    if len(x) <= 8:
        force, right = by_trying_all_sets(x, EI, kn, gap, load)
        same = bool((right == closed).all())
    else:
        r, opening = macaulay(x, EI, kn, gap, load, closed)
        force, same = r[0], bool(is_solution(r, opening, closed[None])[0])
    return np.abs(result.force - force).max() / force.max(), same, result.method


def rows(count=5000, seed=20162):
    random = np.random.default_rng(seed)
    error, same, _ = zip(
        *(compare(random_case(random, 8 if i % 2 else 31)) for i in range(count)), strict=True
    )
    name = f"{count} beams of 3 to 31 supports (seed {seed})"
    yield row(f"{name}: same set", sum(same), count, "detached set")
    yield Row(
        f"{name}: largest error of a force",
        "",
        "",
        max(error),
        "Macaulay brackets, of the largest force",
    )


SUBJECT = Subject(
    "Random beams on springs and hard supports",
    "Every one of the 2^n sets is tried up to 8 supports, "
    "above that the conditions are checked on forces by Macaulay brackets.",
    rows,
    {"detached set": 0.0, "Macaulay": 1e-8},
)
