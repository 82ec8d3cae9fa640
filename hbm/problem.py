"""The contact problem: a model, its contacts and their law, as the harmonic balance takes them."""

import warnings

import numpy as np

from hbm.balance.receptance import describe_motion
from hbm.balance.residual import ContactProblem
from hbm.contact import ContactTable, relative_motion, without_normal_motion
from hbm.errors import InputError
from hbm.laws.records import Contacts
from hbm.laws.shipped import check_law
from hbm.model import ReducedModel
from hbm.validation import check_kind

__all__ = ["ContactProblem", "contact_problem"]


def contact_problem(model, pairs, law, origin="preloaded", static=None, damping_ratio=None):
    """(ContactProblem of the carrying pairs, mask (P,) of these in the table).

    model, pairs, law, origin, damping_ratio : as in `hbm.response.forced_response`
    static : (r,) N, constant loads of the unloaded origin
    Raises InputError on unusable input; warns where the model cannot move along the normal of a pair.
    """
    if origin not in ("preloaded", "unloaded"):
        raise InputError(f"origin = '{origin}': must be 'preloaded' or 'unloaded'")
    if origin == "preloaded" and static is not None:
        raise InputError("static: the preloaded state holds the static loads already; use origin = 'unloaded'")
    check_kind("model", model, ReducedModel, "ReducedModel.from_matrices, .from_files or .load")
    check_kind("pairs", pairs, ContactTable, "ContactTable.load or a contact detection")
    check_law(law)
    kept = pairs.carrying
    if not kept.any():
        raise InputError("no pair carries: every weight is 0; use linear_response for the model without damper")
    used = pairs.select(kept)
    preload = used.preload if origin == "preloaded" else -used.kn * used.weight * used.gap
    settings = Contacts(used.kn * used.weight, used.kt * used.weight, used.mu, preload)
    law = law.select(kept)
    B = relative_motion(model, used)
    if "n" in law.components and (lacking := without_normal_motion(B, used)):
        warnings.warn(lacking, stacklevel=3)
    if law.components != ("t1", "t2", "n"):
        rows = ["t1", "t2", "n"]
        B = B[np.concatenate([[3 * i + rows.index(c) for c in law.components] for i in range(len(used))])]
    return ContactProblem(model.M, model.C if damping_ratio is None else None, model.K, B, law, settings, static,
                          origin == "preloaded", damping_ratio, lambda v: describe_motion(model, v)), kept
