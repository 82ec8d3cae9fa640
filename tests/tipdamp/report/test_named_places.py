"""The table of named points: one row each, or one row where there are many of a kind."""

from tests.tipdamp.report.files import artefacts, results_of
from tipdamp.report.contents import contents
from tipdamp.report.subjects import named_places
from tipdamp.report.text import NOTHING


def place(kind, hz, height, pair=""):
    return {
        "kind": kind,
        "hz": hz,
        "within_hz": 1e-4,
        "pair": pair,
        "multiplier": [None, None],
        "largest_m": height,
    }


def named(files):
    """Two folds and five pairs that begin to slip, at 20 N with H = 3."""
    folds = [place("fold", 2700.25, 3e-6), place("fold", 2650.5, 1e-6)]
    slips = [
        place("onset of slip", 2600.0 + k, (1 + k) * 1e-7, pair)
        for k, pair in enumerate(("left 0", "left 1", "right 0/1", "left 0", "left 4"))
    ]
    files["responses"][-1]["named"] = [slips[0], *folds, *slips[1:]]


def test_a_row_for_each_and_one_for_many_of_a_kind(tmp_path):
    (table,) = named_places.table(results_of(*artefacts(tmp_path, damage=named)))
    assert table.columns == (
        "H",
        "Fe (N)",
        "kind",
        "points",
        "frequency (Hz)",
        "amplitude (µm)",
        "pairs",
    )
    assert table.rows == (
        ("3", "20", "onset of slip", "5", "2600.00 to 2604.00", "0.1000 to 0.5000")
        + ("left 0\N{EN DASH}1, 4; right (row 1) 0",),
        ("3", "20", "fold", "1", "2700.25", "3.000", NOTHING),
        ("3", "20", "fold", "1", "2650.50", "1.000", NOTHING),
    )
    assert "Separation: " not in table.caption


def test_words_of_the_kinds_that_are_there(tmp_path):
    def parted(files):
        files["responses"][-1]["named"] = [place("separation", 2600.0, 1e-6, "left 0")]

    (table,) = named_places.table(results_of(*artefacts(tmp_path, damage=parted)))
    assert "Separation: a contact comes to be open through the whole cycle" in table.caption
    assert "Fold: " not in table.caption


def test_no_table_without_named_points(tmp_path):
    assert not list(named_places.table(results_of(*artefacts(tmp_path))))


def test_trust_is_a_section_of_its_own_with_a_link(tmp_path):
    sections = contents(results_of(*artefacts(tmp_path, damage=named)))
    (trust,) = (section for section in sections if section.title == "How far to trust this")
    captions = [block.caption for block in trust.blocks]
    assert captions[0].startswith("Harmonics: estimated error") and len(captions) == 2
    assert captions[1].startswith("Named points")


def test_rows_of_a_curve_found_beside(tmp_path):
    """The absorber's detached resonance: its folds stand below those of the curve itself."""

    def beside(files):
        named(files)
        files["responses"][-1]["beside"] = [
            {
                "file": files["responses"][-1]["file"],
                "from_hz": 2500.0,
                "to_hz": 2600.0,
                "highest_hz": 2590.0,
                "highest_m": 9e-6,
                "closed": True,
                "complete": True,
                "ended": "came back to its start",
                "named": [place("fold", 2500.0, 4e-6)],
            }
        ]

    study, folder = artefacts(tmp_path, damage=beside)
    (table,) = named_places.table(results_of(study, folder))
    assert [row[2] for row in table.rows] == ["", "", "", "detached, over 2500 to 2600 Hz"]
    assert table.rows[-1][3:] == ("fold", "1", "2500.00", "4.000", NOTHING)
    assert [table.columns[i] for i in table.left] == ["further curve", "kind", "pairs"]
