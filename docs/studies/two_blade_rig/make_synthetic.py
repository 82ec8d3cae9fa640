"""SYNTHETIC measured curves for the study twin.toml: no rig was measured.

    python docs/studies/two_blade_rig/make_synthetic.py docs/studies/two_blade_rig/results/twin

computes the response of the reduced model of the study with another contact set than its own (6 + 4
stations, the last one half, friction 0.55, preload 4 % lower), three repeats with a scatter of
resonance and height as when the damper is taken out and put back, and noise of the accelerometer.
Writes it as accelerance into synthetic/: for 1 and 12 N, three repeats each, as universal files.
Seeded; the hidden values are the answer to "how far is the study from it"."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from tipdamp import follow_band, load_study
from tipdamp.engine.store import Store
from tipdamp.measured.agreement import drawn, values_at
from tipdamp.static_contact.tuning.roll_springs import with_springs
from tipdamp.statics.model_inputs import declared_springs, excitation, outputs, ratio

HERE = Path(__file__).parent
HIDDEN = {"mu": 0.55, "preload": 0.96, "front": 6, "back": 4, "last": 0.5}
LEVELS, REPEATS, SEED = (1.0, 12.0), 3, 2016
HZ = np.arange(2500.0, 3101.0, 2.0)
SHIFT, HEIGHT, NOISE = 2.0, 0.015, 0.004  # standard deviations: Hz, relative, of the largest value


def main(arguments: list[str] | None = None) -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(
        description="Synthetic measured curves of the study twin.toml."
    )
    parser.add_argument("results", type=Path, help="results folder of the study")
    parser.add_argument("--out", type=Path, default=HERE / "synthetic")
    given = parser.parse_args(arguments)
    study, rng = load_study(HERE / "twin.toml"), np.random.default_rng(SEED)
    given.out.mkdir(exist_ok=True)
    problem, force, row, name = _hidden(study, Store(given.results))
    for level in LEVELS:
        curve = follow_band(
            problem, level * force, (2450.0, 3150.0), harmonics=3, outputs={name: row}
        )
        path = given.out / f"SYNTHETIC_{level:g}N.unv"
        path.unlink(missing_ok=True)
        for k in range(REPEATS):
            _write(path, _measured(curve, level, rng), k + 1)
        print(f"{path}: synthetic, {REPEATS} repeats at {level:g} N", file=sys.stderr)


def _hidden(study, store):
    """Problem, force of 1 N, row and name of the patch's centre, with the hidden contact set."""
    from tipdamp import ContactTable, ReducedModel, contact_problem

    model = ReducedModel.load(store.path("model.npz"))
    line = ContactTable.load(store.path("preload.csv"))
    stations, last = line.station.max(), HIDDEN["front"] - 1
    kept = (line.station <= last) | (line.station > stations - HIDDEN["back"])
    weight = np.where(
        kept & (line.row == 0), np.where(line.station == last, HIDDEN["last"], 1.0), 0.0
    )
    hidden = line.replace(weight=weight, mu=np.full(len(line), HIDDEN["mu"]))
    scale = {
        side: line.preload[line.side == side].sum()
        / (hidden.preload * weight)[line.side == side].sum()
        for side in line.sides
    }
    hidden = hidden.replace(
        preload=HIDDEN["preload"] * hidden.preload * np.array([scale[s] for s in line.side])
    )
    model = with_springs(model, hidden, declared_springs(study, hidden))
    problem, _ = contact_problem(
        model,
        hidden.select(hidden.carrying),
        study.respond.law.make(),
        damping_ratio=ratio(study.respond.damping_ratio),
    )
    rows = outputs(study, model)
    name = next(iter(rows))
    return replace(problem), excitation(study, model), rows[name], name


def _measured(curve, level, rng):
    """(n,) accelerance of one repeat, m/s2/N: shifted, scaled, with noise."""
    parts = [
        drawn(curve.frequency, part)
        for part in (curve.harmonics[:, 0, 1].real, curve.harmonics[:, 0, 1].imag)
    ]
    shifted = HZ - rng.normal(0.0, SHIFT)
    real, imaginary = (
        np.array([found[0] for found in values_at(shifted, *path)]) for path in parts
    )
    response = (1 + rng.normal(0.0, HEIGHT)) * (real + 1j * imaginary) / level
    accelerance = -((2 * np.pi * HZ) ** 2) * response
    noise = (
        NOISE
        * np.abs(accelerance).max()
        * (rng.normal(size=len(HZ)) + 1j * rng.normal(size=len(HZ)))
    )
    return accelerance + noise


def _write(path, values, repeat):
    import pyuff

    pyuff.UFF(str(path)).write_sets(
        pyuff.prepare_58(
            binary=0,
            func_type=4,
            rsp_node=1,
            rsp_dir=1,
            ref_node=1,
            ref_dir=1,
            data=values,
            x=HZ,
            ord_data_type=6,
            id1=f"SYNTHETIC, computed with a hidden contact set, repeat {repeat}",
            id2="no rig was measured",
            rsp_ent_name="SYNTHETIC",
            ref_ent_name="SYNTHETIC",
            abscissa_spacing=1,
            abscissa_min=HZ[0],
            abscissa_inc=HZ[1] - HZ[0],
            abscissa_spec_data_type=18,
            ordinate_spec_data_type=12,
            orddenom_spec_data_type=13,
        ),
        mode="add",
    )


if __name__ == "__main__":
    main()
