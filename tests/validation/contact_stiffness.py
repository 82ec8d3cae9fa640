"""Contact stiffness: ten reference cases, limits of the rounded punch, slopes of the approach,
rectangles."""

import numpy as np

from tests.static_contact.stiffness.test_rectangular_punch import FRESH
from tests.static_contact.stiffness.test_reference import CASES, ROUTES
from tests.static_contact.stiffness.test_rounded_punch import (
    FLATS,
    punch_limits,
    slope_and_stiffness,
)
from tests.validation import Subject, row
from tipdamp.static_contact.stiffness import rectangular_punch_bem
from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair, Stiffness
from tipdamp.static_contact.stiffness.flat_punch import rectangle_compliance


def rows():
    for name, case in CASES.items():
        i = case["inputs"]
        found = ROUTES[case["kind"]](MaterialPair(i["E1_Pa"], i["nu1"], i["E2_Pa"], i["nu2"]), i)
        for output, expected in case["outputs"].items():
            yield row(
                f"{name}, {output}",
                found[output],
                expected,
                "case, in its tolerances",
                case["rel_tol"] * abs(expected),
            )
    for name, ours, expected in punch_limits():
        for x, (mine, told) in enumerate(
            zip(np.atleast_1d(ours), np.atleast_1d(expected), strict=True), start=1
        ):
            yield row(
                f"{name}, place {x}" if np.size(ours) > 1 else name,
                mine,
                told,
                "limit of the punch",
            )
    for b in FLATS:
        for component in Stiffness._fields:
            yield row(
                f"flat half width {b:g} m, {component}: dP/d(delta), N/m per m",
                *slope_and_stiffness(b, component),
                "slope of the approach",
            )
    for aspect, nu in ((1.0, 0.3), *FRESH, (5000.0, 0.3)):
        fresh = rectangular_punch_bem.compliance(aspect, nu, meshes=(8, 12, 16, 24))[0]
        for name, ours, told in zip(
            ("normal and along", "across"), rectangle_compliance(aspect, nu), fresh, strict=True
        ):
            yield row(
                f"rectangle {aspect:g} : 1, nu {nu:g}, {name}",
                ours,
                told,
                "boundary elements, solved anew",
            )


SUBJECT = Subject(
    "Contact stiffness",
    "Ten reference cases (tests/reference/stiffness), their error in units of the tolerance that "
    "the case states; the rounded punch as its flat or its radius goes to zero; its stiffness "
    "against the numerical derivative of its approach; the table of rectangles against boundary "
    "elements on coarser meshes.",
    rows,
    {"case, in its tolerances": 1.0, "limit": 1e-6, "slope": 1e-10, "boundary elements": 1e-5},
)
