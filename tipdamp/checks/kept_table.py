"""A user's own table of kept pairs: read, never written to."""

from pathlib import Path

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.study.view import Study

# columns that count; the geometry is that of the study's pairs
TAKEN = ("kn", "kt", "mu", "preload", "weight")
SAME = 0.01  # of a length or unit vector: digits that a spreadsheet leaves
ROUNDING = 1e-9  # of the contact's size: the gap of surfaces that touch is rounding
IDENTITY = ("side", "blade_body", "blade_node", "damper_body", "damper_node")


def read(study: Study, pairs: ContactTable) -> ContactTable:
    """The pairs (P,) with the values of the table [tune] kept, in any order of its rows; those
    without a row are detached. Raises InputError where the table names a pair that the study does
    not have, or one twice."""
    path = study.file(study.tune.kept)
    own = ContactTable.load(path)
    place = {key: i for i, key in enumerate(_keys(pairs))}
    rows: list[int] = []
    for line, key in enumerate(_keys(own)):
        where = (
            f"{path}, row {line + 1}: side '{key[0]}', {key[1]} node {key[2]}, {key[3]} node "
            f"{key[4]}"
        )
        if key not in place:
            raise InputError(
                f"{where}: the study has no such pair; copy the rows of kept.csv in the results "
                "folder"
            )
        if place[key] in rows:
            raise InputError(f"{where}: is there twice")
        rows.append(place[key])
    _check_geometry(path, own, pairs.select(rows))
    columns = {name: vars(pairs)[name].copy() for name in TAKEN}
    columns["weight"] = np.zeros(len(pairs))
    for name in TAKEN:
        columns[name][rows] = vars(own)[name]
    return pairs.replace(**columns)


def _check_geometry(path: Path, own: ContactTable, pairs: ContactTable) -> None:
    """InputError where columns that are not taken were changed: the change would count for
    nothing."""
    size = float(np.ptp(pairs.position, axis=0).max(initial=0.0))
    off = {
        "station": own.station != pairs.station,
        "row": own.row != pairs.row,
        "x, y, z": np.abs(own.position - pairs.position).max(axis=1) > SAME * size,
        **{
            name: np.abs(own.frame[:, k] - pairs.frame[:, k]).max(axis=1) > SAME
            for k, name in enumerate(("t1", "t2", "n"))
        },
        **{
            name: np.abs(vars(own)[name] - vars(pairs)[name])
            > SAME * np.abs(vars(pairs)[name]) + ROUNDING * unit
            for name, unit in (("gap", size), ("area", size**2))
        },
    }
    for name, changed in off.items():
        if changed.any():
            i = int(changed.argmax())
            raise InputError(
                f"{path}, row {i + 1}: side '{own.side[i]}', station {own.station[i]}: {name} is "
                f"not that of the study's pair: a kept table changes {', '.join(TAKEN)} alone; "
                f"copy {name} from kept.csv in the results folder, or change it in [contact]"
            )


def _keys(pairs: ContactTable) -> list[tuple]:
    return list(zip(*(vars(pairs)[name].tolist() for name in IDENTITY), strict=True))
