"""Stuck frequencies of the two-blade rig: reduced model, its error bound, and the unreduced finite-element model.

    tipdamp run docs/studies/two_blade_rig/asymmetric.toml --out RIG
    python -m tests.benchmarks.stuck_bound RIG

The stage `tune` of the study compares every stuck frequency below 5 kHz with the full model; its figures go to
results/stuck_bound.json.
"""

import argparse
import json
from pathlib import Path

from tests.benchmarks.record import one_thread, record


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("rig", type=Path, help="folder of the results of the study")
    check = json.loads((parser.parse_args().rig / "tune.json").read_text())["full_model_check"]
    rows = [{"set": name, "mode": k + 1, "reduced_hz": found["reduced_hz"][k], "full_hz": hz,
             "bound": found["error_bound"][k]}
            for name, found in check.items() for k, hz in enumerate(found["full_hz"])]
    record("stuck_bound", {"rows": rows})


if __name__ == "__main__":
    main()
