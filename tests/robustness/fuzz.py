"""Mutated study files and meshes, seeded: read, or refused in one line; no traceback, no hang, no
wrong run.

    python -m tests.robustness.fuzz [--studies 2000] [--meshes 500] [--seed 1]

A study is changed in its text, by letters or by whole values, and runs as far as the preload with
matrices and as far as the pairs with meshes. What is accepted leaves finite results in which the
forces balance the pull.
"""

import argparse
import json
import math
import signal
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from tests.modal.blocks import block
from tests.robustness import counts
from tests.robustness.meshes import WRITTEN
from tests.robustness.rows import chain, corner, tipdamp
from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.rig_study import CHAIN
from tipdamp.hbm.errors import InputError
from tipdamp.readers.dispatch import read_mesh

HANG = 10  # s
VALUES = (
    "0",
    "-1",
    "1e300",
    "1e-300",
    "nan",
    "inf",
    "true",
    '"x"',
    "[]",
    "[1]",
    "[[1, 2], [3, 4]]",
    "{}",
    "1.5",
    "-0.0",
    "10000000000000000000000",
    "[0, 0, 0]",
    '["a", "b"]',
    '"\\u0000"',
    '""',
    "0,5",
    "2026-01-01",
    '"../x"',
    "1e-12",
    '"=1+1"',
    "[1e999, 0]",
    "99",
    "[1, 2, 3]",
)
LETTERS = list("0123456789.,=[]{}\"'#-+eE_\n\\ \tabxyz\u00e4\u2028\x00\x1b")


class Hang(Exception):
    """A command took too long."""


@contextmanager
def within(seconds: int):
    """Hang where the block takes longer."""

    def late(*_):
        raise Hang

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def mutated(text: str, rng: np.random.Generator) -> str:
    """The text of a study with one to three changes."""
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        lines = text.splitlines()
        i = int(rng.integers(len(lines)))
        kind = rng.choice(6, p=(0.4, 0.05, 0.1, 0.35, 0.05, 0.05))
        if kind == 0 and "=" in lines[i]:  # another value
            lines[i] = lines[i].split("=")[0] + "= " + VALUES[rng.integers(len(VALUES))]
        elif kind == 1:  # a line twice, or elsewhere
            lines.insert(int(rng.integers(len(lines))), lines[i])
        elif kind == 2:
            del lines[i]
        elif kind == 3 and any(map(str.isdigit, lines[i])):  # another digit
            at = [k for k, c in enumerate(lines[i]) if c.isdigit()]
            k = at[rng.integers(len(at))]
            lines[i] = lines[i][:k] + str(rng.integers(10)) + lines[i][k + 1 :]
        else:  # letters
            k = int(rng.integers(len(lines[i]) + 1))
            lines[i] = (
                lines[i][:k]
                + LETTERS[rng.integers(len(LETTERS))]
                + lines[i][k + int(rng.integers(2)) :]
            )
        text = "\n".join(lines) + "\n"
    return text


def outcome(study: Path, verbs) -> str:
    """'refused', 'not solved' or 'ran'; AssertionError for anything that must not be."""
    for verb in verbs:
        with within(HANG):
            said = tipdamp(verb, study, "--quiet")
        assert "Traceback" not in said.err and said.code in (0, 2, 3, 4), said
        if said.code:
            last = [line for line in said.err.splitlines() if line.startswith("tipdamp: ")]
            assert len(last) == 1 and last[0].isprintable() and len(last[0]) < 4200, said
            return {2: "refused", 3: "not solved", 4: "refused"}[said.code]
    results = list(study.parent.glob("results/*/*.json"))
    for path in results:
        json.loads(path.read_bytes(), parse_constant=_no_constant)
    for path in study.parent.glob("results/*/preload.json"):
        _balanced(json.loads(path.read_bytes()))
    return "ran"


def _no_constant(name):
    raise AssertionError(f"{name} in a result")


def _balanced(found):
    for side in found["sides"].values():
        assert math.isfinite(side["sum_N"]), found
        off = abs(side["sum_N"] - side["equilibrium_N"])
        assert off <= 1e-6 * abs(side["equilibrium_N"]) + 1e-9 or found.get("warnings"), found


def studies(count: int, seed: int, place: Path) -> dict[str, int]:
    """{outcome: how many} of mutated studies, by turns with matrices and with meshes."""
    found = {"refused": 0, "not solved": 0, "ran": 0}
    for i in range(count):
        rng, folder = np.random.default_rng([seed, i]), place / f"s{i}"
        folder.mkdir()
        if i % 2:
            study, text, verbs = chain(folder), CHAIN, ("inspect", "reduce", "preload")
        else:
            study, text, verbs = corner(folder), corner_study.TEXT, ("inspect",)
        study.write_text(mutated(text, rng), encoding="utf-8", errors="surrogatepass")
        try:
            found[outcome(study, verbs)] += 1
        except (Exception, Hang) as error:
            raise AssertionError(
                f"study {i} of seed {seed}: {type(error).__name__}: {error}\n"
                f"{study.read_text(errors='replace')}"
            ) from error
    return found


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """A file with bytes changed, lost, added, doubled or cut."""
    data = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 5])):
        at, kind = int(rng.integers(len(data))), int(rng.integers(5))
        if kind == 0:
            data[at] = int(rng.integers(256))
        elif kind == 1:
            del data[at : at + int(rng.integers(1, 60))]
        elif kind == 2:
            data[at:at] = bytes(
                rng.choice(list(b"0123456789,-*$.\n eE+"), size=int(rng.integers(1, 12))).tolist()
            )
        elif kind == 3:
            data[at:at] = data[at : at + int(rng.integers(1, 200))]
        elif rng.random() < 0.2:
            del data[at:]
        data = data or bytearray(b"x")
    return bytes(data)


def read(path: Path) -> str:
    """'refused' or 'ran' of a mesh alone, where the writers of the tests know no groups of a
    study."""
    try:
        with within(HANG):
            mesh = read_mesh(path)
    except InputError as error:
        assert str(error).isprintable(), error
        return "refused"
    assert np.isfinite(mesh.position).all() and all(
        cells.max() < len(mesh.node) for cells in mesh.cells.values()
    )
    return "ran"


def meshes(count: int, seed: int, place: Path) -> dict[str, int]:
    """{outcome: how many} of damaged meshes of the four readers, through `inspect`; groups as the
    study wants them."""
    found = {"refused": 0, "not solved": 0, "ran": 0}
    ends = list(WRITTEN)
    whole = {
        end: write(
            block("hexahedron20", (2, 1, 1)) if end in (".cdb", ".bdf") else corner_study.damper()
        ).encode()
        for end, write in {**WRITTEN, ".inp": mesh_texts.plain}.items()
    }
    for i in range(count):
        rng, folder = np.random.default_rng([seed, i]), place / f"m{i}"
        folder.mkdir()
        end = ends[i % 4]
        study = corner(folder, ('"damper.inp"', f'"damaged{end}"'))
        (folder / f"damaged{end}").write_bytes(damaged(whole[end], rng))
        try:
            found[
                outcome(study, ("inspect",))
                if end in (".msh", ".inp")
                else read(folder / f"damaged{end}")
            ] += 1
        except (Exception, Hang) as error:
            raise AssertionError(
                f"mesh {i} of seed {seed} ({end}): {type(error).__name__}: {error}"
            ) from error
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--studies", type=int, default=2000)
    parser.add_argument("--meshes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        if asked.studies:
            counts.keep(
                "mutated study files",
                seed=asked.seed,
                files=asked.studies,
                **studies(asked.studies, asked.seed, Path(place)),
                tracebacks=0,
                hangs=0,
            )
        if asked.meshes:
            counts.keep(
                "mutated meshes",
                seed=asked.seed,
                files=asked.meshes,
                **meshes(asked.meshes, asked.seed, Path(place)),
                tracebacks=0,
                hangs=0,
            )


if __name__ == "__main__":
    main()
