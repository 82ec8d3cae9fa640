"""What the tables of a comparison say: of curves made up so that the cause is known."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from tests.contact_tables import contact_table, frames
from tests.tipdamp.comparison.test_peaks import results
from tipdamp.comparison import doubts, events, stress, tables
from tipdamp.comparison.figures import BEST, DOUBTED, optimisation, responses
from tipdamp.comparison.page import introduction
from tipdamp.comparison.peaks import ComparedPeak
from tipdamp.comparison.record import ComparedStudies, Computed, finest
from tipdamp.comparison.swept import why_apart
from tipdamp.comparison.wear import figures, has_areas
from tipdamp.hbm.drawing.figure import Marks
from tipdamp.report.subjects.wear import wear_index
from tipdamp.report.text import NOTHING
from tipdamp.results.response_results import PeakStress, StressPlace, StressResult
from tipdamp.study.law import LawChoice


def level(name, Fe, height, **other):
    """Friction takes a tenth of what the force puts in at 2800 Hz."""
    given = {
        "scatter": "",
        "H": 3,
        "pull": 100.0,
        "hz": 2800.0,
        "error": 0.0,
        "tolerance": 1e-3,
        "stable": True,
        "at_least": None,
        "slipping": 0.5,
        "friction_W": (0.1 * np.pi * 2800 * Fe**2 * (height or 0.0),),
        "mac": None,
        "complete": True,
        "ended": "",
    }
    return ComparedPeak(
        study=name,
        phase="out_of_phase",
        blade=1,
        Fe=Fe,
        m_per_N=height,
        **given | other,
    )


def stuck(name, Fe, height, **other):
    """As `level`, with every pair stuck."""
    return level(name, Fe, height, slipping=0.0, friction_W=(0.0,), **other)


def comparison(tmp_path):
    """Friction halves the response of `soft`, which the tests put first; `stiff` is lower without
    any."""
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    soft, stiff = results(tmp_path / "a"), results(tmp_path / "b")
    vars(soft.study)["reference"] = {"out_of_phase_rank": 1}
    peaks = [level("soft", Fe, h) for Fe, h in ((1.0, 8e-7), (10.0, 4e-7), (50.0, 6e-7))]
    peaks += [level("stiff", Fe, 3e-7) for Fe in (1.0, 10.0, 50.0)]
    return ComparedStudies((Computed("soft", soft), Computed("stiff", stiff)), tuple(peaks))


def test_best_pull_with_ranks(tmp_path):
    (table,) = tables.best(comparison(tmp_path))
    soft, stiff = table.records
    assert (soft["rank"], soft["paper"], stiff["rank"]) == ("2", "1", "1")
    assert soft["best Fc/Fe"] == "10.0" and soft["pull for Fe = 10 N (N)"] == "100"
    assert (soft["lowest"], stiff["lowest"]) == ("0 of 3", "3 of 3")


def test_a_least_at_the_end_of_the_levels_is_no_optimum(tmp_path):
    """Of `stiff`, which still falls there; between its levels `soft` has a least."""
    given = comparison(tmp_path)
    soft = [p for p in given.peaks if p.study == "soft"]
    falls = [level("stiff", Fe, h) for Fe, h in ((1.0, 5e-7), (10.0, 4e-7), (50.0, 3e-7))]
    given = replace(given, peaks=(*soft, *falls))
    (said,) = introduction(given)
    assert said.endswith("Least at the first or last level, where more levels are needed: stiff.")
    assert "that of stiff, 0.3000 µm/N at Fc/Fe = 2.00 or less. The" in said
    (table,) = tables.best(given)
    stiff = table.records[1]
    assert stiff["best Fc/Fe"] == "2.00 or less"
    assert stiff["pull for Fe = 10 N (N)"] == "20.0 or less"


def test_a_least_above_which_the_damper_rolls_needs_no_more_levels(tmp_path):
    """Below it no periodic motion exists: that is said in place of a call for more levels."""
    given = comparison(tmp_path)
    rolls = replace(
        level("soft", 200.0, None),
        at_least=1e-7,
        complete=False,
        ended="stopped at 20 Hz: the damper rolls (...): no periodic state exists there",
    )
    peaks = [p for p in given.peaks if (p.study, p.Fe) != ("soft", 50.0)]
    (said,) = introduction(replace(given, peaks=(*peaks, rolls)))
    assert said.endswith("more levels are needed: stiff. Below the least of soft the damper rolls.")
    (table,) = tables.best(replace(given, peaks=(*peaks, rolls)))
    pull = "pull for Fe = 10 N (N)"
    told = {row["study"]: (row["best Fc/Fe"], row[pull]) for row in table.records}
    assert told["soft"] == ("10.0", "100")
    (table,) = tables.best(replace(given, peaks=tuple(peaks)))
    assert table.records[0][pull] == "100 or less"
    (said,) = introduction(replace(given, peaks=(*given.peaks, rolls)))  # there is one between
    assert "rolls" not in said


def test_no_pull_is_best_where_nothing_slips(tmp_path):
    """As high at every level but for rounding, whose least is no optimum: a sentence and a cell say
    so in the place of a pull, and no more levels are asked for."""
    given = comparison(tmp_path)
    soft = [p for p in given.peaks if p.study == "soft"]
    heights = ((1.0, 3e-7), (10.0, 3e-7 * (1 - 1e-13)), (50.0, 3e-7 * (1 + 1e-13)))
    flat = [stuck("stiff", Fe, h) for Fe, h in heights]
    given = replace(given, peaks=(*soft, *flat))
    (said,) = introduction(given)
    assert said == (
        "Out of phase the least response is that of stiff, 0.3000 µm/N, where friction takes "
        "nothing. The others at their best: soft 0.4000 µm/N. No pull is best for stiff, whose "
        "least is that without friction."
    )
    (figure,) = optimisation(given)
    stars = [one for one in figure.panels[0].items if vars(one).get("name") == BEST]
    assert [list(one.x) for one in stars] == [[10.0]]  # of soft alone
    (table,) = tables.best(given)
    row = next(row for row in table.records if row["study"] == "stiff")
    assert row["best Fc/Fe"] == "none" and row["flat: Fc/Fe"] == NOTHING
    assert row["pull for Fe = 10 N (N)"] == NOTHING and row["least (µm/N)"] == "0.3000"
    assert "friction takes nothing" in table.caption


def test_studies_that_are_equal_share_a_rank(tmp_path):
    """Within the errors of their peaks, to rounding, or within their scatter; just beyond they do
    not."""
    given = comparison(tmp_path)
    soft = [p for p in given.peaks if p.study == "soft"]

    def ranked(height, error=0.0, scatter=()):
        mine = [level("stiff", Fe, height, error=error) for Fe in (1.0, 10.0)]
        mine += [replace(p, scatter="mu", m_per_N=h) for p in mine for h in scatter]
        changed = replace(given, peaks=(*soft, *mine))
        (table,) = tables.best(changed)
        said = " ".join(introduction(changed))
        return {row["study"]: row["rank"] for row in table.records}, "are equal within" in said

    tied, apart = {"soft": "1 (tied)", "stiff": "1 (tied)"}, {"soft": "1", "stiff": "2"}
    assert ranked(4e-7 * (1 + 1e-12)) == (tied, True)
    assert ranked(4.04e-7, error=0.02) == (tied, True)
    assert ranked(4.04e-7, error=0.005) == (apart, False)
    assert ranked(4.5e-7, scatter=(3.9e-7, 5e-7)) == (tied, True)
    assert ranked(4.5e-7, scatter=(4.1e-7, 5e-7)) == (apart, False)


def test_ranks_are_over_what_all_reach(tmp_path):
    """The same damper, of which one was computed further down: its least lies where the other was
    not computed. As two levels, and as one level between two of the other's."""
    given = comparison(tmp_path)

    def ranked(soft, stiff, **last):
        peaks = [level("soft", Fe, h) for Fe, h in soft]
        peaks += [level("stiff", Fe, h) for Fe, h in stiff]
        peaks += [level("stiff", 100.0, None, complete=False, **last)] if last else []
        changed = replace(given, peaks=tuple(peaks))
        return changed.ranks("out_of_phase"), " ".join(introduction(changed)), changed

    soft = ((1.0, 8e-7), (10.0, 6e-7), (20.0, 3e-7))
    tied, apart = {"soft": 1, "stiff": 1}, {"soft": 1, "stiff": 2}
    found, said, changed = ranked(soft, (*soft, (50.0, 2e-7)))
    assert found == tied and list(tables.differences(changed)) == []
    assert "From Fc/Fe = 5.00 to 100, which all reach: stiff and soft are equal within" in said
    assert ranked(soft, ((1.0, 8e-7), (15.0, 4e-7), (30.0, 2e-7)))[0] == tied
    assert ranked(soft, (soft[0], (10.0, 6.1e-7), (20.0, 3.1e-7), (50.0, 2e-7)))[0] == apart
    assert "which all reach: soft is the lowest" in ranked(soft, ((1.0, 8e-7), (50.0, 3.5e-7)))[1]
    lower = (*soft, (50.0, 2e-7))
    assert ranked(lower, soft)[0] == tied
    rolls = "stopped at 20 Hz: the damper rolls (...): no periodic state exists there"
    assert ranked(lower, soft, ended=rolls)[0] == apart  # below it there is none to be lower
    assert ranked(lower, soft, ended="stopped at 20 Hz: the step is too small")[0] == tied
    found, said, _ = ranked(soft, ((50.0, 2e-7), (100.0, 1e-7)))
    assert found == {} and "no Fc/Fe that all reach" in said


def test_a_flat_curve_ranks_by_all_its_heights(tmp_path):
    """Both vary by more than one leads: tied, and no pull is best. A step apart they are not."""
    given = comparison(tmp_path)
    Fe = (1.0, 10.0, 50.0)

    def told(scale):
        soft = map(level, ["soft"] * 3, Fe, (3e-7, 2.99e-7, 2.96e-7))
        stiff = map(level, ["stiff"] * 3, Fe, (scale * 3e-7, scale * 3e-7, scale * 2.97e-7))
        changed = replace(given, peaks=(*soft, *stiff))
        (table,) = tables.best(changed)
        return table.records, introduction(changed), list(tables.differences(changed))

    (soft, stiff), (said,), causes = told(1.0)
    assert soft["rank"] == stiff["rank"] == "1 (tied)" and causes == []
    assert soft["best Fc/Fe"] == "any" and soft["pull for Fe = 10 N (N)"] == NOTHING
    assert "that of soft, 0.2960 µm/N, and within 5 % of that at every level." in said
    (soft, stiff), _, causes = told(0.9)
    assert (soft["rank"], stiff["rank"]) == ("2", "1")
    assert causes[0].records[1]["lower by"] == "stiffness (× 0.90)"  # friction rounds to 1


def test_the_same_scatter_is_ranked_case_by_case(tmp_path):
    """The bars overlap, and one is lower in every case: it is the first. Not where it is in some of
    them alone, nor where the cases are others."""
    given = comparison(tmp_path)

    def ranked(soft, stiff):
        peaks = [
            level(name, Fe, h, scatter=scatter)
            for name, heights in (("soft", soft), ("stiff", stiff))
            for scatter, h in heights.items()
            for Fe in (1.0, 10.0)
        ]
        return replace(given, peaks=tuple(peaks)).ranks("out_of_phase")

    low = {"": 3.0e-7, "mu = 0.4": 4.0e-7, "mu = 0.6": 2.0e-7}
    high = {case: 1.2 * height for case, height in low.items()}
    assert ranked(low, high) == {"soft": 1, "stiff": 2}
    assert ranked(low, high | {"mu = 0.6": 1.9e-7}) == {"soft": 1, "stiff": 1}
    assert ranked(low, {"": 3.6e-7, "mu = 0.5": 3.0e-7}) == {"soft": 1, "stiff": 1}


def test_one_study_is_not_said_to_be_the_best(tmp_path):
    given = comparison(tmp_path)
    alone = [p for p in given.peaks if p.study == "soft"]
    (said,) = introduction(replace(given, computed=given.computed[:1], peaks=tuple(alone)))
    assert said == "Out of phase the least response is 0.4000 µm/N at Fc/Fe = 10.0."


def test_doubts_of_peaks_are_told(tmp_path):
    """Unstable, an error above the tolerance, or none known: hollow on the curve, in the table of
    every case and in the warnings; the headline has no more digits than the error leaves."""
    given = comparison(tmp_path)
    peaks = [
        level("soft", 1.0, 8e-7),
        level("soft", 10.0, 4.321e-7, error=0.032, stable=False),
        level("soft", 50.0, 6e-7, error=None, stable=None),
        level("stiff", 1.0, 5.678e-7, error=9e-4),
        level("stiff", 10.0, 5.6785e-7, error=4e-3),
    ]
    given = replace(given, peaks=tuple(peaks))
    (figure,) = optimisation(given)
    marks = [one for one in figure.panels[0].items if isinstance(one, Marks)]
    hollow = [(one.name, x) for one in marks if not one.filled for x in one.x]
    doubted = [(DOUBTED, 2.0), (DOUBTED, 10.0), (DOUBTED, 10.0)]
    assert sorted(hollow) == [*doubted, (BEST, 10.0)]
    (table,) = tables.cases(given)
    told = {(r["study"], r["Fe (N)"]): (r["error"], r["motion"]) for r in table.records}
    assert told["soft", "10.00"] == ("3.2 %", "unstable")
    assert told["soft", "50.00"] == ("not known", NOTHING)
    assert told["soft", "1.000"] == ("0 %", "stable")
    assert doubts.error(level("soft", 1.0, 8e-7, error=1.7e-19)) == "0 %"  # rounding
    (said,) = introduction(given)
    assert "that of soft, 0.43 µm/N ± 3 % (unstable) at Fc/Fe = 10.0. The others" in said
    assert "others at their best: stiff 0.568 µm/N ± 0.09 %." in said
    assert doubts.warnings(given) == [
        "soft: 2 of 3 peaks, with those of its scatter, are in doubt: error above the tolerance 1 "
        "(up to 3.2 %), error not known 1 and unstable 1.",
        "stiff: 1 of 2 peaks, with those of its scatter, are in doubt: error above the tolerance 1 "
        "(up to 0.40 %).",
    ]


def test_warnings_of_the_stages_are_told_once(tmp_path):
    """Of all cases of a study those that are alike but for their numbers."""
    given = comparison(tmp_path)
    one = given.computed[0].results
    several = [
        Computed("soft", replace(one, said={"tune": [f"MAC of {mac} with the free one"]}), scatter)
        for mac, scatter in ((0.42, ""), (0.43, "contact.mu = 0.5"), (0.44, "contact.mu = 0.6"))
    ]
    name = one.study.name
    assert doubts.warnings(ComparedStudies(tuple(several), ())) == [
        f"{name} (3 of 3 cases): MAC of 0.42 with the free one."
    ]
    (folder := tmp_path / "another").mkdir()
    other = results(folder)
    vars(other.study)["path"] = folder / "other.toml"
    warned = Computed("other", replace(other, said={"tune": ["MAC of 0.5 with the free one"]}))
    assert doubts.warnings(ComparedStudies((*several, warned), ())) == [  # of both studies once
        f"{name} (3 of 3 cases) and other: MAC of 0.42 with the free one."
    ]


def test_friction_is_among_what_tells_studies_apart(tmp_path):
    given = comparison(tmp_path)
    upright = frames([[0.0, 0.0, 1.0]] * 3)
    kept = contact_table(upright, mu=[0.3, 0.5, 0.9], weight=[1, 1, 0])  # the last is detached
    vars(given.computed[1].results)["kept"] = kept
    (table,) = tables.studies(given)
    row = next(row for row in table.records if row[""] == "friction coefficient")
    assert (row["soft"], row["stiff"]) == ("0.6", "0.3 to 0.5")


def test_contact_is_among_what_tells_studies_apart(tmp_path):
    """Stiffness of each side, and the law."""
    given = comparison(tmp_path)
    (table,) = tables.studies(given)
    row = {row[""]: row["soft"] for row in table.records}
    assert row["contact law"] == "DryFriction2T"
    assert row["kn (N/µm per pair)"] == "left 1 and right 1"
    assert row["kt (N/µm per pair)"] == "left 0.9 and right 0.9"


def test_why_a_phase_is_missing(tmp_path):
    """A band about one mode says nothing of the other one."""
    given = comparison(tmp_path)
    for one in given.computed:
        narrow = one.results.study.respond.model_copy(update={"band": (2300.0, 3300.0)})
        vars(one.results.study)["respond"] = narrow
    (table,) = tables.events(given)
    said = {row["study"]: row["along its curve"] for row in table.records}
    assert said["soft, in phase"].startswith(
        "no peaks: the band 2300 to 3300 Hz does not meet its range, "
    )
    assert "soft, out of phase" not in said
    vars(given.computed[0].results.tune)["other_modes"] = {}
    (table,) = tables.events(given)
    said = {row["study"]: row["along its curve"] for row in table.records}
    assert "its mode was not found" in said["soft, in phase"]


def test_cause_of_another_rank(tmp_path):
    (table,) = tables.differences(comparison(tmp_path))
    assert [row["study"] for row in table.records] == ["soft", "stiff"]
    assert [row["there (µm/N)"] for row in table.records] == ["0.8000", "0.3000"]
    assert [row["left of it at the best"] for row in table.records] == ["0.500", "1.00"]
    assert table.records[0]["stuck (Hz)"] == "2801.0"
    (tmp_path / "c").mkdir()
    stated = comparison(tmp_path / "c")
    vars(stated.computed[0].results.study)["reference"] = {"out_of_phase_rank": 2}
    assert list(tables.differences(stated)) == []


def test_what_happens_along_a_curve():
    """Drift, another mode, a merged level and one that ends, each told once."""
    peaks = [
        level("a", 1.0, 8e-7),
        level("a", 2.0, 7e-7, hz=2600.0, mac=0.9),
        level("a", 3.0, 6e-7, hz=1700.0, mac=0.1),
        level("a", 4.0, None, hz=None),
        level("a", 5.0, None, hz=None, at_least=1e-7, complete=False, ended="stopped at 20 Hz: x"),
    ]
    said = list(tables.told(peaks))
    assert len(said) == 4
    assert said[0].startswith("drifts from 2800.0 to 2600.0 Hz")
    assert "another mode, at 1700.0 Hz" in said[1] and "Fc/Fe = 33.3" in said[1]
    assert "merged" in said[2] and "stopped at 20 Hz" in said[3]


def test_what_happens_is_marked_on_the_curve(tmp_path):
    """Ends of a drift, another mode and a merged level, which stands between its neighbours."""
    given = comparison(tmp_path)
    peaks = [
        level("soft", 1.0, 8e-7),
        level("soft", 2.0, 7e-7, hz=2790.0, mac=0.9),
        level("soft", 4.0, 4e-7, hz=2600.0, mac=0.9),
        level("soft", 8.0, None, hz=None),
        level("soft", 16.0, 1e-7, hz=2600.0, mac=0.1),
    ]
    (figure,) = optimisation(replace(given, peaks=tuple(peaks)))
    drawn = {one.name: one for one in figure.panels[0].items if isinstance(one, Marks)}
    assert sorted(drawn[events.DRIFTS].x) == [25.0, 100.0]
    assert (drawn[events.OTHER_MODE].x, drawn[events.OTHER_MODE].y) == (6.25, pytest.approx(0.1))
    assert (drawn[events.MERGED].x, drawn[events.MERGED].y) == (12.5, pytest.approx(0.2))
    assert "scatter" not in figure.caption + "".join(figure.legend)


def test_scatter_names_what_varies(tmp_path):
    """In the legend, each key once; of the study that has it."""
    given = comparison(tmp_path)
    several = ("contact.mu = 0.5, tune.stations = [5, 4]", "contact.mu = 0.7")
    computed = [replace(given.computed[1], scatter=text) for text in several]
    peaks = [replace(level("stiff", 1.0, 4e-7), scatter=text) for text in several]
    (figure,) = optimisation(
        replace(given, computed=(*given.computed, *computed), peaks=(*given.peaks, *peaks))
    )
    named = [name for name in figure.legend if "scatter" in name]
    assert named == ["scatter of contact.mu and tune.stations"]
    assert "Bars: from the least to the largest of the scatter." in figure.caption


def test_the_most_harmonics_of_a_level_count():
    """Of cases that are otherwise the same; those of the scatter stay beside them."""
    three, four = level("a", 1.0, 1e-6), level("a", 1.0, 2e-6, H=4)
    bar, alone = level("a", 1.0, 3e-6, scatter="contact.mu = 0.5"), level("a", 2.0, 1e-6)
    assert finest([three, bar, four, alone]) == (bar, four, alone)


def test_one_level_has_no_best_pull(tmp_path):
    """It is said in a sentence, and not in a table of dashes; of one study beside others too."""
    given = comparison(tmp_path)
    one = replace(given, peaks=tuple(p for p in given.peaks if p.Fe == 10.0))
    assert list(tables.best(one)) == []
    said = "Out of phase there is no best pull, which needs peaks at two levels, of "
    assert list(introduction(one)) == [f"{said}soft and stiff."]
    beside = replace(given, peaks=tuple(p for p in given.peaks if (p.study, p.Fe) < ("stiff", 2.0)))
    (table,) = tables.best(beside)
    assert [row["study"] for row in table.records] == ["soft"]
    first, second = introduction(beside)
    assert first == f"{said}stiff." and second.startswith("Out of phase the least response is")


def test_cause_of_a_lower_curve(tmp_path):
    """`stiff` is 3/8 of `soft` where nothing slips; friction leaves half of `soft` and all of
    `stiff`."""
    (table,) = tables.differences(comparison(tmp_path))
    assert [row["lower by"] for row in table.records] == [
        NOTHING,
        "stiffness (× 0.38), not friction (× 2.00)",
    ]


def test_pulls_draw_one_curve_where_the_preload_follows_them(tmp_path):
    """Not with a gap, whose force does not follow the pull, nor with a law that knows a length."""
    (tmp_path / "a").mkdir()
    one = results(tmp_path / "a")
    pull = one.study.driver.pull
    two = at_pull(one, 2 * pull, 2 * one.kept.preload)
    pulls = [Computed("a", one), Computed("a", two)]
    assert not why_apart(pulls)
    stations = Computed("a", replace(one, kept=one.kept.select(one.kept.station > 0)), "fewer")
    assert not why_apart([*pulls, stations])  # its scatter has pairs of its own
    open_pair = 2 * one.kept.preload
    open_pair[0] -= 1.0
    said = why_apart([pulls[0], Computed("a", at_pull(one, 2 * pull, open_pair))])
    assert "preload of their kept pairs is not in proportion to the pull" in said
    stiffer = replace(two, kept=two.kept.replace(kn=1.1 * two.kept.kn))
    assert "stiffness of their kept pairs" in why_apart([pulls[0], Computed("a", stiffer)])
    vars(two.study)["respond"] = two.study.respond.model_copy(
        update={"law": LawChoice(name="CubicSpring")}
    )
    assert "its law, CubicSpring" in why_apart(pulls)


def test_pulls_that_draw_a_curve_each_are_one_study_in_the_end(tmp_path):
    """The page says why they are apart, and which study is lowest: that with the lowest of its
    pulls at each Fc/Fe."""
    given = comparison(tmp_path)
    stiff = given.computed[1].results
    computed = [given.computed[0]]
    for pull in (50.0, 100.0):
        one = at_pull(stiff, pull, stiff.kept.preload)
        vars(one.study)["path"] = tmp_path / "stiff.toml"
        computed.append(Computed(f"stiff, {pull:g} N", one, apart="the preload is such"))
    peaks = [level("soft", Fe, h) for Fe, h in ((1.0, 8e-7), (10.0, 4e-7), (50.0, 6e-7))]
    for pull, heights in ((50.0, (3e-7, 7e-7)), (100.0, (5e-7, 5e-7))):
        name, ratios = f"stiff, {pull:g} N", (10.0, 100.0)
        for ratio, height in zip(ratios, heights, strict=True):
            peaks.append(level(name, pull / ratio, height, pull=pull))
    given = replace(given, computed=tuple(computed), peaks=tuple(peaks))
    assert given.apart == {"stiff": "the preload is such"}
    assert given.by_study.names == ["soft", "stiff"]
    heights = [p.m_per_N for p in given.by_study.of("stiff", "out_of_phase")]
    assert heights == [3e-7, 5e-7]
    least, why = introduction(given)
    assert "that of stiff, 0.3000 µm/N at Fc/Fe = 10.0 or less (Fc = 50 N)." in least
    assert "soft 0.4000" in least and "stiff, " not in least.replace("stiff, 0.3", "")
    assert why.startswith("stiff: 50 and 100 N draw a curve each, since the preload is such, and")
    first, second = tables.best(given)
    assert [(row["study"], row["rank"]) for row in first.records] == [("soft", "2"), ("stiff", "1")]
    assert len(second.records) == 3


def test_an_interpolated_stretch_decides_no_rank(tmp_path):
    """Of a study without a level near the end of the common range nothing is known there: a lower
    level beyond makes no tie, and where another has a level it is not the lowest."""
    given = comparison(tmp_path)
    soft = [level("soft", Fe, h) for Fe, h in ((1.0, 9.2e-7), (8.0, 9.1e-7))]
    wide = [level("stiff", Fe, h) for Fe, h in ((1.0, 9.3e-7), (4.0, 9.3e-7), (16.0, 6e-7))]
    given = replace(given, peaks=(*soft, *wide))  # 100 and 12.5; 100, 25 and 6.25
    assert given.ranks("out_of_phase") == {"soft": 1}
    (table,) = tables.best(given)
    rows = {row["study"]: (row["rank"], row["lowest"]) for row in table.records}
    assert rows == {"soft": ("1", "1 of 1"), "stiff": ("open", "0 of 1")}
    (said,) = introduction(given)
    assert "soft is the lowest of the others." in said
    assert "of stiff is only interpolated, between 0.600 and 0.930 µm/N at levels that" in said
    near = replace(wide[2], Fe=100 / 11.0)  # 11: beside 12.5
    assert given.interpolated("out_of_phase").keys() == {"stiff"}
    assert replace(given, peaks=(*soft, *wide[:2], near)).interpolated("out_of_phase") == {}


def at_pull(one, pull, preload):
    """Results with another pull and preload."""
    study = copy(one.study)
    vars(study)["driver"] = study.driver.model_copy(update={"pull": pull})
    vars(study)["respond"] = study.respond
    return replace(one, study=study, kept=one.kept.replace(preload=preload))


def test_wear_of_several_pulls_is_that_at_the_first(tmp_path):
    """The best of the levels is one of twice the pull: a quarter of its friction."""
    (tmp_path / "a").mkdir()
    one = results(tmp_path / "a")
    pull, power = one.study.driver.pull, np.arange(one.kept.carrying.sum(), dtype=float)
    peaks = tuple(
        replace(level("a", Fe, h), pull=fc, friction_W=tuple(power))
        for fc, Fe, h in ((pull, 1.0, 3e-6), (2 * pull, 20.0, 1e-6))
    )
    given = ComparedStudies((Computed("a", one),), peaks)
    (figure,) = figures(given)
    drawn = np.concatenate([marks.y for panel in figure.panels for marks in panel.items])
    every = np.concatenate(
        [wear_index(one, peaks[1].friction_W, side)[1] for side in one.whole.sides]
    )
    assert drawn == pytest.approx(every / 4)
    for panel in figure.panels:  # on axes that hold them all
        (left, right), (low, high) = panel.x_range, panel.y_range
        for marks in panel.items:
            assert left < min(marks.x) and max(marks.x) < right
            assert low < min(marks.y) and max(marks.y) < high


def test_wear_per_area(tmp_path):
    """Of contact points, whose areas are known: the power of friction of a station over its
    area."""
    (tmp_path / "a").mkdir()
    one = results(tmp_path / "a")
    whole = one.whole.replace(area=np.full(len(one.whole), 2e-6))
    vars(one)["whole"] = vars(one)["kept"] = whole
    power = tuple(np.arange(len(whole), dtype=float))
    peak = replace(level("a", 1.0, 1e-6), friction_W=power)
    given = ComparedStudies((Computed("a", one),), (peak,))
    assert has_areas(given)
    right = whole.side == "right"
    x, work = wear_index(one, peak.friction_W, "right", per_area=True)
    of_station = [
        sum(p for p, r, s in zip(power, right, whole.station, strict=True) if r and s == k)
        for k in range(5)
    ]
    assert len(x) == 5
    assert work == pytest.approx(3600 * np.array(of_station) / (2 * 2.0))  # two of 2 mm2
    vars(one)["kept"] = whole.replace(area=np.zeros(len(whole)))
    assert not has_areas(given)


def place(body, alternating, mean, safety=None):
    return StressPlace(
        body=body,
        node=7,
        position_m=(0.0, 0.0, 0.0),
        mean_Pa=1e6 * mean,
        alternating_Pa=1e6 * alternating,
        amplitude_m=1e-5,
        safety=safety,
    )


def stressed(one, least, levels=(10.0, 1.0)):
    """Results with the stress of two bodies, in proportion to the level."""
    curves = [
        PeakStress(
            files=(),
            Fe_N=Fe,
            H=3,
            hz=2801.0,
            places=[place("blades", 3 * Fe, 8), place("damper", 4 * Fe, 5)],
            least=[place(p.body, 0, 0, p.safety / Fe) for p in least],
        )
        for Fe in levels
    ]
    vars(one)["stress"] = StressResult(curves=curves)


def test_stress_of_each_pull_and_level(tmp_path):
    """The largest alternating stress with the mean there, in the order of the levels; the least
    safety may be that of another body. Of studies without limits it is not spoken of."""
    given = comparison(tmp_path)
    soft, stiff = (one.results for one in given.computed)
    assert list(stress.table(given)) == []
    stressed(soft, [])
    (table,) = stress.table(given)
    assert "safety" not in table.records[0] and "Goodman" not in table.caption
    stressed(stiff, [place("blades", 0, 0, 20.0), place("damper", 0, 0, 30.0)])
    (table,) = stress.table(given)
    assert [(row["study"], row["Fe (N)"]) for row in table.records] == [
        ("soft", "1.000"),
        ("soft", "10.00"),
        ("stiff", "1.000"),
        ("stiff", "10.00"),
    ]
    last = table.records[-1]
    assert (last["alternating (MPa)"], last["mean there (MPa)"]) == ("40.00", "5.000")
    assert (last["there"], last["safety"], last["least in"]) == (
        "damper, node 7",
        "2.00",
        "blades, node 7",
    )
    assert table.records[0]["safety"] == NOTHING and "Goodman" in table.caption


def test_stress_of_a_curve_without_a_peak_is_a_bound(tmp_path):
    """It is that of the highest solved point: the peak may stress the bodies more."""
    given = comparison(tmp_path)
    one = given.computed[0].results
    stressed(one, [place("blades", 0, 0, 20.0)], (one.finest[0].Fe, 1000.0))
    for case in one.finest[:1]:
        vars(case.facts)["peak_m"] = None
    first, last = next(stress.table(given)).records
    assert first["alternating (MPa)"].startswith("at least ")
    assert first["safety"].startswith("at most ")
    assert last["safety"] == "0.0200" and last["alternating (MPa)"] == "4000"
    vars(one.finest[0].facts).update(peak_m=1e-5, left_out=((2790.0, 2810.0),))  # holes
    assert next(stress.table(given)).records[0]["safety"].startswith("at most ")


def test_figures_of_a_sweep_have_all_levels(tmp_path):
    """One for each pull and band, which its title names, and its file, whose name has no blanks;
    what all have in common is not in the names. Of a level the curve of most harmonics."""
    (tmp_path / "a").mkdir()
    one = results(tmp_path / "a")
    pull = one.study.driver.pull
    every = [at_pull(one, fc, one.kept.preload) for fc in (pull, 2 * pull) for _ in range(4)]
    for k, each in enumerate(every):
        Fe, band = (1.0, 20.0)[k % 2], ((1200.0, 3300.0), (1200.0, 1900.0))[k // 2 % 2]
        changed = each.study.respond.model_copy(update={"levels": (Fe,), "band": band})
        vars(each.study)["respond"] = changed
        facts = one.cases[0].facts.model_copy(update={"Fe_N": Fe})
        vars(each)["cases"] = (replace(one.cases[0], facts=facts),)
    drawn = list(responses(ComparedStudies(tuple(Computed("a b", each) for each in every), ())))
    assert len({figure.name for figure in drawn}) == len({figure.title for figure in drawn}) == 4
    assert drawn[0].name == f"responses_a_b_Fc_{pull:g}_N_1200_to_3300_Hz"
    assert drawn[0].title == f"a b, Fc = {pull:g} N: forced response, 1200 to 3300 Hz"
    assert "a b" not in drawn[0].caption
    for figure in drawn:
        assert len(figure.legend) == 2 and "20 N" in figure.legend[1]
    alone = ComparedStudies((Computed("a b", one), Computed("a_b", one), Computed("a b", one)), ())
    names = [figure.name for figure in responses(alone)]
    assert names == ["responses_a_b", "responses_a_b_2"]
