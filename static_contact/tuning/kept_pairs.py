"""Pairs that stay when others are detached, and the stiffness that they have then."""

import numpy as np

from tipdamp.hbm.contact import ContactTable


def conserve_total(pairs: ContactTable, whole: ContactTable) -> ContactTable:
    """The pairs with the stiffness of all pairs of their side that carry in `whole`, in the same
    proportions."""
    kn, kt = pairs.kn.copy(), pairs.kt.copy()
    for side in pairs.sides:
        mine = (pairs.side == side) & pairs.carrying
        full = (whole.side == side) & whole.carrying
        for own, of_all in ((kn, whole.kn), (kt, whole.kt)):
            if mine.any() and own[mine].any():
                own[mine] *= of_all[full].sum() / own[mine].sum()
    return pairs.replace(kn=kn, kt=kt)


def keep_ends(
    pairs: ContactTable, front: int, back: int, *, conserve: bool = False
) -> ContactTable:
    """Detach all but the first `front` and the last `back` stations of every side.

    conserve=False: the others keep their stiffness [Zucca 2016, sec. 7.1]; True: they take over
    that of all."""
    detached = pairs.replace(weight=np.where(ends_of(pairs, front, back), pairs.weight, 0.0))
    return conserve_total(detached, pairs) if conserve else detached


def ends_of(pairs: ContactTable, front: int, back: int) -> np.ndarray:
    """(P,) bool: the first `front` and the last `back` stations of every side."""
    last = np.array([pairs.station[pairs.side == s].max() for s in pairs.side])
    return (pairs.station < front) | (pairs.station > last - back)
