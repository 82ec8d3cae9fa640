"""How numbers, names and lists are written."""

import math

NOTHING = "\N{EN DASH}"
MICRO = 1e6


def number(value, digits: int = 4) -> str:
    """Significant digits without an exponent where that is readable: 0.7523, 79.90, 43896."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if size < -4 or size > 6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}\N{MULTIPLICATION SIGN}10{_superscript(int(exponent))}".replace("-", "\N{MINUS SIGN}")
    return f"{value:.{max(digits - 1 - size, 0)}f}".replace("-", "\N{MINUS SIGN}")


def hertz(value) -> str:
    return NOTHING if value is None or not math.isfinite(value) else f"{value:.1f}"


def micro(value) -> str:
    """m as µm with four digits."""
    return number(None if value is None else MICRO * value)


def distance(value) -> str:
    """m as µm with three digits; what is only rounding of coordinates is 0."""
    return "0" if value is not None and abs(value) < 1e-10 else number(None if value is None else MICRO * value, 3)


def percent(share, digits: int = 2) -> str:
    """A ratio as signed percent."""
    if share is None or not math.isfinite(share):
        return NOTHING
    rounded = round(100 * share, digits)
    return f"{rounded:+.{digits}f} %".replace("-", "\N{MINUS SIGN}") if rounded else f"{0:.{digits}f} %"


def deviation(value, reference) -> str:
    return percent(value / reference - 1) if value and reference else NOTHING


def sentence(warning: str) -> str:
    """A warning of the command line, as a sentence."""
    return f"{warning[:1].upper()}{warning[1:]}."


def listing(parts) -> str:
    """'a, b and c'."""
    parts = [str(p) for p in parts]
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}" if parts else ""


def names_of_pairs(names) -> str:
    """['left 1', 'left 2', 'left 7', 'right 0'] as 'left 1-2, 7; right 0', with true dashes."""
    sides = {}
    for name in names:
        side, _, station = name.rpartition(" ")
        sides.setdefault(side, set()).add(int(station))
    return "; ".join(f"{side} {_ranges(sorted(stations))}" for side, stations in sides.items()) or "none"


def _ranges(whole) -> str:
    runs = []
    for k in whole:
        if runs and k == runs[-1][1] + 1:
            runs[-1][1] = k
        else:
            runs.append([k, k])
    return ", ".join(f"{a}" if a == b else f"{a}{NOTHING}{b}" for a, b in runs)


def _superscript(k: int) -> str:
    return str(k).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
