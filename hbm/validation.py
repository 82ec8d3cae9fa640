"""Input of the forced response, checked before anything heavy starts: numbers, arrays, records."""

from collections.abc import Callable, Iterable
from dataclasses import fields
from functools import partial
from inspect import signature
from numbers import Integral, Real
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.continuation.settings import DEFAULT, Settings
from tipdamp.hbm.errors import InputError, nearest, shown

MOST_HARMONICS = 200
MOST_SAMPLES = 2**16
LEAST, MOST = 1e-120, 1e100  # of forces in N, settings of contacts and parameters
CLOSEST = 1e-12  # share by which the ends of an interval differ
MAY_BE_ZERO = ("outside", "max_restarts", "max_gaps")  # of the settings


def check_harmonics(H: Any) -> int:
    """The highest harmonic; InputError where it is no whole number, or too large."""
    if not is_whole(H) or not 0 <= H <= MOST_HARMONICS:
        raise InputError(
            f"harmonics = {H!r}: must be a whole number between 0 and {MOST_HARMONICS}, or 'auto' "
            "for a curve"
        )
    return int(H)


def check_whole(name: str, value: Any, least: int) -> int:
    """One whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InputError(f"{name} = {brief(value)}: must be a whole number, {least} or more")
    return int(value)


def positive(name: str, value: Any, unit: str = "") -> float:
    """One finite number above zero."""
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < float(value) < np.inf:
        raise InputError(
            f"{name} = {value!r}: must be one positive number{' in' * bool(unit)}{unit}"
        )
    return float(value)


def in_hz(name: str, hz: Any, omega: Any) -> Any:
    """A frequency, or a pair of them, in Hz, of which either Hz or omega in rad/s is given."""
    if (hz is None) == (omega is None):
        raise InputError(f"give either {name} in Hz or omega in rad/s")
    if omega is None:
        return hz
    try:
        angular = np.asarray(omega, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"omega = {omega!r}: must be in rad/s, as {name} in Hz") from None
    return (angular / (2 * np.pi)).tolist()


def interval(name: str, ends: Any, unit: str = "") -> tuple[float, float]:
    """Two different finite numbers above zero, (from, to)."""
    try:
        first, last = (float(end) for end in ends)
    except (TypeError, ValueError):
        what = f"frequencies in{unit}" if unit else "values"
        raise InputError(f"{name} = {ends!r}: must be two {what}, (from, to)") from None
    low, high = min(first, last), max(first, last)
    if not (np.isfinite([first, last]).all() and low > 0) or first == last:
        raise InputError(
            f"{name} = ({first:g}, {last:g}){unit}: both must be positive, and different"
        )
    if low < LEAST or high > MOST or high - low < CLOSEST * high:
        raise InputError(
            f"{name} = ({first!r}, {last!r}){unit}: both must lie between {LEAST:g} and {MOST:g} "
            f"and differ by {CLOSEST:g} of their size, which double precision can carry"
        )
    return first, last


def check_beyond(beyond: Any, name: str, ends: tuple[float, float], unit: str = "") -> float | None:
    """A finite positive number past the end of the interval `name` = ends; None stays None."""
    if beyond is None:
        return None
    first, last = ends
    value = float(positive("beyond", beyond, unit))
    if (value - last) * (last - first) <= 0:
        raise InputError(
            f"beyond = {value:g}{unit}: must lie past the end of {name} = "
            f"({first:g}, {last:g}){unit}"
        )
    interval(f"({name}[0], beyond)", (first, value), unit)
    return value


def check_samples(samples: Any, H: int) -> int | None:
    """None stays None: the law's own number."""
    least = max(8, 4 * H)
    if samples is not None and not (is_whole(samples) and least <= samples <= MOST_SAMPLES):
        raise InputError(
            f"samples = {samples!r}: must be a whole number, at least {least} for harmonics = "
            f"{H}, and at most {MOST_SAMPLES}"
        )
    return samples


def check_values(at: Any, name: str, first: float, last: float, unit: str = "") -> np.ndarray:
    """(k,) numbers of `at`, all inside the interval `name` = (first, last)."""
    values = np.atleast_1d(
        numbers("at", at, "must be frequencies in Hz" if unit else "must be numbers")
    ).ravel()
    inside = (min(first, last) <= values) & (values <= max(first, last))
    if not inside.all():
        raise InputError(
            f"at = {values[~inside][0]:g}{unit}: lies outside {name} = ({first:g}, {last:g}){unit}"
        )
    return values


def check_forcing(forcing: Any, r: int, H: int) -> dict[int, np.ndarray]:
    """{harmonic: (r,) force} from one force, or from one for each harmonic."""
    forces = forcing if isinstance(forcing, dict) else {1: forcing}
    checked = {}
    for k, F in forces.items():
        F = numbers(
            f"forcing of harmonic {k!r}", F, f"must be {r} numbers in N, real or complex", complex
        )
        if not is_whole(k) or not 0 < k:
            raise InputError(
                f"forcing of harmonic {k!r}: harmonics count from 1; constant loads go into "
                "`static`"
            )
        if k > H:
            raise InputError(f"forcing of harmonic {k}: harmonics = {H} keeps orders 0..{H} only")
        if F.shape != (r,) or not np.isfinite(F).all():
            raise InputError(
                f"forcing of harmonic {k}: must be finite with shape ({r},), got shape {F.shape}"
            )
        largest = np.abs(F).max(initial=0.0)
        if largest and not LEAST <= largest <= MOST:
            raise InputError(
                f"forcing of harmonic {k}: its largest entry is {largest:.3g} N, must be between "
                f"{LEAST:g} and {MOST:g} N, which double precision can carry, or zero"
            )
        checked[int(k)] = F
    return checked


def check_outputs(outputs: Any, r: int) -> tuple[list[str], np.ndarray]:
    """Names and rows (m, r) of {name: row, the number of a dof, or two dofs (a, b): a less b}."""
    if not isinstance(outputs, dict):
        raise InputError(f"outputs = {brief(outputs)}: must be a dict {{name: row of length {r}}}")
    if not outputs:
        raise InputError("outputs: at least one {name: row} is needed")
    rows = []
    for name, row in outputs.items():
        by_dofs = row_of_dofs(row, partial(_unit, f"output '{shown(name)}'", r))
        if by_dofs is not None:
            rows.append(by_dofs)
            continue
        row = numbers(f"output '{shown(name)}'", row, f"must be a row of {r} real numbers", float)
        row = row.ravel() if row.size == r else row
        if row.shape != (r,) or not np.isfinite(row).all():
            raise InputError(
                f"output '{name}': must be a finite row of length {r}, got shape {row.shape}"
            )
        rows.append(row)
    return list(outputs), np.array(rows)


def row_of_dofs(where: Any, unit: Callable[[int], np.ndarray]) -> np.ndarray | None:
    """(r,) row of a dof, or of two dofs (a, b): a less b; None of anything else; unit : gives the
    row of a dof."""
    if is_whole(where):
        return unit(int(where))
    if isinstance(where, tuple) and len(where) == 2 and all(map(is_whole, where)):
        return unit(int(where[0])) - unit(int(where[1]))
    return None


def is_whole(value: Any) -> bool:
    """Whether a value is a whole number, and no truth value."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _unit(name: str, r: int, dof: int) -> np.ndarray:
    """(r,) row that takes a dof out of q."""
    if not 0 <= dof < r:
        raise InputError(
            f"{name}: dof {dof} does not exist, 0..{r - 1} do; or a row of {r} numbers"
        )
    return np.eye(r)[dof]


def check_groups(groups: Any, names: list[str]) -> list[list[int]]:
    """Columns of the outputs in each group of `peaks`; each output on its own where groups is
    None."""
    if groups is None:
        return [[j] for j in range(len(names))]
    if _is_no_list(groups) or any(isinstance(g, str) for g in groups):
        raise InputError(
            f"peaks = {brief(groups)}: must be groups of names of outputs, [[name, name, ...], ...]"
        )
    check_names("peaks", [name for group in groups for name in group], names)
    return [[names.index(name) for name in group] for group in groups]


def check_names(argument: str, chosen: Any, names: list[str]) -> None:
    """InputError where what is chosen are no names of outputs."""
    if _is_no_list(chosen):
        raise InputError(
            f"{argument} = {brief(chosen)}: must be names of outputs, [name, name, ...]"
        )
    for name in chosen:
        if name not in names:
            raise InputError(f"{argument}: output '{name}' is unknown; {nearest(str(name), names)}")


def _is_no_list(value: Any) -> bool:
    return isinstance(value, str) or not isinstance(value, Iterable)


def one_of(name: str, value: Any, allowed: tuple[str, ...]) -> Any:
    """The value; InputError where it is none of the allowed ones."""
    if not isinstance(value, str) or value not in allowed:
        raise InputError(f"{name} = {brief(value)}: must be one of {', '.join(allowed)}")
    return value


def check_kind(name: str, value: Any, kind: type, made_by: str) -> Any:
    """InputError where an argument is not of the class that it must be."""
    if not isinstance(value, kind):
        raise InputError(f"{name} = {brief(value)}: must be a {kind.__name__}, made by {made_by}")
    return value


def check_call(name: str, function: Callable, *arguments: str) -> None:
    """InputError where a function of the user's own cannot be called with arguments of these names;
    what does not state its arguments is taken as it is."""
    try:
        stated = signature(function)
    except ValueError:
        return
    try:
        stated.bind(*arguments)
    except TypeError:
        raise InputError(
            f"{name}{shown(stated)} cannot be called with ({', '.join(arguments)}), as it will be"
        ) from None


def check_settings(settings: Settings | None, progress: Callable | bool | None = None) -> Settings:
    """The numbers of the continuation, by default its own; InputError too where progress cannot be
    called."""
    if not (progress is None or progress is False or callable(progress)):
        raise InputError(
            f"progress = {brief(progress)}: must be a function (value, step, calls), None or False"
        )
    if callable(progress):
        check_call("progress", progress, "value", "step", "calls")
    settings = DEFAULT if settings is None else settings
    check_kind(
        "settings",
        settings,
        Settings,
        "replace(tipdamp.hbm.continuation.settings.DEFAULT, max_calls=500)",
    )
    check_numbers(settings, MAY_BE_ZERO)
    return settings


def check_numbers(
    settings: Any, may_be_zero: Iterable[str] = (), may_be_infinite: Iterable[str] = ()
) -> None:
    """InputError where a number of a record of settings is not above zero, or not whole where its
    default is."""
    for one in (field for field in fields(settings) if isinstance(field.default, Real)):
        value, whole = vars(settings)[one.name], isinstance(one.default, int)
        least = float(np.finfo(float).tiny)
        if one.name in may_be_zero:
            least = 0
        elif whole:
            least = 1
        below = np.nextafter(np.inf, 0) if one.name not in may_be_infinite else np.inf
        if (
            isinstance(value, bool)
            or not isinstance(value, Integral if whole else Real)
            or not least <= float(value) <= below
        ):
            raise InputError(
                f"settings: {one.name} = {brief(value)}: must be a "
                f"{'whole ' if whole else ''}number, "
                + (f"{least} or more" if whole or not least else "above 0")
            )


def brief(value: Any) -> str:
    """What came, in one short line."""
    return shown(" ".join(repr(value).split()))


def numbers(name: str, value: Any, allowed: str, kind: type = float) -> np.ndarray:
    """The value as an array of real (float) or complex numbers; InputError where it is none."""
    try:
        array = np.asarray(value.toarray() if sp.issparse(value) else value)
        is_complex = np.iscomplexobj(array) and array.imag.any()
        if array.dtype.kind not in "iufc" or kind is float and is_complex:
            raise TypeError
    except (TypeError, ValueError):
        raise InputError(f"{name} = {brief(value)}: {allowed}") from None
    return array.real.astype(float) if kind is float else array
