"""Table: the named points of the curves, with what their kinds mean."""

from collections.abc import Iterator, Sequence

from tipdamp.hbm.named_point import Kind
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import MICRO, NOTHING, names_of_pairs, number
from tipdamp.results.response_results import CurveResult, NamedPlace

ONE_BY_ONE = 3  # points of a kind on a curve, at most, with a row each
MEANING: dict[Kind, str] = {
    "fold": "the curve turns back, and jumps begin there",
    "symmetry breaking": "from there other curves lead on, of motions that lost a symmetry",
    "branch point": "other curves meet this one there",
    "period doubling": "motions of twice the period begin there",
    "Neimark-Sacker": "motions begin there that do not repeat",
    "grazing": "multipliers jump, as a contact touches or begins to slip",
    "onset of slip": "a contact begins to slip, or ceases to, somewhere in the cycle",
    "lift-off": "a contact begins to open, or ceases to, for a part of the cycle",
    "separation": (
        "a contact comes to be open through the whole cycle, or begins to close again; of one that "
        "is open at rest, where it first touches"
    ),
}


def table(results: Results) -> Iterator[Table]:
    """One row for each point of the curves of most harmonics and of those found beside them, or
    one for many of a kind."""
    curves = [case.facts for case in results.finest]
    places = [(facts, "", facts.named) for facts in curves]
    places += [(facts, one.ends, one.named) for facts in curves for one in facts.beside]
    there = {one.kind for _, _, named in places for one in named}
    if not there:
        return
    words = (
        f"{kind[:1].upper()}{kind[1:]}: {text}." for kind, text in MEANING.items() if kind in there
    )
    rows = [row for place in places for row in _rows(*place)]
    beside = any(row["further curve"] for row in rows)
    if not beside:
        rows = [{k: v for k, v in row.items() if k != "further curve"} for row in rows]
    yield Table(
        "Named points of each curve, kind by kind, with the largest amplitude over the patch of "
        f"blade 1; more than {ONE_BY_ONE} of a kind stand in one row with the range that they "
        "span. summary.json has them all. " + " ".join(words),
        rows,
        left=(2, 3, 7) if beside else (2, 6),
    )


def _rows(facts: CurveResult, curve: str, named: Sequence[NamedPlace]) -> Iterator[dict[str, str]]:
    for kind in dict.fromkeys(one.kind for one in named):
        alike = [one for one in named if one.kind == kind]
        groups = [[one] for one in alike] if len(alike) <= ONE_BY_ONE else [alike]
        for group in groups:
            yield _row(facts, curve, kind, group)


def _row(facts: CurveResult, curve: str, kind: Kind, group: Sequence[NamedPlace]) -> dict[str, str]:
    pairs = list(dict.fromkeys(one.pair for one in group if one.pair))
    return {
        "H": f"{facts.H}",
        "Fe (N)": f"{facts.Fe_N:g}",
        "further curve": curve,
        "kind": kind,
        "points": f"{len(group)}",
        "frequency (Hz)": _span([f"{hz:.2f}" for hz in sorted(one.hz for one in group)]),
        "amplitude (µm)": _span(
            [number(height, 4, MICRO) for height in sorted(one.largest_m for one in group)]
        ),
        "pairs": names_of_pairs(pairs) if pairs else NOTHING,
    }


def _span(ascending: Sequence[str]) -> str:
    first, last = ascending[0], ascending[-1]
    return first if first == last else f"{first} to {last}"
