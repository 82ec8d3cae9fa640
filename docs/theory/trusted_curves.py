"""Draws the pictures of docs/theory/trusted_curves.md into docs/images.

    python docs/theory/trusted_curves.py [FOLDER]

The systems are those of the tests; it takes about a minute."""

import sys
from pathlib import Path

import numpy as np

from tests.hbm.cases import rig
from tests.hbm.search.test_branches import STOPPED
from tests.hbm.search.test_curves_beside import ABSORBER, HZ
from tests.pictures import write_pictures
from tests.validation.trusted_curves import cases, errors
from tipdamp import Search, branch_from, curves_beside, follow_band

MARKERS = {
    "fold": "o",
    "symmetry breaking": "D",
    "branch point": "*",
    "period doubling": "s",
    "Neimark-Sacker": "^",
    "grazing": "x",
    "onset of slip": "<",
    "lift-off": "v",
    "separation": ">",
}
IMAGES = Path(__file__).parents[1] / "images"


def draw(plot, curve, color, label):
    """Half of peak to peak over rad/s; unstable parts dashed, named points marked."""
    named = curve.named_points
    behind = [point.index + 1 for point in named]
    hz = np.insert(curve.frequency, behind, [point.frequency for point in named])
    a = np.insert(curve.amplitude()[:, 0], behind, [point.amplitudes[0] for point in named])
    lost = np.insert(curve.unstable, behind, False)
    fold = np.insert(np.zeros(len(curve.unstable), bool), behind, [p.kind == "fold" for p in named])
    lost = lost[1:] | lost[:-1] | (fold[1:] & fold[:-1])  # pieces; it changes at named points
    plot.plot([], [], color=color, lw=1.8, label=label)
    for part, style in ((~lost, {"lw": 1.8}), (lost, {"lw": 1.2, "ls": "--"})):
        for run in np.split(
            np.flatnonzero(part), np.flatnonzero(np.diff(np.flatnonzero(part)) > 1) + 1
        ):
            if len(run):
                plot.plot(
                    hz[run[0] : run[-1] + 2] / HZ, a[run[0] : run[-1] + 2], color=color, **style
                )
    for point in named:
        where = point.frequency / HZ, point.amplitudes[0]
        plot.plot(*where, MARKERS[point.kind], color="k", mfc="w", ms=6, zorder=3)
    return {point.kind for point in named}


def legend(plot, kinds, **where):
    """The curves, then the kinds of the named points."""
    for kind in (kind for kind in MARKERS if kind in kinds):
        plot.plot([], [], MARKERS[kind], color="k", mfc="w", lw=0, label=kind)
    plot.plot([], [], "--", color="0.4", lw=1.2, label="unstable")
    plot.legend(frameon=False, fontsize=9, **where)
    plot.set_xlabel("excitation frequency, rad/s")


def estimate(plt, file):
    """Estimated error of points beside their true one."""
    figure, plot = plt.subplots(figsize=(5.6, 5), layout="constrained")
    span = np.array([1e-7, 1.0])
    plot.fill_between(span, span / 5, span * 5, color="0.92", label="factor 5")
    plot.plot(span, span, color="0.6", lw=1)
    for marker, (name, case) in zip("ov^sDP", cases().items(), strict=True):
        found = np.concatenate([errors(case, H, 30) for H in (1, 3, 5, 9)])
        plot.plot(found[:, 1], found[:, 0], marker, ms=4, alpha=0.6, mew=0, label=name)
    plot.axvline(1e-5, color="0.6", lw=0.8, ls=":")
    plot.set(xscale="log", yscale="log", xlim=span, ylim=span, aspect="equal")
    plot.set_xlabel("true error of the vibration")
    plot.set_ylabel("its estimate")
    plot.legend(frameon=False, fontsize=9, loc="upper left")
    figure.savefig(file, dpi=110)


def absorber(plt, file):
    """A nonlinear absorber's curve and the detached one beside it."""
    figure, plot = plt.subplots(figsize=(7, 4), layout="constrained")
    given = {"outputs": {"x": 0}, "harmonics": 5, "stability": "all"}
    given["at"] = np.arange(0.61, 1.595, 0.01) * HZ
    curve = ABSORBER.follow_band((0.6 * HZ, 1.6 * HZ), **given)
    kinds = draw(plot, curve, "tab:blue", "from the end of the band")
    beside = curves_beside(curve, ABSORBER.contact_problem, Search(frequencies=3, starts=4))
    for found in beside.curves:
        guess = found.frequency[0], found.unknowns[0]  # once more, with its multipliers
        detached = ABSORBER.follow_band((0.6 * HZ, 1.6 * HZ), guess=guess, **given)
        kinds |= draw(plot, detached, "tab:red", "detached, found beside it")
    plot.set(yscale="log", ylabel="amplitude of the mass, m")
    legend(plot, kinds, loc="upper right")
    figure.savefig(file, dpi=110)


def stop(plt, file):
    """A mass at a stiff stop, with the motion of twice the period."""
    figure, plot = plt.subplots(figsize=(7, 4), layout="constrained")
    given = {"outputs": {"x": 0}, "stability": "all"}
    curve = STOPPED.follow_band((1.3 * HZ, 6 * HZ), harmonics=25, **given)
    kinds = draw(plot, curve, "tab:blue", "period of the excitation")
    first = next(point for point in curve.named_points if point.kind == "period doubling")
    (found,) = branch_from(curve, STOPPED.contact_problem, first)
    i = len(found.frequency) // 2
    given |= {"harmonics": found.H, "guess": (found.frequency[i], found.unknowns[i])}
    twice = STOPPED.follow_band((1.0005 * first.frequency, 6 * HZ), periods=2, **given)
    kinds |= draw(plot, twice, "tab:red", "twice the period")
    plot.set(yscale="log", ylabel="amplitude, m")
    legend(plot, kinds, loc="upper right")
    figure.savefig(file, dpi=110)


def blades(plt, file):
    """The two-blade rig under 20 N, with the band of its estimated error."""
    figure, plot = plt.subplots(figsize=(7, 4), layout="constrained")
    problem, force, outputs = rig()
    for H, color in ((1, "tab:red"), (5, "tab:blue"), (15, "k")):
        given = {"harmonics": H, "outputs": outputs, "at": np.arange(2700.0, 2900.0, 4.0)}
        curve = follow_band(problem, 20 * force, (2700.0, 2900.0), **given)
        hz, a = curve.frequency, 1e6 * curve.amplitude("rms")[:, 0]
        if H == 15:
            plot.plot(hz, a, ":", color=color, lw=1.2, label=f"H = {H}")
            continue
        off = 1e6 * curve.truncation[:, 0]
        plot.fill_between(hz, a - off, a + off, color=color, alpha=0.25, lw=0)
        plot.plot(hz, a, color=color, lw=1.2, label=f"H = {H}, with its error")
    plot.set(xlabel="frequency, Hz", ylabel="rms of a contact node's motion, µm")
    plot.legend(frameon=False)
    figure.savefig(file, dpi=110)


PICTURES = {
    "estimate_and_truth": estimate,
    "detached_curve": absorber,
    "stiff_stop": stop,
    "rig_error_band": blades,
}


def main(folder=IMAGES, names=tuple(PICTURES)):
    """Write the pictures of these names."""
    write_pictures(PICTURES, folder, names)


if __name__ == "__main__":
    main(*sys.argv[1:2])
