"""The beam B8 in pyHarm-os, for hbm_speed.py: run by the Python of a venv of its own, prints one line of JSON.

    python hbm_peer_pyharm.py model.npz H force samples
"""

import contextlib
import copy
import json
import os
import sys
import time

import numpy as np


def main():
    path, H, force, samples = sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4])
    d = np.load(path)
    from pyHarm.Maestro import Maestro

    connectors = {"force": {"type": "CosinusForcing", "connect": {"beam": [int(d["fdir"].argmax())]}, "dirs": [0],
                            "amp": force}}
    contacts = d["Q"].argmax(axis=1)
    for i, dof in enumerate(contacts):
        connectors[f"contact{i}"] = {"type": "Jenkins", "connect": {"beam": [int(dof)]}, "dirs": [0],
                                     "mu": float(d["mu"]), "N0": float(d["N0"][i]), "k": float(d["kt"]),
                                     "jac": "analytical"}
    step = float(os.environ.get("PYHARM_DS", "0.05"))
    scale = {"status": True, "lc": 1e-5, "wc": 2 * np.pi * 950}
    data = {"system": {"type": "Base", "nh": H, "nti": samples, "adim": scale},
            "substructures": {"beam": {"matrix": {"M": d["M"], "C": d["C"], "K": d["K"], "G": 0 * d["M"]}, "ndofs": 1}},
            "connectors": connectors,
            "analysis": {"frf": {"study": "frf", "puls_inf": 2 * np.pi * 700, "puls_sup": 2 * np.pi * 1200,
                                 "ds0": step, "ds_max": 10 * step, "ds_min": 1e-8, "verbose": False,
                                 "solver": os.environ.get("PYHARM_SOLVER", "scipyroot")}}}
    with contextlib.redirect_stdout(sys.stderr):
        Maestro(copy.deepcopy(data)).operate()            # compiles; the second run is timed
        maestro = Maestro(data)
        began = time.process_time()
        maestro.operate()
        seconds = time.process_time() - began
    found = maestro.nls["frf"].SolList
    good = [s for s in found if s.flag_accepted]
    w = np.array([s.x[-1] for s in good]) * 2 * np.pi * 950
    print(json.dumps({"points": len(good), "seconds": seconds, "hz": [w[0] / 2 / np.pi, w[-1] / 2 / np.pi]}))


if __name__ == "__main__":
    main()
