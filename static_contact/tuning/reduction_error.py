"""Error of the stuck frequencies due to the reduction, and the number of modes for a required
accuracy."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg as sl
from numpy.typing import ArrayLike

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.craig_bampton import assemble
from tipdamp.modal.reduction import Reduction
from tipdamp.modal.truncation import Truncation, error_bound, join
from tipdamp.static_contact.tuning.stuck_assembly import stuck_rows


def stuck_error_bound(
    model: ReducedModel,
    truncation: Truncation,
    pairs: ContactTable,
    hz: ArrayLike,
    *,
    extra: np.ndarray | None = None,
) -> np.ndarray:
    """(n,) largest possible f_reduced / f_full - 1 of the lowest stuck frequencies hz (n,); inf
    where nothing can be said. extra (m, r): rows e with springs e'e (declared roll springs), or
    None."""
    return error_bound(
        _stuck_stiffness(model, pairs, extra), model.M, truncation, 2 * np.pi * np.asarray(hz)
    )


def enough_modes(
    parts: list[Reduction], targets: Sequence[float | None], pairs: ContactTable, below_hz: float
) -> list[int]:
    """Smallest number of modes of each body for which its own part of the error bound meets its
    target; modes of the same frequency stay together.

    parts - reductions that may hold more than enough modes; targets - largest relative error of the
    stuck frequencies below `below_hz` that each body may cause, None: all its modes are kept.
    Raises InputError, naming the bound reached, when the modes of a reduction are not enough.
    """
    return [
        _fewest(parts, i, target, pairs, below_hz) if target else len(part.mode_omega)
        for i, (part, target) in enumerate(zip(parts, targets, strict=True))
    ]


def own_error(
    parts: Sequence[Reduction], i: int, count: int, pairs: ContactTable, below_hz: float
) -> float:
    """Largest error bound of the stuck frequencies below `below_hz` when body i alone is cut to
    `count` modes."""
    cut = parts[i].cut(count)
    model = assemble(
        *(part.in_basis(cut) if k == i else part.model for k, part in enumerate(parts))
    )
    only = join(
        *(cut.truncation if k == i else _nothing_left_out(part) for k, part in enumerate(parts))
    )
    K = _stuck_stiffness(model, pairs, None)
    lam = sl.eigh(
        K, model.M, eigvals_only=True, subset_by_value=(-np.inf, (2 * np.pi * below_hz) ** 2)
    )
    return float(error_bound(K, model.M, only, np.sqrt(np.maximum(lam, 0))).max(initial=0.0))


def _fewest(
    parts: Sequence[Reduction], i: int, target: float, pairs: ContactTable, below_hz: float
) -> int:
    high = len(parts[i].mode_omega)
    reached = own_error(parts, i, high, pairs, below_hz)
    if reached > target:
        raise InputError(
            f"body '{parts[i].body.name}': the stuck frequencies below {below_hz:g} Hz are "
            f"certain to {reached:.1e} with {high} modes, error = {target:g} is asked for"
        )
    low = -1
    while high - low > 1:
        middle = (low + high) // 2
        if own_error(parts, i, middle, pairs, below_hz) <= target:
            high = middle
        else:
            low = middle
    return parts[i].whole_cluster(high)


def _nothing_left_out(part: Reduction) -> Truncation:
    t = part.truncation
    assert t is not None, "a reduction made without a bound"
    return replace(t, omega=np.array([np.inf]), G=(np.zeros_like(t.G[0]),))


def _stuck_stiffness(
    model: ReducedModel, pairs: ContactTable, extra: np.ndarray | None
) -> np.ndarray:
    rows = stuck_rows(model, pairs)
    if extra is not None:
        rows = np.vstack([rows, extra])
    return model.K + rows.T @ rows
