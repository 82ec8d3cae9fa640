"""Beams on unilateral supports: support forces and detached sets in closed form."""

import numpy as np

from tests.static_contact.beams import reference_beam
from tests.validation import Subject, row


def rows():
    for name in ("F1-beam-two-end-loads", "F2-beam-31-crowned"):
        found, known = reference_beam(name)
        yield row(f"{name[:2]}, residual", max(found.residual, found.balance), 0.0, "balance", 1.0)
        for i, (ours, r) in enumerate(zip(found.force, known["r"], strict=True)):
            yield row(f"{name[:2]}, support {i + 1}, N", ours, r, "closed form", max(known["r"]))
        detached = np.isin(np.arange(len(found.force)), known["detached_indices"])
        yield row(
            f"{name[:2]}, detached supports", found.pairs.preload < 0, detached, "detached set", 1.0
        )


SUBJECT = Subject(
    "Beams on unilateral supports",
    "Support forces of two beams; errors are of the largest force. "
    "Source: tests/reference/statics, F1 and F2.",
    rows,
    {"closed form": 1e-8, "detached set": 0.0, "balance": 1e-9},
)
