"""5 000 random beams on springs and hard supports against Macaulay brackets.

    python -m tests.benchmarks.preload_random_beams

Up to 8 supports every one of the 2^n sets is tried; above, the forces on the set that was found are worked out anew
by Macaulay brackets and must satisfy every condition, which for a convex problem proves the set.
"""

import sys
import time
from collections import Counter

import numpy as np

from static_contact.preload import StaticContact
from tests.benchmarks.record import one_thread, record
from tests.static_contact.beams import beam, by_trying_all_sets, is_solution, macaulay, random_case, supports


def compare(case):
    """(largest force error / largest force, same set, method, seconds of one solve, supports)."""
    x, EI, kn, gap, load = case
    statics = StaticContact(beam(x, EI), supports(x, kn, gap))
    began = time.perf_counter()
    result = statics.solve(load)
    seconds = time.perf_counter() - began
    closed = result.force > 0
    if len(x) <= 8:
        force, right = by_trying_all_sets(x, EI, kn, gap, load)
        same = bool((right == closed).all())
    else:
        r, opening = macaulay(x, EI, kn, gap, load, closed)
        force, same = r[0], bool(is_solution(r, opening, closed[None])[0])
    return np.abs(result.force - force).max() / force.max(), same, result.method, seconds, len(x)


def main(count=5000, seed=20162):
    one_thread()
    random = np.random.default_rng(seed)
    found = [compare(random_case(random, 8 if i % 2 else 31)) for i in range(count)]
    error, same, method, seconds, size = zip(*found, strict=True)
    record("preload_random_beams", {
        "count": count, "seed": seed, "same_set": sum(same), "largest_error": max(error),
        "methods": dict(Counter(method)), "supports": [min(size), max(size)],
        "median_ms": 1e3 * float(np.median(seconds))})
    print(f"{count} beams of {min(size)} to {max(size)} supports; same set {sum(same)}; largest error of a force "
          f"{max(error):.1e} of the largest; methods {dict(Counter(method))}; "
          f"median solve {1e3 * np.median(seconds):.2f} ms")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
