"""Whether friction holds a damper that else slides freely where a curve starts; said before the
curves are made."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.bodies.loads import damper_hold
from tipdamp.checks import only_friction
from tipdamp.hbm.balance.receptance import linear_response
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import FreeMotion
from tipdamp.statics.model_inputs import ratio
from tipdamp.study.view import Study


def adrift(
    study: Study,
    free: Sequence[FreeMotion],
    contact: tuple[ReducedModel, ContactTable],
    force: np.ndarray,
) -> Iterator[str]:
    """One sentence where the damper has motions `free` of friction that nothing holds, and all
    friction together is less than what the contacts, stuck, would carry at an end of the band from
    which a curve starts.

    contact - the model and its kept pairs; force (r,) N for a level of 1 N
    """
    model, kept = contact
    settings = study.respond
    closed = kept.select(kept.preload > 0)
    level = max(settings.levels)
    hold = damper_hold(study)
    if not free or hold.motions or not len(closed):
        return
    rows = {str(i): row for i, row in enumerate(relative_motion(model, closed).toarray())}
    u = linear_response(
        model,
        closed,
        level * force,
        settings.band[: 1 + settings.both_ways],
        ratio(settings.damping_ratio),
        rows,
    ).reshape(-1, len(closed), 3)
    needed = (np.linalg.norm(u[:, :, :2], axis=2) * closed.kt * closed.weight).sum(axis=1).max()
    given = (closed.mu * closed.preload).sum()
    motions = [one.name for one in free]
    if needed > given:
        yield (
            f"{only_friction.said(motions)}, and at {level:g} N its contacts would need "
            f"{needed:.3g} N to stick where the band starts, friction gives {given:.3g} N: a "
            "curve may find no first point; hold the mean position, the vibration stays free: "
            f"{only_friction.remedy(motions, hold.section)}"
        )
