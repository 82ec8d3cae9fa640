"""What the stages of the forced response found: curves, periods at their peaks, stresses, and what
was measured."""

import math
from collections.abc import Sequence
from typing import ClassVar

from tipdamp.hbm.named_point import Kind
from tipdamp.hbm.result import NOT_SEARCHED
from tipdamp.results.record import Number, Numbers, Record, Result, Texts
from tipdamp.study.law import LawChoice

BESIDE = 1.15  # factor of the frequency of a peak up to which a hole may hide a higher one
SAME_MODE = 0.5  # MAC of two peaks, below which they are not of one mode

# ---- respond -------------------------------------------------------------------------------------


class Peak(Record):
    """Largest peak over the nodes of a patch, half of peak-to-peak along the force; min_peak_m - of
    its smallest node. Where the curve stopped, or its highest point borders a gap or is an end of
    the band, these are None, and at_least_m is the largest amplitude that was solved; None where
    there is a peak. inside_m - the largest local maximum inside the band of a curve whose highest
    point is an end of it. truncation - estimated error of the largest amplitude by the harmonics
    left out, of itself. unsolved - why a peak in the band is no solved maximum."""

    peak_hz: Number
    peak_m: Number
    min_peak_m: Number
    at_least_hz: Number = None
    at_least_m: Number = None
    inside_hz: Number = None
    inside_m: Number = None
    truncation: Number = None
    unsolved: str = ""

    @property
    def solved_nothing(self) -> bool:
        """Whether the curve has no solved point at all."""
        return self.peak_m is None and self.at_least_m is None

    @property
    def largest_m(self) -> float:
        """The peak, without one the largest amplitude that was solved, 0 where none was."""
        return self.peak_m or self.at_least_m or 0.0


class HeldForce(Record):
    """Force on what holds a rigid motion, at the highest amplitude of the curve on the first patch,
    beside the one at rest; unit - N or N m; amplitude - half of peak-to-peak of its vibration;
    spring - or the mean alone is held; moved - mean displacement of the spring, m or rad."""

    unit: str
    hz: Number
    mean: Number
    amplitude: Number
    spring: bool
    moved: Number = None


class FollowedWay(Peak):
    """A curve followed from one end of the band to the other: held {motion: ...}; further -
    see ForcedResponse; energy_error - of input = damping + friction over a period, relative to
    the input, the largest of its points."""

    held: dict[str, HeldForce] = {}
    complete: bool
    ended: str
    further: str = ""
    failed_points: int
    seconds: float
    energy_error: Number = None


class NamedPlace(Record):
    """A named point of a curve: kind, and what it is known to, as NamedPoint; pair - that slips or
    opens; multiplier - real and imaginary part of the one that passes; largest_m - amplitude on the
    first patch."""

    kind: Kind
    hz: float
    within_hz: float
    pair: str
    multiplier: tuple[Number, Number]
    largest_m: float


class Trust(Record):
    """How far a curve is to be trusted: unstable - whether the largest amplitude of the first patch
    is that of an unstable motion; unstable_points - how many points are, None where it is not
    known of any; worst_truncation - the largest `relative_truncation` of its points; named - its
    named points."""

    unstable: bool = False
    unstable_points: int | None = None
    worst_truncation: Number = None
    named: tuple[NamedPlace, ...] = ()


class BesideCurve(Trust):
    """A curve that was found beside another one, over from_hz to to_hz: highest - largest amplitude
    of its points on the first patch; closed - it comes back to where it began."""

    file: str
    from_hz: float
    to_hz: float
    highest_hz: float
    highest_m: float
    closed: bool
    complete: bool
    ended: str

    @property
    def ends(self) -> str:
        """Where it lies, in words."""
        kind = "detached, " if self.closed else ""
        return f"{kind}over {self.from_hz:.4g} to {self.to_hz:.4g} Hz"


class TriedHarmonics(Record):
    """A number of harmonics that harmonics = 'auto' tried: error - that 99 % of the points keep,
    relative to their vibration, None where it is not finite; complete - the curve is, as it must
    be to be taken."""

    H: int
    error: Number
    complete: bool = True

    @property
    def size(self) -> float:
        """The error as a number."""
        return float("inf") if self.error is None else self.error


class CurveResult(FollowedWay, Trust):
    """One curve, its peak on the first patch; patches {patch: Peak}; slipping_pairs - names of
    `pair_names` of those that slip or open, lift_off_pairs - of those that open somewhere and
    are closed at rest; searched - see ForcedResponse; beside - the curves that were found;
    mac - of the outputs at the peak with those at the peak of the next lower level; left_out - Hz
    and Hz between which a branch that folds again and again was left and taken up again; tried,
    within_tolerance - with harmonics = 'auto': the numbers of harmonics, and whether this one
    meets the tolerance; alike_backwards - see ForcedResponse; back - from the other end, None
    where the band was followed one way; held_change, held_reaction_change - see ForcedResponse;
    hold_doubts - sentences of `hold_in_words`."""

    file: str
    Fe_N: float
    H: int
    patches: dict[str, Peak]
    points: int
    slipping_pairs: Texts
    lift_off_pairs: Texts = ()
    residual_calls: int
    searched: str = NOT_SEARCHED
    beside: tuple[BesideCurve, ...] = ()
    left_out: tuple[tuple[float, float], ...] = ()
    origin: str
    start: str
    tried: tuple[TriedHarmonics, ...] = ()
    within_tolerance: bool | None = None
    mac: Number = None
    alike_backwards: bool = False
    back: FollowedWay | None = None
    held_change: Number = 0.0
    held_reaction_change: Number = 0.0
    hold_doubts: Texts = ()

    @property
    def least_known(self) -> tuple[float, str]:
        """(estimated error of a peak by the harmonics left out, patch) of the patch on which it is
        largest, the first of equal ones; 0 without an estimate."""
        errors = ((peak.truncation or 0.0, name) for name, peak in self.patches.items())
        return max(errors, key=lambda one: one[0], default=(self.truncation or 0.0, ""))

    @property
    def is_bound(self) -> bool:
        """Whether the largest amplitude is only what the vibration is at least: the curve has no
        peak, or was left beside it, where a solution may be higher."""
        return self.peak_m is None or any(self.is_beside(*ends) for ends in self.left_out)

    def is_beside(self, low: float, high: float) -> bool:
        """Whether something from low to high (Hz) belongs to the resonance of the peak."""
        hz = self.peak_hz
        return hz is not None and low <= BESIDE * hz and high >= hz / BESIDE

    @property
    def of_another_mode(self) -> bool:
        """Whether the peak is not of the mode of that at the next lower level."""
        return self.mac is not None and self.mac < SAME_MODE


def families(curves: Sequence[CurveResult]) -> list[list[CurveResult]]:
    """The curves in sets of one for each level, ascending in Fe: the first of the smallest H, the
    last of the largest; with harmonics = 'auto' one set, in which H differs."""
    levels = [
        sorted((one for one in curves if one.Fe_N == Fe), key=lambda one: one.H)
        for Fe in sorted({one.Fe_N for one in curves})
    ]
    return [list(family) for family in zip(*levels, strict=True)]


class InterfaceFacts(Record):
    """Interface reduction: pairs, and those followed; dofs of the model and shapes in their place;
    response_error - estimate; frequency_error - bound of the stuck frequencies; not_followed -
    pairs that slip all the same."""

    pairs: int
    followed: int
    dofs: int
    shapes: int
    response_error: float
    frequency_error: float
    not_followed: Texts = ()


class RespondResult(Result):
    """respond.json. zeta - damping ratios of the stuck modes; tolerance - of the error by the
    harmonics left out, as the study has it; stuck_difference {file: largest
    difference from the linear stuck response over its peak} of the curves on which no pair slips;
    interface - its reduction; size_m - largest extent of the nodes; open_damping - where pairs
    that are open at rest give a mode another damping ratio, in words."""

    file: ClassVar[str] = "respond.json"
    responses: tuple[CurveResult, ...]
    law: LawChoice
    zeta: Numbers
    tolerance: float = 1e-3
    stuck_difference: dict[str, float] = {}
    interface: InterfaceFacts | None = None
    size_m: Number = None
    open_damping: str = ""


# ---- measured ------------------------------------------------------------------------------------


class MeasuredDamping(Record):
    """A damping ratio identified on each repeat: mean and sample standard deviation; refused - why
    there is none."""

    zeta: Number = None
    deviation: Number = None
    refused: str = ""


class MeasuredFacts(Record):
    """One measured curve. peak_hz, peak_m_per_N - mean over the repeats, None where the peak was
    refused, with their standard deviations; file - CSV of mean and band; with_phase - whether the
    phase was measured."""

    file: str
    files: Texts
    level_N: float
    repeats: int
    points: int
    band_hz: tuple[float, float]
    with_phase: bool
    peak_hz: Number
    peak_m_per_N: Number
    peak_hz_deviation: Number
    peak_m_per_N_deviation: Number
    half_power: MeasuredDamping
    circle_fit: MeasuredDamping


class MeasuredResult(Result):
    """measured.json."""

    file: ClassVar[str] = "measured.json"
    curves: dict[str, MeasuredFacts]


# ---- cycles --------------------------------------------------------------------------------------


class Integration(Record):
    """Time integration from a point of a curve, see `tipdamp.hbm.comparison.Comparison`: difference
    - of the amplitude; agrees - whether it is periodic and stayed on the orbit; stable - None where
    that is not known; said - one sentence."""

    difference: Number
    agrees: bool
    stable: bool | None
    said: str


class PeakCycle(Record):
    """One period at the highest solved point of a curve, J per period. friction_J {pair: work of
    friction}; error - of input = damping + friction, relative to the input; file - npz of the
    hysteresis loops; integration - None where it was not asked for."""

    file: str
    Fe_N: float
    H: int
    hz: float
    input_J: float
    damping_J: float
    friction_J: dict[str, float]
    error: float
    damping_ratio: float
    integration: Integration | None = None

    @property
    def friction_share(self) -> float:
        """Of the input, what friction takes."""
        return sum(self.friction_J.values()) / self.input_J if self.input_J else 0.0


class CyclesResult(Result):
    """cycles.json. pairs - names of the kept pairs, in the order of the files."""

    file: ClassVar[str] = "cycles.json"
    curves: tuple[PeakCycle, ...]
    pairs: Texts


# ---- stress --------------------------------------------------------------------------------------


class StressPlace(Record):
    """A node where the alternating stress is larger than at all nodes of the cells around it, or
    where the safety is least; von Mises stresses. safety - by Goodman, None without limits."""

    body: str
    node: int
    position_m: tuple[float, float, float]
    mean_Pa: float
    alternating_Pa: float
    amplitude_m: float
    safety: Number = None


class PeakStress(Record):
    """Stress at the highest solved point of a curve; files - .vtu of the bodies; places - the
    largest of each body; least - of each body with limits, where its safety by Goodman is least."""

    files: Texts
    Fe_N: float
    H: int
    hz: float
    places: tuple[StressPlace, ...]
    least: tuple[StressPlace, ...] = ()

    @property
    def top(self) -> StressPlace | None:
        """Where the alternating stress is largest; None where nothing vibrates."""
        return max(self.places, key=lambda place: place.alternating_Pa, default=None)

    @property
    def weakest(self) -> StressPlace | None:
        """Where the safety is least; None without limits."""
        return min(self.least, key=lambda place: place.safety or 0.0, default=None)


class StressResult(Result):
    """stress.json. unbalanced {body: part of the forces at rest that its inertia takes up}, of free
    bodies."""

    file: ClassVar[str] = "stress.json"
    curves: tuple[PeakStress, ...]
    unbalanced: dict[str, float] = {}


# ---- agreement -----------------------------------------------------------------------------------


class Agreement(Record):
    """A computed curve beside a measured one. share_inside - part of the common frequencies at
    which it lies in the measured band; peak, frequency - computed over measured, minus 1;
    half_power - of the computed curve at the measured frequencies, whose difference from the
    damping put in, zeta, is the bias of the method."""

    measured: str
    computed: str
    Fe_N: float
    H: int
    share_inside: Number
    peak: Number
    frequency: Number
    half_power: MeasuredDamping


class FittedValue(Record):
    """What a fit has found: a damping ratio, or a factor on mu or on the stiffness; low to high -
    the 95 % interval."""

    name: str
    value: float
    low: float
    high: float
    start: float

    @property
    def digits(self) -> int:
        """Significant ones, so that value and interval are told apart."""
        half = (self.high - self.low) / 2
        if not 0 < half < abs(self.value):
            return 4
        return max(4, math.ceil(math.log10(abs(self.value) / half)) + 1)


class FittedCurve(Record):
    """A measured curve of a fit. misfit - root mean square of the difference, relative to the
    largest amplitude; half_power - as if nothing slipped; hz, m_per_N - the fitted curve at the
    measured frequencies in the band."""

    measured: str
    level_N: float
    misfit: float
    half_power: MeasuredDamping
    hz: tuple[float, ...] = ()
    m_per_N: tuple[float, ...] = ()


class FitResult(Result):
    """fit.json."""

    file: ClassVar[str] = "fit.json"
    values: tuple[FittedValue, ...]
    curves: tuple[FittedCurve, ...]
    iterations: int


class PredictedPeak(Record):
    """Largest peak of a computed curve on the patch, and what the backbone predicts for its level,
    None where it does not; said - why, or why the two are not to be compared."""

    Fe_N: float
    peak_hz: Number
    peak_m: Number
    predicted_hz: Number = None
    predicted_m: Number = None
    said: str = ""


class BackboneResult(Result):
    """backbone.json. mode, stuck_hz - number and frequency with every kept pair stuck; rest_hz -
    with those that are in contact at rest, None where all are; output - whose amplitude at the
    frequency of the mode runs from first_m to last_m, as far as it is reached; no_motion_m - the
    default first amplitude, where no motion was found there; low_hz, high_hz - of the mode; zeta -
    the largest damping ratio, at zeta_at_m; ended, complete - see Backbone. Without points it was
    not found at all: what it would have reached is None."""

    file: ClassVar[str] = "backbone.json"
    mode: int
    stuck_hz: float
    rest_hz: float | None = None
    stuck_zeta: Number = None
    response: str
    output: str
    H: int | None = None
    first_m: Number = None
    last_m: Number = None
    no_motion_m: Number = None
    reached_m: Number = None
    low_hz: Number = None
    high_hz: Number = None
    zeta: Number = None
    zeta_at_m: Number = None
    points: int
    complete: bool
    ended: str
    peaks: tuple[PredictedPeak, ...]


class AgreementResult(Result):
    """agreement.json. zeta - damping ratio of the tracked stuck mode in the computation."""

    file: ClassVar[str] = "agreement.json"
    curves: tuple[Agreement, ...]
    zeta: float
