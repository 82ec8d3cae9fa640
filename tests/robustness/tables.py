"""Tables that a person has edited."""

import numpy as np

from tests.robustness.rows import accepted, cells, chain, refused, row
from tests.tipdamp.rig_study import CHAIN
from tipdamp.hbm.contact import ContactTable


def pairs(folder, **change):
    """The study of pairs with other columns: {name: f(table)}."""
    study = chain(folder)
    path = folder / "pairs.csv"
    own = ContactTable.load(path)
    own.replace(**{name: value(own) for name, value in change.items()}).save(path)
    return study


def text(folder, change):
    """The study with another text of its pairs, line by line: change(number, line)."""
    study, path = chain(folder), folder / "pairs.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join(change(i, line) for i, line in enumerate(lines, 1)) + "\n")
    return study


def _again(i, line):
    """The pair of line 4 a second time, in another row."""
    side, station, _, rest = line.split(",", 3)
    return f"{line}\n{side},{station},77,{rest}" if i == 4 else line


@row("x13", "decimal commas, columns there twice, rows cut off in a table of pairs", "E, S")
def edited(folder):
    yield refused(cells(chain(folder), "mu", "0,3"), r"line 2: has 26 fields.*mu = '0,3' meant")
    yield refused(
        cells(chain(folder), "kn", '"3,5"'),
        r"line 2: kn = '3,5' is not a number: write a decimal point",
    )
    yield refused(cells(chain(folder), "kn", "1_000"), r"line 2: kn = '1_000' is not a number")
    yield refused(
        text(folder, _again),
        "is there twice .pairs 3 and 4; 1 such.; its stiffness would count twice",
    )
    yield refused(
        text(folder, lambda i, line: line + (",kn" if i == 1 else ",1e3")),
        "column 'kn' is there twice",
    )
    yield refused(
        text(folder, lambda i, line: line.rsplit(",", 2)[0] if i == 4 else line),
        "line 4: has 23 fields",
    )
    accepted(text(folder, lambda i, line: line.replace(",", ";").replace(".", ",")))
    yield "semicolons with decimal commas, as spreadsheets of some countries write them, are read"


@row("x14", "pairs that contradict the model: partners, places, normals", "E")
def contradicting(folder):
    yield refused(
        pairs(folder, blade_node=lambda p: p.blade_node[[2, 1, 0, 3, 4, 5]]), "partners mixed up"
    )
    yield refused(pairs(folder, position=lambda p: 1e3 * p.position), "given in mm")
    yield refused(
        pairs(folder, position=lambda p: p.position + [3e-3, 0, 0]), "0.003 m off its nodes"
    )
    turn = np.array([[1], [-1], [-1]])
    yield refused(
        pairs(folder, frame=lambda p: np.where(p.station[:, None, None] == 1, turn, 1) * p.frame),
        "points against that of its neighbour",
    )


@row("x15", "a kept table with other normals, or ten times the preload that the pull can hold", "E")
def kept(folder):
    study = chain(folder)
    for verb in ("inspect", "reduce", "preload", "tune"):
        accepted(study, verb)
    made = ContactTable.load(folder / "results" / "study" / "kept.csv")
    study.write_text(CHAIN.replace("stations = [1, 1]", 'kept = "kept.csv"'))
    made.replace(frame=made.frame * [[1], [-1], [-1]]).save(folder / "kept.csv")
    yield refused(study, "t2 is not that of the study's pair", verb="tune")
    made.replace(preload=10 * made.preload).save(folder / "kept.csv")
    yield refused(study, "friction can hold", verb="tune")
