"""Draws the pictures of docs/theory/nonlinear_modes.md and following.md into docs/images.

    python docs/theory/modes_and_peaks.py [FOLDER]

The systems are those of the tests; it takes some minutes."""

import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

from tests.hbm.cases import duffing
from tests.hbm.following.test_follow import rig_alone
from tests.hbm.modes.test_synthesis import tip_of
from tests.hbm.small_rig import small_rig
from tests.pictures import write_pictures
from tests.validation.three_dampers import FOLDER, PULL, prepared
from tipdamp import (
    Doubt,
    DryFriction2T,
    Hold,
    Jenkins1D,
    backbone,
    contact_problem,
    follow_band,
    follow_peak,
    peak_derivatives,
)
from tipdamp.stages.assembly import assembled

TICKS = (0.1, 0.2, 0.5, 1, 2, 4)
COLORS = ["#3b0f70", "#16508f", "#159a8a", "#7ab83a", "#f2ae00"]
IMAGES, RIG_60MM = Path(__file__).parents[1] / "images", FOLDER / "rig_60mm"


def over_curves(plot, case, amplitudes, levels, band, scale=1.0):
    """A backbone over the forced curves of some levels; scale : of the drawn amplitudes."""
    problem, force, outputs = case
    for level, color in zip(levels, COLORS, strict=False):
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


ENDS = {"no periodic state": "drifts", "kink": "kink", "": "lost"}  # by what is said of it


def peaks_over_pull(plt, file):
    """Of the two-blade rig with its damper free along its axis, and of the small rig with a damper
    held in the mean, over the peak that is stuck; ends by name, bars where another peak was taken
    up."""
    figure, plot = plt.subplots(figsize=(7, 4), layout="constrained")
    problem, force, given = rig_alone(harmonics=1)
    cases = {"two-blade rig, free": (problem, force, given, (2.0, 0.2))}
    for mu in (1.0, 0.5):
        problem, tip = small(mu)
        given = dict(outputs={"tip": tip}, band=(240, 395), harmonics=1)
        cases[f"small rig, held, {mu:g} mu"] = problem, 20 * tip, given, (4.0, 0.14)
    for (name, (*case, given, pulls)), color in zip(cases.items(), COLORS[::2], strict=True):
        peaks = follow_peak(*case, "pull", pulls, **given)
        height = peaks.height / peaks.height[0]
        plot.plot(peaks.parameter, height, color=color, lw=1.8, label=name)
        plot.plot(peaks.parameter[peaks.jumps], height[peaks.jumps], "|", color=color, ms=12)
        if not peaks.complete:
            end = next(said for words, said in ENDS.items() if words in peaks.ended)
            at = peaks.parameter[-1], height[-1]
            plot.plot(*at, "o", color=color, mfc="w")
            plot.annotate(end, at, (-38, -3), color=color, textcoords="offset points", fontsize=9)
    plot.set(xscale="log", xticks=TICKS, xticklabels=map(str, TICKS))
    plot.set(xlabel="pull, times that of the rig", ylabel="peak over that of the stuck damper")
    plot.legend(frameon=False)
    figure.savefig(file, dpi=110)


def small(mu):
    """(problem, excitation of 1 N) of the small rig with a held damper, mu times its friction."""
    model, pairs, tip = small_rig(stations=3)
    hold = Hold("y", mean=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Doubt)
        rough, given = pairs.replace(mu=mu * pairs.mu), dict(damping_ratio=0.01, hold=hold)
        return contact_problem(model, rough, DryFriction2T(), **given)[0], tip


DAMPERS = ("asymmetric", "cylindrical", "wedge")
FORCE = 20.0  # N, at the pull of 113 N: Fc/Fe = 5.65
UP_AND_DOWN = (20.0, 0.2)  # times that pull: Fc/Fe = 113, where all stick, and 1.13
BAND = (1750, 3300)  # Hz: out of phase


def followed(study, pulls, size=1.0, **given):
    """[peaks over the pull from that of a study to each of these values] of the node of blade 1
    that moves most, under 20 N; size : of the meshes, as in `prepared`."""
    with tempfile.TemporaryDirectory() as folder:
        made = assembled(*prepared(study, folder, (PULL / FORCE,), size)).curves
    rows = {name: row for name, row in made.rows.items() if name.startswith("patch_1")}
    case, given = (made.problem, FORCE * made.force), dict(band=BAND, harmonics=3) | given
    curve = follow_band(*case, outputs=rows, truncation=False, **given)
    largest = curve.output_names[np.nanargmax(np.nanmax(curve.amplitude(), axis=0))]
    given["outputs"] = {largest: rows[largest]}
    return [follow_peak(*case, "pull", (1.0, pull), **given) for pull in pulls]


NAMED = {  # by what is said of it
    "leaves the band": "leaves the band",
    "rolls": "rolls",
    "slides": "slides",
    "no periodic state": "no periodic state",
    "": "lost",
}


def dampers_over_pull(plt, file):
    """Of the three dampers on the rig of 60 mm, out of phase, from the pull of 113 N up to stuck
    and down; dots where places are fitted, bars where another peak was taken up."""
    figure, plot = plt.subplots(figsize=(7, 4.2), layout="constrained")
    for damper, color in zip(DAMPERS, COLORS[::2], strict=True):
        draw_ways(plot, damper, color, followed(RIG_60MM / f"{damper}.toml", UP_AND_DOWN))
    finish(plot)
    figure.savefig(file, dpi=110)


def draw_ways(plot, damper, color, ways):
    """The peaks of one damper, and how each way ends."""
    for k, peaks in enumerate(ways):
        ratio, height = PULL / FORCE * peaks.parameter, 1e6 * peaks.height / FORCE
        plot.plot(ratio, height, color=color, lw=1.6, label=damper if k == 0 else None)
        for places, mark in ((peaks.fitted, "."), (peaks.jumps, "|")):
            plot.plot(ratio[places], height[places], mark, color=color, ms=4 if mark == "." else 12)
        if not peaks.complete:
            end = next(said for words, said in NAMED.items() if words in peaks.ended)
            plot.plot(ratio[-1], height[-1], "o", color=color, mfc="w")
            at = dict(textcoords="offset points", color=color, fontsize=9)
            plot.annotate(end, (ratio[-1], height[-1]), (-4, -16), **at)


def finish(plot):
    """Axes of Fc/Fe and of the response per newton."""
    plot.set(xscale="log", yscale="log", xlabel="Fc/Fe", ylabel="peak of a node of blade 1, µm/N")
    plot.set(xticks=RATIOS, xticklabels=map(str, RATIOS), yticks=HEIGHTS)
    plot.set(yticklabels=map(str, HEIGHTS))
    plot.minorticks_off()
    plot.legend(frameon=False)


RATIOS = (1, 2, 5, 10, 20, 50, 100)
HEIGHTS = (0.2, 0.3, 0.5, 0.7, 1)

PICTURES = {
    "backbones": backbones,
    "rig_tornado": tornado,
    "peaks_over_pull": peaks_over_pull,
    "dampers_over_pull": dampers_over_pull,
}


def main(folder=IMAGES, names=tuple(PICTURES)):
    """Write the pictures of these names."""
    write_pictures(PICTURES, folder, names)


if __name__ == "__main__":
    main(*sys.argv[1:2])
