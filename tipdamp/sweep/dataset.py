"""All cases of a sweep as one labelled data set, and as a table."""

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.engine.store import Store
from tipdamp.study.schema import UNITS
from tipdamp.study.swept import DIGITS
from tipdamp.sweep.cases import Case, sheet
from tipdamp.sweep.index import CaseState, Index
from tipdamp.sweep.rows import CurveRow, Row, StressRow

if TYPE_CHECKING:
    import xarray

TABLE, NETCDF = "sweep.csv", "sweep.nc"
OF_CASE = ("kept_pairs", "stuck_hz")
OF_CURVE = ("Fe_N", "H", "complete", "unstable", "slipping_pairs", "ended")
OF_STRESS = ("alternating_Pa", "mean_Pa", "alternating_body", "safety", "safety_body")
OF_PATCH = ("peak_m", "peak_hz", "at_least_m", "at_least_hz", "truncation")
WORDS = ("ended", "alternating_body", "safety_body")
SUFFIXES = {"_m": "m", "_hz": "Hz", "_N": "N", "_Pa": "Pa"}
TEXTS = {
    "kept_pairs": "contact pairs that carry after tuning",
    "stuck_hz": "frequency of the tracked mode, stuck on the kept pairs",
    "Fe_N": "amplitude of the excitation",
    "H": "harmonics",
    "complete": "whether the curve reaches the end of the band",
    "unstable": "whether the largest amplitude is that of an unstable motion",
    "slipping_pairs": "contact pairs that slip or open somewhere on the curve",
    "ended": "why the curve ended",
    "alternating_Pa": "largest alternating stress at the peak of blade 1, of the largest H",
    "mean_Pa": "mean stress at its node",
    "alternating_body": "body of the largest alternating stress",
    "safety": "least safety by Goodman at the peak of blade 1",
    "safety_body": "body of the least safety",
    "peak_m": "largest peak over the nodes of the patch, half of peak-to-peak along the force",
    "peak_hz": "frequency of the peak",
    "at_least_m": "largest amplitude that was solved, where there is no peak",
    "at_least_hz": "its frequency",
    "truncation": "estimated error of the peak by the harmonics left out, relative to it",
}


def dataset(folder: Path) -> "xarray.Dataset":
    """Data set of the sweep in a folder: dimensions case, curve (of a case, by force and harmonics)
    and patch; the keys that vary are coordinates of the cases, with their units.

    What was not computed is nan: of a case that failed, of curves that it does not have, of stress
    that it does not ask for."""
    import xarray

    with Index(folder) as index:
        states, curves, units = index.cases(), index.curves(), index.facts().get("units", {})
        stresses, said = index.stresses(), index.warnings()
    patches = list(dict.fromkeys(row.patch for _, row in curves))
    dims = ("case", "curve", "patch")
    data = {
        name: (
            dims[: values.ndim],
            _plain(values),
            {"units": unit_of(name), "long_name": TEXTS[name]},
        )
        for name, values in _values(states, patches, curves, stresses).items()
    }
    data["state"] = (dims[:1], np.array([one.state for one in states], str), {})
    data["reason"] = (dims[:1], np.array([one.reason for one in states], str), {})
    data["warnings"] = (dims[:1], np.array([_warned(said, one) for one in states], str), {})
    coords = {
        "case": [one.number for one in states],
        "patch": np.array(patches, str),
        **{
            key: ("case", _column([one.case for one in states], key), {"units": units.get(key, "")})
            for key in _keys(states)
        },
    }
    return xarray.Dataset(data, coords)


def _values(
    states: Sequence[CaseState],
    patches: Sequence[str],
    curves: Sequence[tuple[int, CurveRow]],
    stresses: Sequence[tuple[int, StressRow]],
) -> dict[str, np.ndarray]:
    """{name: values over cases, their curves and patches}"""
    at: dict[int, dict[tuple[float, int], int]] = {}
    for number, row in curves:
        at.setdefault(number, {}).setdefault((row.Fe_N, row.H), len(at[number]))
    shape = len(states), max(map(len, at.values()), default=0), len(patches)
    found = {
        **{name: _empty(name, shape[:1]) for name in OF_CASE},
        **{name: _empty(name, shape[:2]) for name in (*OF_CURVE, *OF_STRESS)},
        **{name: _empty(name, shape) for name in OF_PATCH},
    }
    place = {state.number: i for i, state in enumerate(states)}
    for number, row in curves:
        i, k, p = place[number], at[number][row.Fe_N, row.H], patches.index(row.patch)
        _fill(found, row, OF_CASE, (i,))
        _fill(found, row, OF_CURVE, (i, k))
        _fill(found, row, OF_PATCH, (i, k, p))
    for number, stress in stresses:
        k = at[number][stress.Fe_N, stress.H]
        _fill(found, stress, OF_STRESS, (place[number], k))
    return found


def _fill(
    found: Mapping[str, np.ndarray], row: Row, names: Iterable[str], where: tuple[int, ...]
) -> None:
    for name in names:
        value = vars(row)[name]
        if value is not None:
            found[name][where] = value


def _warned(said: Mapping[int, Sequence[str]], one: CaseState) -> str:
    """What the stages of a case warned of, a line each."""
    return "\n".join(said.get(one.number, ()))


def _keys(states: Sequence[CaseState]) -> list[str]:
    return list(dict.fromkeys(key for one in states for key in one.case))


def _empty(name: str, shape: tuple[int, ...]) -> np.ndarray:
    return np.full(shape, "", object) if name in WORDS else np.full(shape, np.nan)


def _plain(values: np.ndarray) -> np.ndarray:
    return values.astype(str) if values.dtype == object else values


def _column(cases: Sequence[Case], key: str) -> np.ndarray:
    """Values of one key: numbers where all are, else as they are written."""
    values = [case.get(key) for case in cases]
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return np.array(values, float)
    return np.array([_written(value) for value in values], str)


def _written(value: Any) -> str:
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)


def _written_out(name: str, value: Any) -> Any:
    """Frequencies round: 1000 Hz at the start of a band, and not 999.9999999999999."""
    round_it = name.endswith("_hz") and value is not None
    return float(f"{value:.{DIGITS}g}") if round_it else value


def unit_of(name: str) -> str:
    """Unit of a column by the end of its name, '1' without one."""
    return next((unit for end, unit in SUFFIXES.items() if name.endswith(end)), "1")


def units_of_keys(keys: Sequence[str], content: dict) -> dict[str, str]:
    """{dotted key: unit in which the study file has it}, of those that have one."""
    chosen = {kind: content.get("units", {}).get(kind, next(iter(UNITS[kind]))) for kind in UNITS}
    length = chosen["length"]
    chosen |= {
        "force/length": f"{chosen['force']}/{length}",
        "force/length3": f"{chosen['force']}/{length}3",
    }
    sheets = {key: sheet(key) for key in keys}
    return {key: chosen[one.unit] for key, one in sheets.items() if one and one.unit in chosen}


def write_table(folder: Path) -> Path:
    """CSV of all curves, a row for each patch; a case that has none has one row with its state."""
    with Index(folder) as index:
        states, curves, units = index.cases(), index.curves(), index.facts().get("units", {})
        stresses, said = index.stresses(), index.warnings()
    of_peak = {(number, row.Fe_N, row.H): asdict(row) for number, row in stresses}
    of_case: dict[int, list[dict]] = {}
    for number, row in curves:
        stress = of_peak.get((number, row.Fe_N, row.H), {})
        of_case.setdefault(number, []).append(asdict(row) | stress)
    keys, columns = _keys(states), ["patch", *OF_CASE, *OF_CURVE, *OF_PATCH, *OF_STRESS]
    head = [f"{key} [{units[key]}]" if key in units else key for key in keys]
    with Store(folder).writing(TABLE) as path:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["case", *head, "state", "reason", "warnings", *columns])
            for one in states:
                values = [_written(one.case.get(key)) for key in keys]
                for numbers in of_case.get(one.number, [{}]):
                    writer.writerow(
                        [one.number, *values, one.state, one.reason, _warned(said, one)]
                        + [_written_out(name, numbers.get(name)) for name in columns]
                    )
    return folder / TABLE


def write_netcdf(folder: Path) -> Path | None:
    """The data set as netCDF, which every version of it reads; None where xarray is not there."""
    try:
        found = dataset(folder)
    except ModuleNotFoundError as error:
        if error.name != "xarray":
            raise
        return None
    with Store(folder).writing(NETCDF) as path:
        found.to_netcdf(path, engine="scipy")
    return folder / NETCDF
