"""Stages inspect and reduce: what is in the meshes or matrices; the reduced model, its free modes and response."""

import numpy as np
from scipy.linalg import eigh

from hbm.linear import linear_response
from hbm.model import ReducedModel
from tipdamp import bodies, inspection
from tipdamp.bodies import BLADES
from tipdamp.jobs.terms import excitation, group, outputs, ratio


def inspect(study, store, tick):
    """What is in the meshes (or matrices), before anything is computed with it."""
    meshes = "model" not in study
    content = inspection.describe_meshes(study, store, tick) if meshes else inspection.describe_model(study, store)
    store.write_json("inspect.json", content)
    return content.get("pictures", [])


def reduce(study, store, tick):
    """Meshes to a reduced model and the contact pairs of the whole patch; free modes and linear response."""
    if "model" in study:
        model, pairs, facts = bodies.given_model(study)
        truncation = None
    else:
        model, pairs, facts, truncation = bodies.reduced_model(study, store, tick)
    blades = model.part(BLADES)
    known = "respond" in study
    free = free_modes(study, blades) if known else {"hz": lowest_modes(blades)[0][:10]}
    with store.writing("model.npz") as path:
        model.save(path)
    with store.writing("pairs.csv") as path:
        pairs.save(path)
    store.write_json("reduce.json", {
        **facts, "free_hz": {k: free[k][0] for k in ("out_of_phase", "in_phase") if k in free},
        "free_modes_hz": free["hz"], "free_response": free_response(study, blades) if known else None})
    more = [*facts.get("pictures", ())]
    if truncation is not None:
        with store.writing("truncation.npz") as path:
            truncation.save(path)
        more.append("truncation.npz")
    return more


def lowest_modes(model: ReducedModel, count: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Hz (m,) and mass-normalised shapes (r, m)."""
    lam, shapes = eigh(model.K, model.M, subset_by_index=(0, min(count, model.size) - 1))
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi), shapes


def free_modes(study, blades: ReducedModel) -> dict:
    """Free modes of the blades: {"out_of_phase": (Hz, shape), "in_phase": (Hz, shape), "hz": lowest ten}.

    The mode that contributes most to the static compliance of the difference (sum) of the two patches' mean motion
    is the out-of-phase (in-phase) one: found by shape, whatever its number.
    """
    hz, shapes = lowest_modes(blades)
    direction = study["respond"]["direction"]
    patches = study["respond"]["patches"]
    one, two = (np.mean([blades.displacement_row(BLADES, n, direction) for n in group(blades, study, p)], axis=0)
                @ shapes for p in patches)
    found = {"hz": hz[:10]}
    for name, motion in (("out_of_phase", one - two), ("in_phase", one + two)):
        best = int((motion**2 / hz**2).argmax())
        found[name] = (float(hz[best]), shapes[:, best])
    return found


def free_response(study, blades: ReducedModel) -> dict:
    """Linear response without damper, per newton: largest over each patch.          [Zucca 2016, figure 2]"""
    hz = np.linspace(*study["free"]["band"], 801)
    rows = outputs(study, blades)
    x = np.abs(linear_response(blades, None, excitation(study, blades), hz,
                               ratio(study["free"]["damping_ratio"]), rows))
    names = np.array([name.rpartition(":")[0] for name in rows])
    return {"hz": hz, "m_per_N": {p: x[:, names == p].max(axis=1) for p in study["respond"]["patches"]}}
