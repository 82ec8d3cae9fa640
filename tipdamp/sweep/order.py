"""The order in which cases are made: each beginning of it is spread over the values of all keys, so
that what the first cases took tells of the rest, whatever order the study names the values in."""

import json
from collections.abc import Sequence
from numbers import Real

import numpy as np

from tipdamp.sweep.cases import Case


def places(cases: Sequence[Case]) -> np.ndarray:
    """(cases, keys) within -1/2 and 1/2: where the value of each key stands among all its values,
    numbers by their size, others as they come."""
    columns = [_ranks([case[key] for case in cases]) for key in cases[0]]
    return np.stack([(rank + 0.5) / (rank.max() + 1) - 0.5 for rank in columns], axis=1)


def _ranks(values: list) -> np.ndarray:
    if all(isinstance(value, Real) for value in values):
        return np.unique(np.array(values, dtype=float), return_inverse=True)[1]
    known: dict[str, int] = {}
    return np.array([known.setdefault(json.dumps(value), len(known)) for value in values])


def order_of_work(place: np.ndarray) -> np.ndarray:
    """(cases,) their numbers in an order of which each beginning is spread over all places (cases,
    keys). The cases share the points of a sequence of low discrepancy in the unit cube among
    themselves, key by key by their ranks, and come in its order. [Roberts, The unreasonable
    effectiveness of quasirandom sequences (2018): multiples of powers of the root of x^(d+1) =
    x + 1]"""
    cases, keys = place.shape
    root = max(np.roots([1.0, *[0.0] * (keys - 1), -1.0, -1.0]).real)
    points = (0.5 + np.outer(np.arange(cases), root ** -np.arange(1.0, keys + 1))) % 1
    of_case = of_point = np.zeros(cases, dtype=int)  # of the same values so far
    fewest = sorted(place.T, key=lambda column: len(np.unique(column)))  # the coarsest share first
    for along, across in zip(fewest, points.T, strict=True):
        by_place, by_point = np.lexsort((along, of_case)), np.lexsort((across, of_point))
        other = np.diff(of_case[by_place]) | (np.diff(along[by_place]) != 0)
        group = np.append(0, np.cumsum(other != 0))
        of_case, of_point = np.empty_like(group), np.empty_like(group)
        of_case[by_place], of_point[by_point] = group, group
    turn = np.empty(cases, dtype=int)
    turn[np.argsort(of_case, kind="stable")] = np.argsort(of_point, kind="stable")
    return np.argsort(turn)
