"""How numbers, names and lists are written."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from tipdamp.results.static_results import RedistributionFacts

NOTHING = "\N{EN DASH}"
MICRO = 1e6  # µm in a metre
MEGA = 1e6  # Pa in a MPa
MM = 1e3  # mm in a metre
MM2 = 1e6  # mm² in a square metre
MANY = 12  # entries of a list of pairs
NEGLIGIBLE = 1e-9  # N, N m: rounding of balanced loads


def number(value: float | None, digits: int = 4, scale: float = 1.0) -> str:
    """Significant digits of scale * value, without an exponent where that is readable: 0.7523,
    79.90, 43896."""
    if value is None or not math.isfinite(value):
        return NOTHING
    value *= scale
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if size < -4 or size > 6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return true_minus(f"{mantissa}\N{MULTIPLICATION SIGN}10{_superscript(int(exponent))}")
    return true_minus(f"{value:.{max(digits - 1 - size, 0)}f}")


def true_minus(text: str) -> str:
    """A number with a minus sign in place of the hyphen."""
    return text.replace("-", "\N{MINUS SIGN}")


def hertz(value: float | None) -> str:
    """One decimal."""
    return NOTHING if value is None or not math.isfinite(value) else f"{value:.1f}"


def micro(value: float | None) -> str:
    """m as µm with four digits."""
    return number(value, scale=MICRO)


def distance(value: float | None) -> str:
    """m as µm with three digits; what is only rounding of coordinates is 0."""
    return "0" if value is not None and abs(value) < 1e-10 else number(value, 3, MICRO)


def amount(value: float | None, unit: str) -> str:
    """Three digits with the unit; what is only rounding of a sum is 0."""
    return f"{number(0 if value is not None and abs(value) < NEGLIGIBLE else value, 3)} {unit}"


def force_along(motion: str, load: float) -> str:
    """A load along a rigid motion: '0.0500 N m along 'roll about y''."""
    return f"{amount(load, 'N m' if motion.startswith('roll') else 'N')} along '{motion}'"


def moment(done: RedistributionFacts, axis: np.ndarray) -> str:
    """What a kept preload leaves: '-0.0424 N m about the axis of the damper and 0.0123 N m across
    it'."""
    along = f"{amount(done.moment_Nm, 'N m')} about the axis of the damper"
    if done.moments_Nm is None:
        return along
    rest = np.array(done.moments_Nm) - (np.array(done.moments_Nm) @ axis) * axis
    return f"{along} and {amount(float(np.linalg.norm(rest)), 'N m')} across it"


def percent(share: float | None, digits: int = 2) -> str:
    """A ratio as signed percent."""
    if share is None or not math.isfinite(share):
        return NOTHING
    rounded = round(100 * share, digits)
    return true_minus(f"{rounded:+.{digits}f} %") if rounded else f"{0:.{digits}f} %"


def deviation(value: float | None, reference: float | None) -> str:
    """From a reference value, as signed percent; a dash without one."""
    return percent(value / reference - 1) if value and reference else NOTHING


def sentence(warning: str) -> str:
    """A warning of the command line, as a sentence."""
    return f"{warning[:1].upper()}{warning[1:]}."


def listing(parts: Iterable) -> str:
    """'a, b and c'."""
    parts = [str(p) for p in parts]
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} and {parts[-1]}"


def names_of_pairs(names: Iterable[str]) -> str:
    """['left 1', 'left 2', 'left 7', 'right 0/1'] as 'left 1-2, 7; right (row 1) 0', with true
    dashes; of more than MANY such entries the number on each side, 'left 25 pairs'."""
    names = list(names)
    groups: dict[str, set[int]] = {}
    for name in names:
        side, _, place = name.rpartition(" ")
        station, _, row = place.partition("/")
        groups.setdefault(f"{side} (row {row})" if row else side, set()).add(int(station))
    listed = {group: _ranges(sorted(stations)) for group, stations in groups.items()}
    if sum(len(entries) for entries in listed.values()) > MANY:
        counts = Counter(name.rpartition(" ")[0] for name in names)
        return ", ".join(f"{side} {n} pair{'s' * (n > 1)}" for side, n in counts.items())
    return "; ".join(f"{group} {', '.join(ends)}" for group, ends in listed.items()) or "none"


def _ranges(whole: Sequence[int]) -> list[str]:
    runs: list[list[int]] = []
    for k in whole:
        if runs and k == runs[-1][1] + 1:
            runs[-1][1] = k
        else:
            runs.append([k, k])
    return [f"{a}" if a == b else f"{a}{NOTHING}{b}" for a, b in runs]


def _superscript(k: int) -> str:
    return str(k).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
