"""What may be asked of a followed peak or fold beside the problem and the parameter."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.keywords import CommonKeywords


class FollowKeywords(CommonKeywords, total=False):
    """The fields of FollowOptions as keywords; `outputs`, and `band` or `omega`, must be given."""

    band: Sequence[float] | None
    omega: Sequence[float] | None
    harmonics: int
    at: "ArrayLike"


@dataclass(frozen=True)
class FollowOptions:
    """The keywords of `follow_peak` and `follow_fold`.

    outputs : {name: a dof, or the (r,) row that takes the output out of q}
    band : (low, high) Hz of the whole curves at the first value, at the last one and where a branch
        ends: in it the highest peak counts; or omega : (low, high) rad/s
    harmonics, start, samples, settings : as in CurveOptions
    at : values of the parameter at which the peak is solved
    progress : function (value, step, calls), called at each place, and with step 0 on whole curves;
        without one a terminal or a notebook shows a line, and False shows nothing

    >>> FollowOptions(outputs={"tip": 0}, band=(600, 1000)).harmonics
    5
    """

    outputs: "Mapping[str, ArrayLike]"
    band: Sequence[float] | None = None
    omega: Sequence[float] | None = None
    harmonics: int = 5
    at: "ArrayLike" = ()
    start: str | np.ndarray | None = None
    samples: int | None = None
    settings: Settings | None = None
    progress: Callable[[float, float, int], None] | bool | None = None
