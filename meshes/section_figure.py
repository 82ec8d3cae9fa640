"""Picture of the rig's cross-section: python -m tipdamp.meshes.section_figure [--damper asymmetric]
--out FILE.png"""

import argparse
from pathlib import Path

import numpy as np

from tipdamp.meshes.rig import DAMPERS, SIDES, Cells, Rig, contact
from tipdamp.meshes.sections import blades_section, damper_section

_OUTLINE = ((0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1), (0, 0))


def draw(rig: Rig, damper: str, size: float, path: str | Path, rows: int = 2) -> None:
    """Writes the picture: the whole section on the left, the damper in its V on the right; lengths
    in mm."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import LineCollection

    found, cells = contact(rig, damper, rows), Cells.of_size(size)
    figure, axes = plt.subplots(1, 2, figsize=(9, 5.5), width_ratios=(1, 1.4), layout="constrained")
    for axis in axes:
        for section, colour in ((blades_section, "tab:blue"), (damper_section, "tab:orange")):
            points, quads = section(rig, found, cells, rows)
            lines = [1e3 * points[quad[tuple(np.transpose(_OUTLINE))]] for quad in quads]
            axis.add_collection(LineCollection(lines, colors=colour, linewidths=0.6))
        for side in SIDES:
            axis.plot(*(1e3 * found.rows[side].T), "k.", ms=5)
        axis.set(aspect="equal", xlabel="x in mm", ylabel="z in mm")
        axis.autoscale()
    upper = rig.height - rig.cover_height
    for sign in (-1, 1):
        z = np.linspace(upper - rig.patch_height, upper, 9)
        axes[0].plot(1e3 * sign * (rig.pitch + rig.thickness(z)) / 2, 1e3 * z, "tab:green", lw=2.5)
        edge = np.array(
            [rig.free_span / 2, (rig.pitch + rig.root_thickness) / 2 + rig.fixture_overhang]
        )
        axes[0].plot(1e3 * sign * edge, [-1e3 * rig.fixture_height] * 2, "tab:red", lw=2.5)
    axes[0].plot(-500 * (rig.pitch + rig.tip_thickness), 1e3 * rig.height, "rv", ms=6)
    reach = 5.0
    centre = 1e3 * found.centre
    axes[1].set(
        xlim=(centre[0] - 2 * reach, centre[0] + 2 * reach),
        ylim=(centre[1] - reach, centre[1] + reach),
    )
    axes[0].set_title("green: patches, red: clamp, excitation", fontsize=9)
    axes[1].set_title(f"{damper} damper, dots: contact lines", fontsize=9)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main(arguments: list[str] | None = None) -> None:
    """Command line: the picture of the cross-section."""
    parser = argparse.ArgumentParser(prog="python -m tipdamp.meshes.section_figure")
    parser.add_argument("--damper", choices=DAMPERS, default="asymmetric")
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--out", required=True)
    given = parser.parse_args(arguments)
    draw(Rig(), given.damper, given.size, given.out)


if __name__ == "__main__":
    main()
