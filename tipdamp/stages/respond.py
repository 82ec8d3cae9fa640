"""Stage respond: forced response of the kept pairs at every level and number of harmonics."""

import warnings

import numpy as np

from hbm.balance.receptance import linear_response
from hbm.contact import ContactTable
from hbm.laws import DryFriction2T
from hbm.model import ReducedModel
from hbm.problem import contact_problem
from hbm.response import follow_band
from static_contact.roll_springs import with_springs
from tipdamp import friction
from tipdamp.stages.model_inputs import declared_springs, excitation, outputs, ratio


def respond(study, store, tick):
    """Forced response of the kept pairs at every excitation level and every number of harmonics."""
    model, table = ReducedModel.load(store.path("model.npz")), ContactTable.load(store.path("kept.csv"))
    model = with_springs(model, table, declared_springs(study, table))
    settings = study["respond"]
    kept = table.select(table.carrying)
    state = {"static": None, "start": None}
    if study["preload"]["friction"]:
        state = friction.start(model, kept, friction.load(store.path("kept_friction.csv"), table)[table.carrying])
    problem, _ = contact_problem(model, kept, DryFriction2T(), static=state["static"],
                                 damping_ratio=ratio(settings["damping_ratio"]))
    force, rows = excitation(study, model), outputs(study, model)
    cases = [(H, Fe) for H in settings["harmonics"] for Fe in settings["levels"]]
    band = settings["band"]
    ways = (band, band[::-1]) if settings["both_ways"] else (band,)
    found = []
    for i, (H, Fe) in enumerate(cases):
        curves = [follow_band(problem, Fe * force, way, harmonics=H, outputs=rows, start=state["start"],
                              progress=_progress(tick, Fe, H, way, (i + k / len(ways)) / len(cases),
                                                 1 / len(ways) / len(cases)))
                  for k, way in enumerate(ways)]
        name = f"responses/Fe_{Fe:g}N_H{H}.npz"
        with store.writing(name) as path:
            curves[0].save(path)
        found.append({"file": name, **response_figures(study, *curves, *[None] * (2 - len(ways)), kept, Fe, H)})
    low, high = band
    with store.writing("stuck.npz") as path:
        hz = np.linspace(low, high, 801)
        x = linear_response(model, kept, force, hz, ratio(settings["damping_ratio"]), rows)
        np.savez(path, frequency=hz, response=x, output_names=np.array(list(rows)))
    store.write_json("respond.json", {"responses": found, "zeta": settings["damping_ratio"],
                                      "stuck_difference": stuck_difference(study, model, kept, store, found)})
    return [case["file"] for case in found]


def _progress(tick, Fe, H, way, start, share):
    """What `follow_band` calls at each point of a curve that takes `share` of the whole work."""
    begin, end = way

    def report(hz, step, iterations):
        tick(start + share * (hz - begin) / (end - begin),
             f"Fe = {Fe:g} N, H = {H}{', downwards' if end < begin else ''}  {hz:.1f} Hz  step {step:.2g}  "
             f"{iterations} it")

    return report


def stuck_difference(study, model, kept, store, found) -> dict:
    """{file: largest |curve - linear stuck response| / largest response} of the curves on which no pair slips."""
    from hbm.result import ForcedResponse

    out = {}
    for case in found:
        if not case["slipping_pairs"]:
            curve = ForcedResponse.load(store.path(case["file"]))
            good = curve.converged
            x = linear_response(model, kept, case["Fe_N"] * excitation(study, model), curve.frequency[good],
                                ratio(study["respond"]["damping_ratio"]), outputs(study, model))
            out[case["file"]] = float(np.abs(curve.harmonics[good, :, 1] - x).max() / np.abs(x).max())
    return out


def response_figures(study, curve, back, kept, Fe, H) -> dict:
    """Peaks over the patches (the first blade's on top), half of peak-to-peak along the force; counts."""
    patches = {patch: patch_peak(curve, patch) for patch in study["respond"]["patches"]}
    first = study["respond"]["patches"][0]
    hz = patches[first]["peak_hz"]
    slipping = curve.slipping_pairs
    figures = {"Fe_N": Fe, "H": H, **patches[first], "patches": patches,
               "points": len(curve.frequency), "failed_points": int((~curve.converged).sum()),
               "slipping_pairs": [f"{kept.side[i]} {kept.station[i]}" for i in slipping],
               "seconds": curve.seconds, "residual_calls": curve.residual_calls, "complete": curve.complete,
               "ended": curve.ended, "origin": curve.origin, "start": curve.start,
               "peak_inside_band": bool(min(study["respond"]["band"]) < hz < max(study["respond"]["band"]))}
    if back is not None:
        figures["back"] = {**patch_peak(back, first), "complete": back.complete, "ended": back.ended,
                           "failed_points": int((~back.converged).sum()), "seconds": back.seconds}
    return figures


def patch_peak(curve, patch: str) -> dict:
    """Largest peak of the nodes of a patch with its frequency, and the smallest node's peak."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")         # a peak at the border is told by `peak_inside_band`
        peaks = [curve.peak(n) for n in curve.output_names if n.rpartition(":")[0] == patch]
    hz, top = max(peaks, key=lambda p: p[1])
    return {"peak_hz": hz, "peak_m": top, "min_peak_m": min(p[1] for p in peaks)}
