"""Tables that a person has edited: what does not fit its header, the model or the pull is refused,
and named."""

import re

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import CHAIN, write_chain
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.dof_table import read_dofs
from tipdamp.hbm.model import ReducedModel
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.study import load_study

TUNED_BY_TABLE = ("[tune]\nstations = [1, 1]\n", '[tune]\nkept = "kept.csv"\n')
OWN = (
    ("mu = 0.3\n", 'pairs = "own.csv"\n'),
    *(
        (f'blade = "touch_{side}"\ndamper = "face_{axis}"\n', "")
        for side, axis in (("one", "x"), ("two", "z"))
    ),
    *(("kn = 1e6\nkt = 1e6\n", ""),) * 2,
)


def lines(path):
    return [line.split(",") for line in path.read_text().splitlines()]


def write(path, rows, mark=","):
    path.write_text("\n".join(mark.join(row) for row in rows) + "\n")


def in_row(change, number):
    """Edit of one row of the text of a table, with its header."""

    def edit(path):
        rows = lines(path)
        rows[number] = change(rows[0], rows[number])
        write(path, rows)

    return edit


def cell(name, text):
    return lambda header, row: [
        text if name == column else old for column, old in zip(header, row, strict=True)
    ]


def table(change):
    """Edit of the table as a program would do it: replaced columns."""

    def edit(path):
        pairs = ContactTable.load(path)
        pairs.replace(**change(pairs)).save(path)

    return edit


def second_column(path):
    write(path, [[*row, "kn" if i == 0 else "3e3"] for i, row in enumerate(lines(path))])


def flipped(pairs, which):
    frame = pairs.frame.copy()
    frame[which, 1:] *= -1
    return frame


def swapped(pairs, side):
    mine, order = pairs.side == side, np.arange(len(pairs))
    order[mine] = order[mine][::-1]
    return pairs.blade_node[order]


EDITS = {
    "a decimal comma in mu": (
        in_row(cell("mu", "0,3"), 2),
        r"pairs.csv, line 3: has \d+ fields.*mu = '0,3' meant",
    ),
    "a second column": (second_column, r"pairs.csv, line 1: column 'kn' is there twice"),
    "a field too few": (
        in_row(lambda _, row: row[:-1], 4),
        r"line 5: has 24 fields.*column 'weight' is missing",
    ),
    "a quoted decimal comma": (
        in_row(cell("kt", '"2,5"'), 1),
        r"line 2: has 25 .*|line 2: kt = '2,5' is not a number",
    ),
    "partners reversed": (
        table(lambda p: {"blade_node": swapped(p, "left")}),
        "pair 1 .*partners mixed up",
    ),
    "neighbours swapped": (
        table(lambda p: {"blade_node": p.blade_node[[1, 0, 2, 3, 4, 5]]}),
        "partners mixed up",
    ),
    "places in mm": (table(lambda p: {"position": 1e3 * p.position}), "pair .*given in mm"),
    "places 3 mm off": (
        table(lambda p: {"position": p.position + [0, 0, 3e-3]}),
        "0.003 m off its nodes",
    ),
    "one n reversed": (
        table(lambda p: {"frame": flipped(p, [1])}),
        "pair 2 .*points against that of its neighbour",
    ),
    "no number": (table(lambda p: {"position": p.position * [np.nan, 1, 1]}), "must be finite"),
}


@pytest.mark.parametrize("name", EDITS)
def test_own_pairs(tmp_path, capsys, name):
    """Inspect and reduce, the two doors of a table."""
    edit, words = EDITS[name]
    study = write_chain(tmp_path)
    edit(tmp_path / "pairs.csv")
    for stage in ("inspect", "reduce"):
        assert main([stage, str(study), "--quiet"]) == 2
        said = capsys.readouterr().err.strip()
        assert said.count("\n") == 0 and re.search(words, said), said


def test_all_normals_of_a_side_reversed(tmp_path, capsys):
    """No neighbour tells: the pull does not press the damper against the side, and there is no
    preload."""
    study = write_chain(tmp_path)
    table(lambda p: {"frame": flipped(p, p.side == "left")})(tmp_path / "pairs.csv")
    assert (
        main(["inspect", str(study), "--quiet"]) == 0
        and "pull_direction" in capsys.readouterr().out
    )
    assert (
        main(["reduce", str(study), "--quiet"]) == 0
        and main(["preload", str(study), "--quiet"]) != 0
    )


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    """The smallest study with meshes, and the table of its pairs after `preload`."""
    folder = tmp_path_factory.mktemp("corner")
    study = load_study(corner_study.write(folder))
    store = results_folder(study, None)
    for name in ("reduce", "preload"):
        run_stage(name, study, store, quiet=True)
    return ContactTable.load(store.path("preload.csv"))


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda p: {}, ""),
        (lambda p: {"gap": p.gap + 1e-5}, ""),
        (lambda p: {"position": p.position - 1e-5 * p.normal, "gap": p.gap + 1e-5}, ""),
        (lambda p: {"frame": flipped(p, p.side == p.side[0])}, "180 degrees off the surfaces"),
        (lambda p: {"frame": flipped(p, [0])}, "against that of its neighbour"),
        (lambda p: {"position": p.position + 1e-4}, "from where the table has it"),
    ],
)
def test_own_pairs_of_meshes(tmp_path, capsys, corner, change, words):
    study = corner_study.write(tmp_path, change=OWN)
    corner.replace(**change(corner)).save(tmp_path / "own.csv")
    code, said = main(["inspect", str(study), "--quiet"]), capsys.readouterr().err
    assert code == (2 if words else 0) and words in said, said


@pytest.mark.parametrize("factor, said", [(1.0, ""), (1e-3, "1/1.4"), (1e3, "6.9 times")])
def test_kn_of_an_own_table_in_another_unit(tmp_path, capsys, corner, factor, said):
    """Against the two half-spaces of each side, 1.29e9 N/m (tests/tipdamp/checks); the nine pairs
    of a side have 9e6 N/m together."""
    study = corner_study.write(tmp_path, change=OWN)
    corner.replace(kn=factor * corner.kn, kt=factor * corner.kt).save(tmp_path / "own.csv")
    assert main(["inspect", str(study), "--quiet"]) == 0
    found = [line for line in capsys.readouterr().out.splitlines() if "half-spaces" in line]
    assert len(found) == 2 * bool(said) and all(said in line for line in found), found
    assert all(f"kn of the table is {9e6 * factor:.3g} N/m" in line for line in found)


@pytest.mark.parametrize("reverse", [False, True])
def test_rows_counted_from_the_upper_edge(tmp_path, capsys, corner, reverse):
    """Row 0 is what `rows = "edge"` keeps."""
    edge = 'shape = "flat"\n', 'shape = "flat"\nrows = "edge"\nroll_stiffness = 0\n'
    study = corner_study.write(tmp_path, change=(*OWN, edge))
    rows = corner.row.max() - corner.row if reverse else corner.row
    corner.replace(row=rows).save(tmp_path / "own.csv")
    assert main(["inspect", str(study), "--quiet"]) == 0
    found = [line for line in capsys.readouterr().out.splitlines() if "lower edge" in line]
    said = "[contact.one] rows = 'edge' keeps row 0, but row 2 lies farthest against the pull"
    assert len(found) == reverse and all(said in line for line in found)


def test_distances_that_are_meant(tmp_path, capsys):
    """[contact] tolerance, which the refusal names."""
    study = write_chain(tmp_path)
    table(lambda p: {"blade_node": swapped(p, "left"), "position": p.position + [0, 0, 3e-3]})(
        tmp_path / "pairs.csv"
    )
    study.write_text(CHAIN.replace("[contact]\n", "[contact]\ntolerance = 0.03\n"))
    assert main(["inspect", str(study), "--quiet"]) == 0


def test_a_model_without_positions(tmp_path, capsys):
    study = write_chain(tmp_path)
    assert (
        main(["inspect", str(study), "--quiet"]) == 0
        and "no positions" not in capsys.readouterr().out
    )
    with np.load(tmp_path / "model.npz") as z:
        found = dict(z)
    np.savez(
        tmp_path / "model.npz", **found | {"position": np.full_like(found["position"], np.nan)}
    )
    table(lambda p: {"blade_node": swapped(p, "left")})(tmp_path / "pairs.csv")
    assert main(["inspect", str(study), "--quiet"]) == 0
    assert "no positions for the nodes of 6 of 6 pairs" in capsys.readouterr().out


@pytest.mark.parametrize("mark, comma", [(";", ","), (";", "."), ("\t", ","), (",", ".")])
def test_spreadsheets_of_other_countries(tmp_path, mark, comma):
    """The same numbers, with empty columns and rows that a spreadsheet adds."""
    write_chain(tmp_path)
    path, pairs = tmp_path / "pairs.csv", ContactTable.load(tmp_path / "pairs.csv")
    rows = [[*(text.replace(".", comma) for text in row), "", ""] for row in lines(path)]
    write(path, [*rows, [""] * len(rows[0])], mark)
    again = ContactTable.load(path)
    for name, column in vars(pairs).items():
        assert np.array_equal(column, vars(again)[name]), name


def test_decimal_commas_and_points_in_one_table(tmp_path):
    """1.234 may be a thousand there."""
    write_chain(tmp_path)
    path = tmp_path / "pairs.csv"
    rows = [[text.replace(".", ",") for text in row] for row in lines(path)]
    rows[3][rows[0].index("kn")] = "1.234"
    write(path, rows, ";")
    with pytest.raises(
        InputError,
        match=r"decimal commas \(line 2: .*\) and decimal points \(line 4: kn = '1.234'\)",
    ):
        ContactTable.load(path)


@pytest.mark.parametrize(
    "text, words",
    [
        ("node,direction,x,y,z\n1,x,0,5,0,0\n1,y,0.5,0,0\n", r"line 2: has 6 fields"),
        ("node,direction,x,y,z,group tip\n1,x,0,5,0.1,0,\n", "line 2: has 7 fields, 1 more"),
        ("node,direction,x,y,z,x\n1,x,0.5,0,0,7\n", "line 1: column 'x' is there twice"),
        (
            "node,direction,x,load pull,load pull\n1,x,0.5,0,1\n",
            "line 1: column 'load pull' is there twice",
        ),
        (
            "node,direction,x,y,z\n1,x,0.5,0\n",
            "line 2: has 4 fields, the header 5 columns: column 'z' is missing",
        ),
        ("node,direction,x,y,z\n1.5,x,0.5,0,0\n", "line 2: node = '1.5' is not a whole number"),
    ],
)
def test_dof_tables(tmp_path, text, words):
    (tmp_path / "dofs.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_dofs(tmp_path / "dofs.csv")


def test_a_dof_table_with_semicolons(tmp_path):
    (tmp_path / "dofs.csv").write_text(
        "node;direction;x;y;z;load pull\n1;x;0,5;0;0;\n2;z;0,5;1e-3;0;1\n"
    )
    found = read_dofs(tmp_path / "dofs.csv")
    assert found["position"] == [[0.5, 0, 0], [0.5, 1e-3, 0]] and found["loads"] == {
        "pull": [0.0, 1.0]
    }


def up_to_preload(study):
    assert [main([stage, str(study), "--quiet"]) for stage in ("inspect", "reduce", "preload")] == [
        0
    ] * 3


def tuned(folder, edit, *changes):
    study, text = write_chain(folder), CHAIN
    for old, new in (TUNED_BY_TABLE, *changes):
        text = text.replace(old, new)
    study.write_text(CHAIN)
    up_to_preload(study)
    assert main(["tune", str(study), "--quiet"]) == 0
    (folder / "kept.csv").write_bytes((folder / "results" / "study" / "kept.csv").read_bytes())
    edit(folder / "kept.csv")
    study.write_text(text)
    return main(["tune", str(study), "--quiet"])


def nothing(path):
    """A copy as it stands."""


KEPT = {
    "n reversed": (
        table(lambda p: {"frame": flipped(p, [0])}),
        r"kept.csv, row 1: .*t2 is not that|n is not that",
    ),
    "places in mm": (
        table(lambda p: {"position": 1e3 * p.position}),
        "x, y, z is not that of the study's pair",
    ),
    "a gap": (table(lambda p: {"gap": p.gap + 1e-5}), "row 1: .*gap is not that"),
    "a second column": (second_column, "column 'kn' is there twice"),
    "a decimal comma": (in_row(cell("mu", "0,3"), 1), r"line 2: .*mu = '0,3' meant"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT)
def test_own_kept_table(tmp_path, capsys, name):
    edit, words = KEPT[name]
    assert tuned(tmp_path, edit) == 2
    assert re.search(words, capsys.readouterr().err)


@pytest.mark.slow
@pytest.mark.parametrize(
    "factor, mu, code", [(1, 0.5, 0), (1.3, 0.5, 0), (10, 0.5, 2), (0.05, 0.5, 2), (1.3, 0.0, 2)]
)
def test_preload_that_the_pull_cannot_hold(tmp_path, capsys, factor, mu, code):
    """Sides at 35 degrees: normal forces balance the pull at N_0 = Fc / (2 sin 35) each; friction
    mu N along the sides holds those from N_0 / (1 + mu cot 35) up, and down from N_0 / (1 - mu cot
    35)."""
    edit = table(lambda p: {"preload": factor * p.preload, "mu": np.full(len(p), mu)})
    by_table = (TUNED_BY_TABLE[1], TUNED_BY_TABLE[1] + 'preload = "table"\n')
    assert tuned(tmp_path, edit, by_table) == code
    said = capsys.readouterr()
    assert (
        re.search("friction can hold", said.err)
        if code
        else ("not balanced" in said.out) == (factor != 1)
    )


def test_python_alone_has_the_same_table(tmp_path):
    write_chain(tmp_path)
    second_column(tmp_path / "pairs.csv")
    with pytest.raises(InputError, match="there twice"):
        ContactTable.load(tmp_path / "pairs.csv")
    assert ReducedModel.load(tmp_path / "model.npz").size == 27


def test_an_apostrophe_stays(tmp_path):
    """One is taken off when a table is read, by which a spreadsheet knows text."""
    table = contact_table(np.eye(3)[None], side=["'left"])
    assert ContactTable.load(table.save(tmp_path / "pairs.csv")).side.tolist() == ["'left"]


@pytest.mark.parametrize("name", [" left", "left ", " "])
def test_names_that_a_table_would_not_keep_are_refused(name):
    with pytest.raises(InputError, match=f"side '{name}': has blanks at an end"):
        contact_table(np.eye(3)[None], side=[name])
