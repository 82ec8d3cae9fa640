"""A beam of contact_beam.py in pyHarm-os, for speed.py: run by the Python of a venv of its own,
prints JSON.

    python peer_pyharm.py model.npz H force samples

pyHarm leaves a folder .pyHarm where it runs and in the home folder: speed.py runs it in a temporary
one.
"""

import contextlib
import copy
import json
import os
import sys
import time
from importlib import metadata

import numpy as np


def dof_of(row):
    """The one dof that a row takes; a row that takes another combination has no counterpart in this
    model."""
    taken = np.flatnonzero(row)
    if len(taken) != 1 or row[taken[0]] != 1.0:
        raise SystemExit(f"a row takes the dofs {taken.tolist()}: it must take one, with factor 1")
    return int(taken[0])


def main():
    path = sys.argv[1]
    H = int(sys.argv[2])
    force = float(sys.argv[3])
    samples = int(sys.argv[4])
    d = np.load(path)
    from pyHarm.Maestro import Maestro

    connectors = {
        "force": {
            "type": "CosinusForcing",
            "connect": {"beam": [dof_of(d["fdir"])]},
            "dirs": [0],
            "amp": force,
        }
    }
    contacts = [dof_of(row) for row in d["Q"]]
    if len(set(contacts)) != len(contacts):
        raise SystemExit("contacts share a dof")
    for i, dof in enumerate(contacts):
        connectors[f"contact{i}"] = {
            "type": "Jenkins",
            "connect": {"beam": [dof]},
            "dirs": [0],
            "mu": float(d["mu"]),
            "N0": float(d["N0"][i]),
            "k": float(d["kt"]),
            "jac": "analytical",
        }
    step = float(os.environ.get("PYHARM_DS", "0.05"))
    scale = {"status": True, "lc": 1e-5, "wc": 2 * np.pi * 950}
    data = {
        "system": {"type": "Base", "nh": H, "nti": samples, "adim": scale},
        "substructures": {
            "beam": {"matrix": {"M": d["M"], "C": d["C"], "K": d["K"], "G": 0 * d["M"]}, "ndofs": 1}
        },
        "connectors": connectors,
        "analysis": {
            "frf": {
                "study": "frf",
                "puls_inf": 2 * np.pi * 700,
                "puls_sup": 2 * np.pi * 1200,
                "ds0": step,
                "ds_max": 10 * step,
                "ds_min": 1e-8,
                "verbose": False,
                "solver": os.environ.get("PYHARM_SOLVER", "scipyroot"),
            }
        },
    }
    with contextlib.redirect_stdout(sys.stderr):
        first = copy.deepcopy(data)
        first["analysis"]["frf"]["puls_sup"] = 2 * np.pi * 710
        Maestro(first).operate()  # compiles; the second run is timed
        maestro = Maestro(data)
        began = time.process_time()
        maestro.operate()
        seconds = time.process_time() - began
    good = [s for s in maestro.nls["frf"].SolList if s.flag_accepted]
    w = np.array([s.x[-1] for s in good]) * scale["wc"]
    dofs = maestro.system.expl_dofs
    tip = dofs[
        (dofs["sub"] == "beam") & (dofs["node_num"] == dof_of(d["out"])) & (dofs["harm"] == 1)
    ].index
    amplitude = np.array([np.hypot(*s.x[tip]) for s in good]) * scale["lc"]
    top = int(amplitude.argmax())
    print(
        json.dumps(
            {
                "version": f"pyHarm-os {metadata.version('pyHarm-os')}",
                "points": len(good),
                "seconds": seconds,
                "hz": [w[0] / 2 / np.pi, w[-1] / 2 / np.pi],
                "contacts": len(contacts),
                "dofs": len(d["M"]),
                "top_hz": w[top] / 2 / np.pi,
                "top": amplitude[top],
                "curve": [(w / 2 / np.pi).tolist(), amplitude.tolist()],
            }
        )
    )


if __name__ == "__main__":
    main()
