"""Craig-Bampton reduction of a bar and a beam: frequencies, and the bound of their error."""

from tests.modal.test_g1_bar_beam import table
from tests.validation import Row, Subject, row


def rows():
    for name, order in (("bar", 1), ("beam", 2)):
        for known, omega, told, error, bound, _ in table(name, order):
            case = f"{name}, tip spring {known['kappa']:g}, {known['N']} modes"
            for k, (ours, value) in enumerate(zip(omega, told, strict=False), start=1):
                yield row(f"{case}, frequency {k}", ours, value, "table")
            for k, (mine, most) in enumerate(zip(error, bound, strict=True), start=1):
                yield Row(
                    f"{case}, error of frequency {k}",
                    mine,
                    most,
                    max(mine - most, 0.0),
                    "beyond its bound",
                )


SUBJECT = Subject(
    "Craig-Bampton of a bar and a beam",
    "omega of each mode, and the bound of its error. Source: tests/reference/modal/G1.",
    rows,
    {"table": 1e-8, "beyond its bound": 0.0},
)
