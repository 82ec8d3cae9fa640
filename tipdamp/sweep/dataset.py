"""All cases of a sweep as one labelled data set, and as a table."""

import csv
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

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
# {name: what it is} of the numbers of each case, curve, patch of a curve, and peak of a curve
OF_CASE = {
    "kept_pairs": "contact pairs that carry after tuning",
    "stuck_hz": "frequency of the tracked mode, stuck on the kept pairs",
}
OF_CURVE = {
    "Fe_N": "amplitude of the excitation",
    "H": "harmonics",
    "complete": "whether the curve reaches the end of the band",
    "unstable": "whether the largest amplitude is that of an unstable motion",
    "slipping_pairs": "contact pairs that slip or open somewhere on the curve",
    "ended": "why the curve ended",
}
OF_PATCH = {
    "peak_m": "largest peak over the nodes of the patch, half of peak-to-peak along the force",
    "peak_hz": "frequency of the peak",
    "at_least_m": "largest amplitude that was solved, where there is no peak",
    "at_least_hz": "its frequency",
    "truncation": "estimated error of the peak by the harmonics left out, relative to it",
}
OF_STRESS = {
    "alternating_Pa": "largest alternating stress at the peak of blade 1, of the largest H",
    "mean_Pa": "mean stress at its node",
    "alternating_body": "body of the largest alternating stress",
    "safety": "least safety by Goodman at the peak of blade 1",
    "safety_body": "body of the least safety",
}
TEXTS = OF_CASE | OF_CURVE | OF_PATCH | OF_STRESS
WORDS = ("ended", "alternating_body", "safety_body")
SUFFIXES = {"_m": "m", "_hz": "Hz", "_N": "N", "_Pa": "Pa"}
DIMENSIONS = ("case", "curve", "patch")


class _OfCases(NamedTuple):
    """Of the index of a sweep: what its cases are, and what they have left, by their numbers."""

    states: list[CaseState]
    curves: list[tuple[int, CurveRow]]
    stresses: list[tuple[int, StressRow]]
    warnings: dict[int, list[str]]
    units: dict[str, str]

    @property
    def keys(self) -> list[str]:
        """Those that vary."""
        return list(dict.fromkeys(key for one in self.states for key in one.case))

    def told(self, one: CaseState) -> dict[str, str]:
        """How a case went, and what its stages warned of, a line each."""
        said = "\n".join(self.warnings.get(one.number, ()))
        return {"state": one.state, "reason": one.reason, "warnings": said}


def _content(folder: Path) -> _OfCases:
    with Index(folder) as index:
        return _OfCases(
            index.cases(),
            index.curves(),
            index.stresses(),
            index.warnings(),
            index.facts().get("units", {}),
        )


def dataset(folder: Path) -> "xarray.Dataset":
    """Data set of the sweep in a folder: dimensions case, curve (of a case, by force and harmonics)
    and patch; the keys that vary are coordinates of the cases, with their units.

    What was not computed is nan: of a case that failed, of curves that it does not have, of stress
    that it does not ask for."""
    import xarray

    found = _content(folder)
    patches = list(dict.fromkeys(row.patch for _, row in found.curves))
    data = {
        name: (
            DIMENSIONS[: values.ndim],
            _plain(values),
            {"units": unit_of(name), "long_name": TEXTS[name]},
        )
        for name, values in _values(found, patches).items()
    }
    told = [found.told(one) for one in found.states]
    for name in ("state", "reason", "warnings"):
        data[name] = ("case",), np.array([one[name] for one in told], str), {}
    cases = [one.case for one in found.states]
    coords = {
        "case": [one.number for one in found.states],
        "patch": np.array(patches, str),
        **{
            key: ("case", _column(cases, key), {"units": found.units.get(key, "")})
            for key in found.keys
        },
    }
    return xarray.Dataset(data, coords)


def _values(found: _OfCases, patches: Sequence[str]) -> dict[str, np.ndarray]:
    """{name: values over cases, their curves and patches}"""
    place = {state.number: i for i, state in enumerate(found.states)}
    at: dict[int, dict[tuple[float, int], int]] = {}
    for number, row in found.curves:
        at.setdefault(number, {}).setdefault((row.Fe_N, row.H), len(at[number]))
    shape = len(place), max(map(len, at.values()), default=0), len(patches)
    values = {
        name: _empty(name, shape[:dimensions])
        for names, dimensions in ((OF_CASE, 1), (OF_CURVE | OF_STRESS, 2), (OF_PATCH, 3))
        for name in names
    }
    for number, row in found.curves:
        where = place[number], at[number][row.Fe_N, row.H], patches.index(row.patch)
        _fill(values, row, OF_CASE | OF_CURVE | OF_PATCH, where)
    for number, stress in found.stresses:
        where = place[number], at[number][stress.Fe_N, stress.H], 0
        _fill(values, stress, OF_STRESS, where)
    return values


def _fill(
    values: Mapping[str, np.ndarray], row: Row, names: Iterable[str], where: tuple[int, ...]
) -> None:
    for name in names:
        value, into = vars(row)[name], values[name]
        if value is not None:
            into[where[: into.ndim]] = value


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
    if isinstance(value, str):
        return value
    return "" if value is None else json.dumps(value)


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
    with Store(folder).writing(TABLE) as path:
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(_rows(_content(folder)))
    return folder / TABLE


def _rows(found: _OfCases) -> Iterator[list]:
    """The titles, then case by case."""
    columns = ["patch", *TEXTS]
    keys, units = found.keys, found.units
    titles = [f"{key} [{units[key]}]" if key in units else key for key in keys]
    yield ["case", *titles, "state", "reason", "warnings", *columns]
    of_peak = {(number, row.Fe_N, row.H): asdict(row) for number, row in found.stresses}
    of_case: dict[int, list[dict]] = {}
    for number, row in found.curves:
        stress = of_peak.get((number, row.Fe_N, row.H), {})
        of_case.setdefault(number, []).append(asdict(row) | stress)
    for one in found.states:
        case = [one.number, *(_written(one.case.get(key)) for key in keys)]
        for numbers in of_case.get(one.number, [{}]):
            values = (_written_out(name, numbers.get(name)) for name in columns)
            yield [*case, *found.told(one).values(), *values]


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
