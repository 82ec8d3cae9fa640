"""Keywords that curves and branches of peaks have in common; nothing heavy is imported for them."""

from collections.abc import Callable, Mapping
from typing import Required, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.continuation.settings import Settings


class CommonKeywords(TypedDict, total=False):
    """What may be asked of a curve and of a branch of peaks."""

    outputs: Required[Mapping[str, ArrayLike]]
    start: str | np.ndarray | None
    samples: int | None
    settings: Settings | None
    progress: Callable[[float, float, int], None] | bool | None
