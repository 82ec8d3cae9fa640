"""Measured curves as a study names them ([measured.NAME]): files to checked frequency response
functions in m/N."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.measured.damping import check_clipped
from tipdamp.measured.frf import QUANTITIES, Frf, receptance
from tipdamp.measured.universal import from_universal
from tipdamp.readers.columns import Columns, from_matlab, from_text
from tipdamp.study.schema import Measured

TEXT, MATLAB, UNIVERSAL = (".csv", ".txt", ".dat"), (".mat",), (".unv", ".uff", ".uf")
PER_NEWTON = "/N"
FROM_FILE = "from_file"
TURNS = 2.5  # turns of a phase beyond which radians are degrees
MIN_POINTS = 5
LARGEST = 1e30  # SI units: beyond it squares and sums of what follows overflow
SAME_LEVEL = 0.02  # relative difference of two forces that count as one level
HELD_FORCE = 0.1  # variation of a measured force over the frequencies beyond which it is no level


def read_measured(files: list[Path], settings: Measured) -> tuple[list[Frf], list[str]]:
    """The repeats of one measured curve, and warnings.

    Raises InputError with file, line or dataset, value and remedy.
    """
    found, warnings = [], []
    for path in files:
        if not path.is_file():
            raise InputError(f"measured curve not found: {path}")
        for frf, said in _read(path, settings):
            found.append(frf)
            warnings += said
    low, high = min(found, key=lambda f: f.force_N), max(found, key=lambda f: f.force_N)
    if high.force_N > (1 + SAME_LEVEL) * low.force_N:
        raise InputError(
            f"repeats at different levels: {low.source} at {low.force_N:.4g} N, {high.source} at "
            f"{high.force_N:.4g} N; give each level a curve of its own"
        )
    return found, warnings


def _read(path: Path, settings: Measured) -> list[tuple[Frf, list[str]]]:
    kind = path.suffix.lower()
    if kind in UNIVERSAL:
        return [_from_universal(settings, *one) for one in from_universal(path, settings.records)]
    if kind not in (*TEXT, *MATLAB):
        raise InputError(
            f"{path}: unknown kind of file; allowed: {', '.join((*TEXT, *MATLAB, *UNIVERSAL))}"
        )
    for key in ("columns", "quantity", "unit"):
        if dict(settings)[key] in ((), "", FROM_FILE):
            raise InputError(f"{path}: {key} is missing: {Measured.data_sheets()[key].text}")
    read = from_matlab if kind in MATLAB else from_text
    return [_from_columns(settings, columns) for columns in read(path, settings.columns)]


def _from_universal(
    settings: Measured,
    stated: str,
    hz: np.ndarray,
    response: np.ndarray,
    source: str,
    label: str,
    to_si: float,
) -> tuple[Frf, list]:
    if stated and settings.quantity not in (FROM_FILE, stated):
        raise InputError(f"{source}: holds the {stated}, the study says {settings.quantity}")
    quantity = stated if settings.quantity == FROM_FILE else settings.quantity
    if not quantity:
        raise InputError(
            f"{source}: does not say what was measured; state quantity = "
            f"{', '.join(map(repr, QUANTITIES))}"
        )
    places = tuple(f"point {k}" for k in range(1, len(hz) + 1))
    factor = to_si
    per_newton = True
    if settings.unit:
        factor, per_newton = _unit(settings, quantity)
    elif label:
        factor = _labelled(label, quantity, source)
    if not per_newton:
        raise InputError(
            f"{source}: a frequency response function is per newton; unit = '{settings.unit}/N'"
        )
    level = _level(settings, source)
    hz, response, _, said = _checked(hz, factor * response, np.full(len(hz), level), places, source)
    return Frf(hz, receptance(quantity, hz, response), level, source, _clipped(hz, response)), said


def _labelled(label: str, quantity: str, source: str) -> float:
    """Factor to SI by the label of the units in the file."""
    units = QUANTITIES[quantity][1]
    name = label.replace("^", "").replace("**", "").removesuffix(PER_NEWTON)
    if name not in units:
        raise InputError(
            f"{source}: its values are labelled '{label}'; state unit = one of "
            f"{', '.join(u + PER_NEWTON for u in units)}"
        )
    return units[name]


def _clipped(hz: np.ndarray, response: np.ndarray) -> str:
    """Why the signal, as it was measured, has no peak; empty where it has."""
    try:
        check_clipped(hz, np.abs(response))
    except InputError as error:
        return str(error)
    return ""


def _from_columns(settings: Measured, columns: Columns) -> tuple[Frf, list[str]]:
    values, source = columns.values, columns.source
    hz = (
        values["frequency_hz"]
        if "frequency_hz" in values
        else values["frequency_rad_s"] / (2 * np.pi)
    )
    response, said = _response(values, source)
    factor, per_newton = _unit(settings, settings.quantity)
    measured_force = "force" in values
    if per_newton and measured_force:
        raise InputError(
            f"{source}: unit = '{settings.unit}' is per newton, yet a column holds the force; "
            "leave one of the two out"
        )
    force = values["force"] if measured_force else np.full(len(hz), _level(settings, source))
    hz, response, force, more = _checked(hz, factor * response, force, columns.places, source)
    clipped, level = _clipped(hz, response), settings.level or float(np.median(force))
    spread = np.abs(force / level - 1).max()
    if spread > HELD_FORCE:
        more.append(
            f"{source}: the force differs from the level of {level:.4g} N by up to "
            f"{100 * spread:.0f} %"
        )
    if not per_newton:
        response = response / force
    return Frf(hz, receptance(settings.quantity, hz, response), level, source, clipped), said + more


def _level(settings: Measured, source: str) -> float:
    if settings.level is None:
        raise InputError(
            f"{source}: level is missing: the amplitude of the force in N is not in the file"
        )
    return settings.level


def _unit(settings: Measured, quantity: str) -> tuple[float, bool]:
    """Factor to SI, and whether the values are per newton."""
    units = QUANTITIES[quantity][1]
    name = settings.unit.removesuffix(PER_NEWTON)
    if name not in units:
        raise InputError(
            f"unit = '{settings.unit}': not a unit of a {quantity}; allowed: "
            f"{', '.join(units)}, each per newton with {PER_NEWTON}"
        )
    return units[name], settings.unit.endswith(PER_NEWTON)


def _response(values: dict[str, np.ndarray], source: str) -> tuple[np.ndarray, list]:
    """Complex, or real without a phase."""
    if "complex" in values:
        return values["complex"], []
    if "real" in values:
        return values["real"] + 1j * values["imaginary"], []
    amplitude = values["amplitude"]
    if (amplitude < 0).any():
        raise InputError(
            f"{source}: negative amplitude {amplitude.min():g}; values in dB are not read"
        )
    if "phase_deg" in values:
        phase = values["phase_deg"]
        small = np.nanmax(np.abs(phase)) <= 2 * np.pi
        said = (
            [f"{source}: phase_deg stays within {np.nanmax(np.abs(phase)):.3g} degrees: radians?"]
            if small
            else []
        )
        return amplitude * np.exp(1j * np.radians(phase)), said
    if "phase_rad" in values:
        phase = values["phase_rad"]
        if np.nanmax(np.abs(phase)) > TURNS * 2 * np.pi:
            raise InputError(
                f"{source}: phase_rad reaches {np.nanmax(np.abs(phase)):g}: these are degrees, "
                "phase_deg"
            )
        return amplitude * np.exp(1j * phase), []
    return amplitude, []


def _checked(
    hz: np.ndarray, response: np.ndarray, force: np.ndarray, places: Sequence[str], source: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    """Rows that are no numbers are left out, unsorted ones sorted, with a warning each; all else is
    refused."""
    said = []
    good = np.isfinite(hz) & np.isfinite(response) & np.isfinite(force)
    if not good.all():
        bad = [places[k] for k in np.flatnonzero(~good)]
        said.append(
            f"{source}: {len(bad)} rows are no numbers and are left out ({', '.join(bad[:3])})"
        )
    places = [places[k] for k in np.flatnonzero(good)]
    hz, response, force = hz[good], response[good], force[good]
    if len(hz) < MIN_POINTS:
        left = f"; {(~good).sum()} rows are no numbers" if not good.all() else ""
        raise InputError(f"{source}: {len(hz)} points, at least {MIN_POINTS} are needed{left}")
    _check_sizes(hz, response, force, places, source)
    if (np.diff(hz) < 0).any():
        said.append(f"{source}: the frequencies do not ascend; the rows are sorted")
    order = np.argsort(hz, kind="stable")
    twice = np.flatnonzero(np.diff(hz[order]) == 0)
    if len(twice):
        first, second = places[order[twice[0]]], places[order[twice[0] + 1]]
        raise InputError(
            f"{source}: {hz[order[twice[0]]]:g} Hz stands twice ({first} and {second}); give "
            "repeats as files of their own"
        )
    return hz[order], response[order], force[order], said


def _check_sizes(
    hz: np.ndarray, response: np.ndarray, force: np.ndarray, places: Sequence[str], source: str
) -> None:
    """InputError for a number that no measurement has."""
    for what, unit, values in (("frequency", "Hz", hz), ("force", "N", force)):
        if (values <= 0).any():
            raise InputError(
                f"{source}: {places[int(values.argmin())]}: {what} {values.min():g} {unit}, must "
                "be above 0"
            )
    size = np.abs(response)
    if (size > LARGEST).any():
        k = int(size.argmax())
        raise InputError(
            f"{source}: {places[k]}: amplitude {size[k]:.3g} in SI units at {hz[k]:g} Hz, which "
            "nothing measures; leave the row out, or check the columns and the unit"
        )
