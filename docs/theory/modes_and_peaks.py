"""Draws the pictures of docs/theory/nonlinear_modes.md and following.md into docs/images.

    python docs/theory/modes_and_peaks.py [FOLDER]

The systems are those of the tests; it takes some minutes."""

import sys
from pathlib import Path

import numpy as np

from tests.hbm.cases import duffing
from tests.hbm.following.test_follow import rig_alone
from tests.hbm.modes.test_synthesis import tip_of
from tipdamp import Jenkins1D, backbone, follow_band, peak_derivatives

IMAGES = Path(__file__).parents[1] / "images"


def over_curves(plot, case, amplitudes, levels, band, scale=1.0):
    """A backbone over the forced curves of some levels; scale : of the drawn amplitudes."""
    problem, force, outputs = case
    colors = ["#3b0f70", "#16508f", "#159a8a", "#7ab83a", "#f2ae00"]
    for level, color in zip(levels, colors, strict=False):
        given = dict(outputs=outputs, harmonics=3, truncation=False)
        curve = follow_band(problem, level * force, band, **given)
        a = scale * curve.amplitude()[:, 0]
        plot.plot(curve.frequency, a, color=color, lw=1.4, label=f"{level:g} N")
    mode = backbone(problem, 1, amplitudes, outputs=outputs, harmonics=3)
    a = scale * mode.largest()
    plot.plot(mode.frequency, a, "k-.", lw=1.8, label="backbone")
    plot.set_xlabel("frequency, Hz")
    plot.legend(frameon=False, fontsize=8)


def backbones(plt, file):
    """Duffing's oscillator, a cantilever with friction at its tip, the two-blade rig."""
    figure, plots = plt.subplots(1, 3, figsize=(11, 3.8), layout="constrained")
    oscillator = duffing(0.05), np.ones(1), {"x": [1.0]}
    over_curves(plots[0], oscillator, (0.01, 2.0), (0.02, 0.04, 0.08), (0.1, 0.35))
    beam = tip_of(Jenkins1D(), kt=2.0, mu=1.0, preload=0.1)
    over_curves(plots[1], beam, (1e-4, 1.0), (1e-3, 1e-2, 0.05, 0.1, 0.15), (0.9, 1.4))
    problem, force, given = rig_alone()
    rig = problem, force / 20, given["outputs"]
    over_curves(plots[2], rig, (1e-7, 8e-5), (5, 10, 20, 30), (1440, 1600), 1e6)
    plots[0].set(title="Duffing", ylabel="amplitude, m", ylim=(0, 2))
    plots[1].set(title="beam with friction", ylabel="amplitude, m", yscale="log")
    plots[2].set(title="two-blade rig", ylabel="amplitude, µm")
    figure.savefig(file, dpi=110)


def tornado(plt, file):
    """The peak of the rig under 20 N by its settings, and by the friction of each pair."""
    figure, plots = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
    problem, force, given = rig_alone()
    band, (name,) = given.pop("band"), given["outputs"]
    curve = follow_band(problem, force, band, truncation=False, **given)
    by = peak_derivatives(curve, problem, name)
    by.plot(ax=plots[0])
    by.plot("mu", ax=plots[1])
    plots[1].tick_params(axis="y", labelsize=7)
    figure.savefig(file, dpi=110)


PICTURES = {"backbones": backbones, "rig_tornado": tornado}


def main(folder=IMAGES, names=tuple(PICTURES)):
    """Write the pictures of these names."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    for name in names:
        PICTURES[name](plt, Path(folder) / f"{name}.png")
        plt.close("all")


if __name__ == "__main__":
    main(*sys.argv[1:2])
