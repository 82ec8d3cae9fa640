"""Cost of followed peaks and of derivatives on the two-blade rig's tuned 18 pairs, H = 3, one
thread.

    python -m tests.benchmarks.following

CPU time of a place of a followed peak (asked: 25 ms), without the whole curves at both ends, and
of the derivatives of a peak by 18 pairs x 4 settings (asked: three curves), each beside that of a
point of the curve. The figures go to build/benchmarks/following.json.
"""

import time
from unittest import mock

from tests.benchmarks.record import one_thread, record
from tests.hbm.following.test_follow import ON_THE_RIG, rig_alone
from tipdamp import follow_band, follow_peak, peak_derivatives
from tipdamp.hbm.following.case import Case


def timed(function, *given, **more):
    """(CPU seconds, result)."""
    began = time.process_time()
    found = function(*given, **more)
    return time.process_time() - began, found


def followed(parameter, between):
    """(CPU ms a place, places, whether the last value is reached)."""
    problem, force, given = rig_alone()
    curves, whole = [], Case.curve

    def curve(*given, **more):
        seconds, found = timed(whole, *given, **more)
        curves.append(seconds)
        return found

    with mock.patch.object(Case, "curve", curve):
        seconds, peaks = timed(follow_peak, problem, force, parameter, between, **given)
    return 1e3 * (seconds - sum(curves)) / len(peaks), len(peaks), peaks.complete


def main():
    one_thread()
    problem, force, given = rig_alone()
    band, (name,) = given.pop("band"), given["outputs"]
    for _ in range(2):  # the first loads kernels
        seconds, curve = timed(follow_band, problem, force, band, truncation=False, **given)
    point = 1e3 * seconds / len(curve)
    by = min(timed(peak_derivatives, curve, problem, name)[0] for _ in range(3))
    rows = []
    for parameter, between in ON_THE_RIG:
        ms, places, complete = followed(parameter, between)
        rows.append({"parameter": parameter, "ms": ms, "places": places, "complete": complete})
        rows[-1]["points"] = ms / point
        print(f"{rows[-1]}; asked 25 ms", flush=True)
    print(f"derivatives: {by / seconds:.2f} curves, {1e3 * by / point:.0f} points; asked 3 curves")
    figures = {"point_ms": point, "points": len(curve), "curve_s": seconds, "derivatives_s": by}
    record("following", figures | {"rows": rows})


if __name__ == "__main__":
    main()
