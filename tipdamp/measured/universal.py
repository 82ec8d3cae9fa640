"""Frequency response functions from and to universal files, dataset 58 in the units of dataset 164
(SDRC; by pyuff)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tipdamp.hbm.errors import InputError

FUNCTION, UNITS, FACTOR = 58, 164, "factor to SI"
FRF_TYPE, FORCE = 4, 13  # func_type and specific data type of dataset 58
DISPLACEMENT, FREQUENCY, COMPLEX_DOUBLE, UNEVEN = 8, 18, 6, 0
MOTIONS = {DISPLACEMENT: "receptance", 11: "mobility", 12: "accelerance"}


class FrfAt(NamedTuple):
    """A receptance between two nodes.

    title; hz (n,); response (n,) complex m/N; response_node, force_node - numbers; direction of
    both: 1, 2, 3 along x, y, z, negative against it, 0 another
    """

    title: str
    hz: np.ndarray
    response: np.ndarray
    response_node: int
    force_node: int
    direction: int


def write_universal(path: Path, functions: Sequence[FrfAt]) -> Path:
    """A dataset 58 for each, SI units, at its own frequencies; these have the 6 digits of the
    format, the values 12. Replaces a file that is there."""
    import pyuff

    path.unlink(missing_ok=True)
    file = pyuff.UFF(str(path))
    for one in functions:
        file.write_sets(
            pyuff.prepare_58(
                binary=0,
                id1=one.title,
                func_type=FRF_TYPE,
                rsp_ent_name="NONE",
                rsp_node=one.response_node,
                rsp_dir=one.direction,
                ref_ent_name="NONE",
                ref_node=one.force_node,
                ref_dir=one.direction,
                ord_data_type=COMPLEX_DOUBLE,
                abscissa_spacing=UNEVEN,
                abscissa_spec_data_type=FREQUENCY,
                abscissa_axis_units_lab="Hz",
                ordinate_spec_data_type=DISPLACEMENT,
                ordinate_axis_units_lab="m",
                orddenom_spec_data_type=FORCE,
                orddenom_axis_units_lab="N",
                x=one.hz,
                data=one.response,
            ),
            mode="add",
        )
    return path


def from_universal(
    path: Path, records: tuple[int, ...]
) -> list[tuple[str, np.ndarray, np.ndarray, str, str, float]]:
    """[(quantity or '' where the file does not say, hz (n,), response (n,) in the units of the
    file, source, label of these units or '', factor to SI by dataset 164 before it, 1 without
    one)].

    records - positions from 1 among the datasets 58; default: all, which must be of one response
    and reference
    Raises InputError with what the file holds.
    """
    found = _datasets(path)
    for k in records:
        if k > len(found):
            raise InputError(
                f"{path}: records: there is no dataset 58 number {k}, the file has {len(found)}"
            )
    chosen = {k: found[k - 1] for k in records or range(1, len(found) + 1)}
    places = {k: _place(d) for k, d in chosen.items()}
    if not records and len(set(places.values())) > 1:
        listing = "; ".join(f"{k}: {place}" for k, place in list(places.items())[:12])
        raise InputError(
            f"{path}: holds responses of several places ({listing}); choose by records = [...]"
        )
    return [
        (
            _quantity(path, k, d),
            np.asarray(d["x"], dtype=float),
            np.asarray(d["data"]),
            f"{path}, dataset {k}",
            _label(d),
            d[FACTOR],
        )
        for k, d in chosen.items()
    ]


def _datasets(path: Path) -> list[dict[str, Any]]:
    import pyuff

    try:
        file = pyuff.UFF(str(path))
        found, factor = [], 1.0
        for k, kind in enumerate(file.get_set_types()):
            if kind == UNITS:  # of the datasets that follow; per force
                units = file.read_sets(k)
                factor = units["force"] / units["length"]
            elif kind == FUNCTION:
                found.append({**file.read_sets(k), FACTOR: factor})
    except Exception as error:  # pyuff raises plain Exception on damaged files
        raise InputError(f"{path}: not a readable universal file: {error}") from None
    if not found:
        raise InputError(f"{path}: no dataset 58 (function at nodal dof)")
    if not all(np.isfinite(d[FACTOR]) and d[FACTOR] > 0 for d in found):
        raise InputError(f"{path}: dataset 164 has no positive factors of length and force")
    for k, d in enumerate(found, 1):
        if "x" not in d or "data" not in d or len(d["x"]) != len(d["data"]):
            raise InputError(f"{path}: dataset {k} is cut off")
    return found


def _place(d: dict[str, int | str]) -> str:
    return (
        f"node {d.get('rsp_node', '?')} direction {d.get('rsp_dir', '?')}, force at node "
        f"{d.get('ref_node', '?')}"
    )


def _label(d: dict[str, int | str]) -> str:
    """As the file has it: NONE and blanks say nothing."""
    label = str(d.get("ordinate_axis_units_lab", "")).strip()
    return "" if label.upper() == "NONE" else label


def _quantity(path: Path, k: int, d: Any) -> str:
    if d.get("func_type") != FRF_TYPE:
        raise InputError(
            f"{path}: dataset {k} is a function of type {d.get('func_type')}, not a frequency "
            f"response function (type {FRF_TYPE})"
        )
    if d.get("orddenom_spec_data_type") not in (FORCE, 0):
        raise InputError(
            f"{path}: dataset {k} is not per excitation force (denominator of type "
            f"{d.get('orddenom_spec_data_type')})"
        )
    return MOTIONS.get(d.get("ordinate_spec_data_type"), "")
