"""Modes of 500 random bodies with repeated and close frequencies: how many are missed.

    python -m tests.benchmarks.random_bodies [--bodies 500]

Every body's lowest modes are asked for by number and by a frequency below which they lie. The figures go to
results/random_bodies.json.
"""

import argparse

from tests.benchmarks.record import one_thread, record
from tests.modal.random_bodies import missed


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bodies", type=int, default=500)
    count = parser.parse_args().bodies
    found = {seed: missed(seed) for seed in range(count)}
    bad = [seed for seed, n in found.items() if n]
    print(f"{count} bodies, {sum(found.values())} modes missed, seeds {bad}")
    record("random_bodies", {"bodies": count, "missed": sum(found.values()),
                             "seeds": bad})


if __name__ == "__main__":
    main()
