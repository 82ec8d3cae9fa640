"""SIGKILL at random moments of a whole run, which is then resumed: the same numbers, nothing
finished made again.

    python -m tests.robustness.kills [--count 100] [--slow 15]

A study with meshes passes through every stage; most of the kills are aimed at a stage that is still
to come, so that the short ones are hit too. The kills of `--slow` come while one long curve runs:
what of it is lost is the time since its last block. The processes of a pool end with the one that
is killed.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.conftest import changed
from tests.robustness import counts
from tests.robustness.flips import numbers
from tests.robustness.rows import chain
from tests.robustness.runtime import environment
from tests.robustness.test_same_numbers import TEXT
from tests.tipdamp import corner_study
from tipdamp.hbm.result import ForcedResponse

STAGES = "inspect", "reduce", "preload", "tune", "respond", "cycles", "stress", "report"
EVERY = (
    ("levels = [2]", "levels = [2, 3, 5]"),
    ("harmonics = [1]", "harmonics = [3]"),
    ("both_ways = false", "both_ways = true\nstress = true"),
)
LONG = (
    ("levels = [5]", "levels = [40]"),
    ("harmonics = [1]", "harmonics = [19]"),
    ("[900, 1400]", "[300, 2400]"),
)
AGAIN = 0.6  # chance that a resumed run is killed once more
PATIENCE = 300.0  # s for a run that is left alone


@dataclass
class Tally:
    """What the kills met."""

    kills: int = 0
    stages: Counter = field(default_factory=Counter)
    repeated: int = 0
    not_resumed: int = 0
    lost: list[float] = field(default_factory=list)


def with_meshes(folder: Path) -> Path:
    study = corner_study.write(folder)
    study.write_text(changed(TEXT, *EVERY), encoding="utf-8")
    return study


def one_long_curve(folder: Path) -> Path:
    return chain(folder, *LONG)


def start(study: Path, jobs: int) -> subprocess.Popen:
    """`tipdamp run`; what it says goes into a file beside the study."""
    with (study.parent / "said.txt").open("w") as said:
        return subprocess.Popen(
            [sys.executable, "-m", "tipdamp", "run", study.name, "--quiet", "--jobs", str(jobs)],
            cwd=study.parent,
            stdout=said,
            stderr=said,
            env=environment(),
        )


def results(study: Path) -> Path:
    return study.parent / "results" / study.stem


def finished(study: Path) -> dict[str, int]:
    """{stage or curve: time of its record} of all that is finished."""
    return {path.stem: path.stat().st_mtime_ns for path in results(study).glob(".stages/*.json")}


def curves(study: Path) -> dict[str, Path]:
    return {path.name: path for path in results(study).glob("responses/*.npz")}


def difference(one: Path, two: Path) -> float:
    """Largest relative difference of the curves of two runs; their other results must not differ at
    all."""
    assert numbers(results(one)) == numbers(results(two))
    pairs = [
        (ForcedResponse.load(path), ForcedResponse.load(curves(two)[name]))
        for name, path in curves(one).items()
    ]
    assert pairs and curves(one).keys() == curves(two).keys()
    arrays = [
        (getattr(a, n), getattr(b, n))
        for a, b in pairs
        for n in ("frequency", "harmonics", "dissipated")
    ]
    return max(float(np.nanmax(np.abs(a - b)) / (np.nanmax(np.abs(a)) or 1.0)) for a, b in arrays)


@dataclass(frozen=True)
class Undisturbed:
    """A run that is left alone: {stage: s}, exit code, and the chance that a kill of others is
    aimed at a stage."""

    study: Path
    took: dict[str, float]
    code: int
    aimed: float

    def ahead(self, study: Path) -> list[str]:
        return [stage for stage in STAGES if stage in self.took.keys() - finished(study).keys()]


def moment(study: Path, whole: Undisturbed, rng: np.random.Generator) -> tuple[str | None, float]:
    """(stage after whose end, or None for the start of the process, s) to kill."""
    ahead, took = whole.ahead(study), whole.took
    if len(ahead) > 1 and rng.random() < whole.aimed:
        i = int(rng.integers(1, len(ahead)))
        return ahead[i - 1], rng.uniform(0.0, took[ahead[i]])
    return None, rng.uniform(0.2, 3.0 + sum(took[stage] for stage in ahead))


def kill(process: subprocess.Popen, study: Path, after: str | None, seconds: float) -> bool:
    """Whether it still ran at that moment, and was killed."""
    due = None if after else time.monotonic() + seconds
    while process.poll() is None and (due is None or time.monotonic() < due):
        if due is None and (results(study) / ".stages" / f"{after}.json").is_file():
            due = time.monotonic() + seconds
        time.sleep(0.002)
    if process.poll() is not None:
        return False
    process.kill()
    process.wait()
    return True


def killed_and_resumed(
    study: Path, whole: Undisturbed, rng: np.random.Generator, jobs: int, tally: Tally
) -> None:
    """Kill runs of a study, and leave the last one alone."""
    while True:
        before, began, process = finished(study), time.time(), start(study, jobs)
        spared = before and rng.random() > AGAIN
        killed = not spared and kill(process, study, *moment(study, whole, rng))
        now, stage = finished(study), (*whole.ahead(study), "end")[0]
        tally.kills += killed
        tally.stages[stage] += killed
        if killed and stage == "respond":
            tally.lost.append(
                time.time() - max(began, *_times(study, "tune.json"), *_times(study, "Fe_*"))
            )
        ended = process.wait(PATIENCE)
        tally.repeated += sum(now.get(name) != at for name, at in before.items())
        if not killed:
            said = (study.parent / "said.txt").read_text()
            tally.not_resumed += ended != whole.code or "Traceback" in said
            assert ended == whole.code and "Traceback" not in said, said
            return
        print(
            tally.kills, dict(tally.stages), f"lost {max(tally.lost, default=0):.1f} s", flush=True
        )


def _times(study, pattern):
    return [path.stat().st_mtime for path in results(study).glob(f".stages/{pattern}")]


def kills(make, count: int, place: Path, tally: Tally, seed: int, aimed: float) -> float:
    """Kill `count` runs of studies; the largest difference from an undisturbed one."""

    def made(name):
        (place / name).mkdir(parents=True)
        return make(place / name)

    whole = made("whole")
    worst = 0.0
    i = 0
    until = tally.kills + count
    code = start(whole, 1).wait()
    took = {
        s: json.loads((results(whole) / ".stages" / f"{s}.json").read_bytes())["seconds"]
        for s in finished(whole)
    }
    undisturbed = Undisturbed(whole, took, code, aimed)
    while tally.kills < until:
        i += 1
        study = made(str(i))
        killed_and_resumed(study, undisturbed, np.random.default_rng([seed, i]), 1 + i % 2, tally)
        worst = max(worst, difference(whole, study))
        assert not list(study.parent.rglob(".tmp-*")), "litter"
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--slow", type=int, default=15, help="of these, while one long curve runs")
    parser.add_argument("--seed", type=int, default=11)
    asked, tally = parser.parse_args(), Tally()
    with tempfile.TemporaryDirectory() as place:
        worst = max(
            kills(one_long_curve, asked.slow, Path(place) / "long", tally, asked.seed, 0.0),
            kills(
                with_meshes,
                asked.count - asked.slow,
                Path(place) / "meshes",
                tally,
                asked.seed + 1,
                0.8,
            ),
        )
    hit = ", ".join(
        f"{stage} {tally.stages[stage]}" for stage in (*STAGES, "end") if tally.stages[stage]
    )
    counts.keep(
        "SIGKILL over tipdamp run",
        kills=tally.kills,
        while_it_ran=hit,
        not_resumed=tally.not_resumed,
        finished_stages_or_curves_made_again=tally.repeated,
        largest_difference=worst,
        most_lost_of_a_running_curve_s=round(max(tally.lost), 1),
    )
    assert tally.repeated == 0 and worst <= 1e-12 and max(tally.lost) <= 10.0


if __name__ == "__main__":
    main()
