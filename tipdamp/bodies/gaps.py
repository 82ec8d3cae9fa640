"""Initial gaps of a study: no wider than the damper allows, and known along all of each side."""

from collections.abc import Callable

import numpy as np

from tipdamp.bodies.surfaces import length_text
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.study.view import Study

LARGEST = 0.1  # of the damper's size


def check_gaps(study: Study, pairs: ContactTable, damper: np.ndarray) -> None:
    """InputError where a gap is larger than a tenth of the damper, whose nodes lie at (n, 3) m, nan
    where that is not known, or a profile ends before its side does. Of surfaces that part, as round
    ones do, the nearest pair counts."""
    known = damper[np.isfinite(damper).all(axis=1)]
    size = float(np.ptp(known, axis=0).max()) if len(known) else 0.0
    shown, wide = length_text(study.length_unit), np.abs(pairs.gap)
    if study.contact.pairs:
        told = [int(wide.argmax())]
    else:
        _check_profiles(study, pairs, size)
        each = [np.flatnonzero(pairs.side == name) for name in dict.fromkeys(pairs.side.tolist())]
        told = [one[wide[one].argmin()] for one in each]
    for i in told:
        where = f"{study.path}: [contact], side '{pairs.side[i]}', station {pairs.station[i]}: gap"
        _refuse_wide(where, pairs.gap[i], size, shown)


def _check_profiles(study: Study, pairs: ContactTable, size: float) -> None:
    """Of the sides that have one; size - m, of the damper."""
    shown, place = length_text(study.length_unit), pairs.position @ np.array(study.driver.axis)
    for name, side in study.sides.items():
        if not side.gap:
            continue
        where = f"{study.path}: [contact.{name}] gap"
        profile, along = np.array(side.gap), place[pairs.side == name]
        _refuse_wide(where, profile[np.abs(profile[:, 1]).argmax(), 1], size, shown)
        (low, high), (least, most) = (
            (values.min(), values.max()) for values in (along, profile[:, 0])
        )
        if least > low + study.contact.tolerance or most < high - study.contact.tolerance:
            raise InputError(
                f"{where}: the profile reaches from {shown(least)} to {shown(most)} along the "
                f"axis, the pairs of the side from {shown(low)} to {shown(high)}; give rows up to "
                "both ends (the same gap again where it is to stay as it is)"
            )


def _refuse_wide(where: str, gap: float, size: float, shown: Callable) -> None:
    if 0 < LARGEST * size < abs(gap):
        raise InputError(
            f"{where} = {shown(gap)}: larger than a tenth of the damper, which is {shown(size)} "
            "long; lengths are in the unit of [units]: check it, or take the pairs out that "
            "never touch"
        )
