"""Stages inspect and reduce: what is in the meshes or matrices; the reduced model, its free modes and response."""

import numpy as np

from hbm.balance.receptance import linear_response
from hbm.model import ReducedModel
from tipdamp import bodies
from tipdamp.bodies import BLADES
from tipdamp.free_modes import FreeModes, band, band_warnings, lowest_modes, named_modes
from tipdamp.stages import inspection
from tipdamp.stages.model_inputs import excitation, group, outputs, ratio


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
    if "respond" in study:
        free = free_modes(study, blades)
        limits = band(study["free"]["band"], free)
        found = {"free_hz": free.named, "free_modes_hz": free.hz, "free_response": free_response(study, blades, limits),
                 "warnings": [*free.warnings, *band_warnings(limits, free)]}
    else:
        found = {"free_hz": {}, "free_modes_hz": lowest_modes(blades)[0][:10], "free_response": None, "warnings": []}
    with store.writing("model.npz") as path:
        model.save(path)
    with store.writing("pairs.csv") as path:
        pairs.save(path)
    store.write_json("reduce.json", {**facts, **found})
    more = [*facts.get("pictures", ())]
    if truncation is not None:
        with store.writing("truncation.npz") as path:
            truncation.save(path)
        more.append("truncation.npz")
    return more


def free_modes(study, blades: ReducedModel) -> FreeModes:
    """Free modes of the blades by the motion of the two patches along the force."""
    direction = study["respond"]["direction"]
    rows = (np.mean([blades.displacement_row(BLADES, n, direction) for n in group(blades, study, p)], axis=0)
            for p in study["respond"]["patches"])
    return named_modes(blades, *rows)


def free_response(study, blades: ReducedModel, limits) -> dict:
    """Linear response without damper, per newton: largest over each patch.          [Zucca 2016, figure 2]"""
    hz = np.linspace(*limits, 801)
    rows = outputs(study, blades)
    x = np.abs(linear_response(blades, None, excitation(study, blades), hz,
                               ratio(study["free"]["damping_ratio"]), rows))
    names = np.array([name.rpartition(":")[0] for name in rows])
    return {"hz": hz, "m_per_N": {p: x[:, names == p].max(axis=1) for p in study["respond"]["patches"]}}
