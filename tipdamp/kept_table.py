"""A user's own table of kept pairs: read, never written to."""

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError
from tipdamp.study.view import Study

TAKEN = ("kn", "kt", "mu", "preload", "weight")        # columns that count; the geometry is that of the study's pairs
IDENTITY = ("side", "blade_body", "blade_node", "damper_body", "damper_node")


def read(study: Study, pairs: ContactTable) -> ContactTable:
    """The pairs (P,) with the values of the table [tune] kept, in any order of its rows; those without a row are
    detached. Raises InputError where the table names a pair that the study does not have, or one twice."""
    path = study.file(study.tune.kept)
    own = ContactTable.load(path)
    place = {key: i for i, key in enumerate(_keys(pairs))}
    rows: list[int] = []
    for line, key in enumerate(_keys(own)):
        where = f"{path}, row {line + 1}: side '{key[0]}', {key[1]} node {key[2]}, {key[3]} node {key[4]}"
        if key not in place:
            raise InputError(f"{where}: the study has no such pair; copy the rows of kept.csv in the results folder")
        if place[key] in rows:
            raise InputError(f"{where}: is there twice")
        rows.append(place[key])
    columns = {name: vars(pairs)[name].copy() for name in TAKEN}
    columns["weight"] = np.zeros(len(pairs))
    for name in TAKEN:
        columns[name][rows] = vars(own)[name]
    return pairs.replace(**columns)


def _keys(pairs):
    return list(zip(*(vars(pairs)[name].tolist() for name in IDENTITY), strict=True))
