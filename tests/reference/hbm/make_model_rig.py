"""Make model_rig.npz from the results of the study docs/studies/two_blade_rig/asymmetric.toml.

    python -m tipdamp run docs/studies/two_blade_rig/asymmetric.toml
    PYTHONPATH=. python tests/reference/hbm/make_model_rig.py
    docs/studies/two_blade_rig/results/asymmetric

The reduced model of the study, its kept pairs and its declared roll springs, in the modes of the
stuck system: an exact change of coordinates, q = modes y with modes' K_stuck modes = 1. Nothing of
hbm's harmonic balance goes into it."""

import sys
from pathlib import Path

import numpy as np

from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.receptance import stuck_receptance
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.tuning.roll_springs import spring_rows, with_springs
from tipdamp.statics import model_inputs as terms
from tipdamp.study.study import load_study

STUDY = Path(__file__).parents[3] / "docs" / "studies" / "two_blade_rig" / "asymmetric.toml"
TARGET = Path(__file__).parent / "model_rig.npz"


def arrays(folder) -> dict:
    """What is stored: see README.md beside this file."""
    study = load_study(STUDY)
    model = ReducedModel.load(folder / "model.npz")
    table = ContactTable.load(folder / "kept.csv")
    springs = terms.declared_springs(study, table)
    sprung = with_springs(model, table, springs)
    pairs = table.select(table.carrying)
    damping = terms.ratio(study.respond.damping_ratio)
    problem, _ = contact_problem(sprung, pairs, DryFriction2T(), damping_ratio=damping)
    R = stuck_receptance(problem.M, None, problem.stuck_stiffness, problem.damping_ratio)
    rows = terms.outputs(study, model)
    physical = np.flatnonzero(model.direction != "mode")
    nodes = set(zip(["damper"] * len(pairs), pairs.damper_node, strict=True)) | set(
        zip(pairs.blade_body.tolist(), pairs.blade_node, strict=True)
    )
    named = np.array([i for i in physical if (str(model.body[i]), int(model.node[i])) in nodes])
    return {
        "mass": R.mass,
        "shapes": problem.B @ R.shapes,
        "force": R.shapes.T @ terms.excitation(study, model),
        "roll": spring_rows(model, table, springs) @ R.shapes,
        "outputs": np.array(list(rows.values())) @ R.shapes,
        "names": np.array(list(rows)),
        **{name: vars(problem.contacts)[name] for name in ("kn", "kt", "mu", "preload")},
        "motion": R.shapes[named].astype(np.float32),
        "body": model.body[named],
        "node": model.node[named],
        "direction": model.direction[named],
        "position": model.position[named],
    }


if __name__ == "__main__":
    np.savez_compressed(TARGET, **arrays(Path(sys.argv[1])))
