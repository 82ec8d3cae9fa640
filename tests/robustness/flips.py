"""Bits flipped at random over everything in a results folder: noticed, or harmless.

    python -m tests.robustness.flips [--count 300] [--seed 7]

After each flip the command is given again: it stops in one line, makes what is damaged anew, or the
results that it leaves are those of before.
"""

import argparse
import json
import shutil
import tempfile
from pathlib import Path

import numpy as np

from tests.robustness import counts
from tests.robustness.rows import chain, tipdamp

VERBS = ("inspect", "reduce", "preload", "tune", "respond", "cycles")


def numbers(folder: Path) -> dict[str, str]:
    """What a study found, without durations."""

    def plain(value):
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items() if k != "seconds"}
        return [plain(v) for v in value] if isinstance(value, list) else value

    return {
        p.name: json.dumps(plain(json.loads(p.read_bytes()))) for p in sorted(folder.glob("*.json"))
    }


def run(study) -> list:
    said = []
    for verb in VERBS:
        said.append(tipdamp(verb, study, "--quiet"))
        if said[-1].code:
            break
    return said


def one_flip(study: Path, whole: Path, intact: dict, rng: np.random.Generator) -> str:
    """'stopped', 'made anew' or 'harmless'; AssertionError where the damage went on unseen."""
    folder = study.parent / "results" / study.stem
    shutil.rmtree(folder)
    shutil.copytree(whole, folder)
    files = sorted(p for p in folder.rglob("*") if p.is_file() and p.stat().st_size)
    chosen = files[rng.integers(len(files))]
    data = bytearray(chosen.read_bytes())
    data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
    chosen.write_bytes(bytes(data))
    said = run(study)
    text = "".join(one.out + one.err for one in said)
    assert "Traceback" not in text, (chosen, text)
    if said[-1].code:
        assert said[-1].code == 2 and said[-1].err.strip().splitlines()[-1].startswith(
            "tipdamp: "
        ), (chosen, said[-1])
        return "stopped"
    assert numbers(folder) == intact, chosen
    again = (
        "counts as not run" in text
        or "made anew" in text
        or any("up to date" not in one.out for one in said)
    )
    return "made anew" if again else "harmless"


def flips(count: int, seed: int, place: Path) -> dict[str, int]:
    """{outcome: how many}"""
    study = chain(place)
    assert all(one.code == 0 for one in run(study))
    folder, whole = place / "results" / "study", place / "whole"
    shutil.copytree(folder, whole)
    intact, found = numbers(folder), {"stopped": 0, "made anew": 0, "harmless": 0}
    for i in range(count):
        found[one_flip(study, whole, intact, np.random.default_rng([seed, i]))] += 1
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=7)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        found = flips(asked.count, asked.seed, Path(place))
    counts.keep(
        "bit flips in a results folder", seed=asked.seed, flips=asked.count, **found, unseen=0
    )


if __name__ == "__main__":
    main()
