"""Response of 500 pairs, 16 of which slip, by interface reduction, beside the 18 pairs of the rig.
One thread.

    python -m tests.benchmarks.interface [--pairs 500] [--repeats 3]

A blade and a free damper that meet at n nodes each (`hundreds`), 6n dofs, and the rig at 20 N, both
at H = 5, in turn. The cost of the 500 pairs is all between the ReducedModel and the curve: the
reduction and the first curve; each further curve is measured too, and the curve on all dofs once,
with which the peak is compared. The figures go to build/benchmarks/interface.json.
"""

import argparse
import time

import numpy as np

from tests.benchmarks import hundreds
from tests.benchmarks.record import one_thread, record
from tests.hbm.cases import rig
from tipdamp.hbm.interface import Excitation, reduce_interface
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band, forced_response

H = 5
LEVEL = 5.0
RIG_LEVEL = 20.0
RIG_BAND = (2300, 3300)
ZETA = 0.01
SLIP = 16


def timed(work):
    """(CPU seconds, what it gave)"""
    began = time.process_time()
    found = work()
    return time.process_time() - began, found


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--pairs", type=int, default=500)
    parser.add_argument("--repeats", type=int, default=3)
    asked, hundreds.SLIP = parser.parse_args(), SLIP
    arrays, pairs, push = hundreds.face_to_face(asked.pairs)
    model, law, (problem, force, outputs) = (
        ReducedModel.from_matrices(**arrays),
        DryFriction2T(),
        rig(),
    )

    def curve(one, V):
        return forced_response(
            one,
            pairs,
            law,
            V.T @ (LEVEL * push),
            hundreds.FACES_BAND,
            damping_ratio=ZETA,
            outputs={"blade": V.T @ push},
            harmonics=H,
        )

    def reduction():
        return reduce_interface(
            model, pairs, law, Excitation([LEVEL * push], hundreds.FACES_BAND, H)
        )

    def of_rig(harmonics=H):
        return follow_band(
            problem, RIG_LEVEL * force, RIG_BAND, harmonics=harmonics, outputs=outputs
        )

    of_rig(1)  # the kernels are loaded before the clock runs
    seconds = []
    for _ in range(asked.repeats):
        (
            (own, _),
            (set_up, found),
        ) = timed(of_rig), timed(reduction)
        first, made = timed(lambda found=found: curve(found.model, found.basis))
        seconds.append((own, set_up, first))
    whole, exact = timed(lambda: curve(model, np.eye(model.size)))
    slips = (made.share_slip > 0).any(axis=0)
    own, set_up, first = np.median(seconds, axis=0)
    (hz, top), (its_hz, its_top) = exact.peak("blade"), made.peak("blade")
    row = {
        "pairs": asked.pairs,
        "dofs": model.size,
        "shapes": found.model.size,
        "slip": int(slips.sum()),
        "slipping_followed": bool(found.followed[slips].all()),
        "rig_s": own,
        "reduction_s": set_up,
        "curve_s": first,
        "all_dofs_s": whole,
        "times_the_rig": (set_up + first) / own,
        "a_further_curve_times_the_rig": first / own,
        "peak_error": its_top / top - 1,
        "peak_hz_error": its_hz / hz - 1,
        "stated_response": found.response_error,
        "stated_frequency": found.frequency_error,
    }
    print(row)
    record("interface", {"rows": [row]})


if __name__ == "__main__":
    main()
