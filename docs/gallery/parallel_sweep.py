"""Many dampers on all cores

Curves do not depend on each other: a pool of processes computes them side by side, and their number
does not change a digit. (A study does this with tipdamp sweep.)
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import matplotlib.pyplot as plt

from tipdamp import Jenkins1D, Problem


def peak(pull):
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.002).force(0, 5.0)
    damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=pull)
    return damped.follow_band((600, 1000), outputs={"tip": 0}, harmonics=5).peak("tip")


if __name__ in ("__main__", "<run_path>"):
    pulls = [2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0]
    with ProcessPoolExecutor(2, get_context("fork")) as pool:
        peaks = list(pool.map(peak, pulls))
    plt.loglog(pulls, [1e6 * height for _, height in peaks], "o-")
    plt.xlabel("pull (N)")
    plt.ylabel("peak (µm)")
    plt.xticks([2, 5, 10, 20, 40], ["2", "5", "10", "20", "40"])
    plt.yticks([50, 100, 200, 500], ["50", "100", "200", "500"])
    plt.minorticks_off()

    heights = [height for _, height in peaks]
    assert min(heights) not in (heights[0], heights[-1])  # an optimum between loose and stuck
    assert peaks[3] == peak(pulls[3])  # to the last bit
