"""The cases of a sweep: what [sweep] makes of lists, ranges, tables and samples, and what it
refuses."""

from collections import Counter

import numpy as np
import pytest
from pydantic import BaseModel

from tests.tipdamp.rig_study import CHAIN
from tipdamp.cli import main
from tipdamp.hbm.errors import InputError
from tipdamp.study.schema import StudySection
from tipdamp.study.study import load_study
from tipdamp.study.toml_file import read_toml
from tipdamp.sweep import plan as plan_module
from tipdamp.sweep.cases import cases_of, study_of_case
from tipdamp.sweep.plan import chain, plan

OVER = """
[sweep.over]
model.pull = [60, 30, 15]
respond.levels = { start = 1, stop = 100, count = 3, spacing = "log" }
"""


@pytest.fixture
def sweep(matrices_study):
    """sweep(text): the study on matrices with this text behind it."""

    def written(text):
        matrices_study.write_text(CHAIN + text)
        return matrices_study

    return written


def planned(path):
    study = load_study(path)
    return plan(path, read_toml(path), cases_of(study))


def test_lists_and_ranges_make_their_product(sweep):
    path = sweep(OVER)
    cases = cases_of(load_study(path))
    assert [case["model.pull"] for case in cases] == [60, 60, 60, 30, 30, 30, 15, 15, 15]
    assert [case["respond.levels"] for case in cases[:3]] == [1, 10, 100]
    study = study_of_case(path, read_toml(path), 6, cases[5])
    assert (study.driver.pull, study.respond.levels) == (30.0, (100.0,))
    assert "sweep" not in study


def test_values_of_a_range_are_round(sweep):
    """0.4, as one would write it and look it up, and not 0.39999999999999997."""
    text = "\n[sweep.over]\ncontact.mu = { start = 0.3, stop = 0.6, count = 4 }\n"
    cases = cases_of(load_study(sweep(text)))
    assert [case["contact.mu"] for case in cases] == [0.3, 0.4, 0.5, 0.6]


def test_a_row_of_empty_cells_is_the_study_itself(sweep):
    """An empty cell leaves its key as it is; a blank line is no case."""
    path = sweep("\n[sweep]\ncases = 'cases.csv'\n")
    path.with_name("cases.csv").write_text("contact.mu,model.pull\n,\n0.4,\n\n")
    cases = cases_of(load_study(path))
    assert [list(case.values()) for case in cases] == [[None, None], [0.4, None]]


def test_what_cases_share_is_one_step(sweep):
    steps = [step.stage for step in planned(sweep(OVER)).steps]
    counts = {stage: steps.count(stage) for stage in dict.fromkeys(steps)}
    assert counts == {"reduce": 1, "preload": 3, "tune": 3, "respond": 9}


def test_the_content_of_files_counts(sweep):
    """Another table of pairs under the same name: all steps are others; a comment changes none."""
    path = sweep(OVER)
    before = {step.key: step.stage for step in planned(path).steps}
    pairs = path.with_name("pairs.csv")
    pairs.write_text(pairs.read_text() + "\n")
    after = {step.key: step.stage for step in planned(path).steps}
    assert before.keys() & after.keys() == set()
    path.write_text(path.read_text() + "\n# a comment\n")
    assert {step.key for step in planned(path).steps} == after.keys()


def test_of_cases_that_are_the_same_one_is_made(sweep):
    text = OVER.replace("[60, 30, 15]", "[60, 30, 60]")
    found = planned(sweep(text))
    made = [task.case["model.pull"] for task in found.tasks if task.last.stage == "respond"]
    assert (len(found.cases), sorted(made)) == (9, [30] * 3 + [60] * 3)
    assert [task.turn for task in found.tasks] == list(range(len(found.tasks)))


def test_what_a_task_needs_is_before_it(sweep):
    there = set()
    for task in planned(sweep(OVER)).tasks:
        assert {step.key for step in task.before} <= there
        there |= {step.key for step in task.steps}


def test_steps_are_known_by_content(sweep):
    """The same in other words, 30.0 or through another key, is the same step; another friction of
    the law is another response of the same preload."""
    one, two = planned(sweep(OVER)), planned(sweep(OVER.replace("30", "30.0")))
    assert one.last == two.last
    more = planned(sweep(OVER + "respond.damping_ratio = [0.01, 0.02]"))
    assert set(one.last) < set(more.last)


def test_samples_are_a_latin_hypercube_by_their_seed(sweep):
    text = """
[sweep]
samples = 40
seed = {seed}
[sweep.sample]
model.pull = {{ start = 10, stop = 50 }}
respond.damping_ratio = {{ start = 0.001, stop = 0.1, spacing = "log" }}
"""
    cases, again, other = (
        cases_of(load_study(sweep(text.format(seed=seed)))) for seed in (3, 3, 4)
    )
    assert cases == again != other
    pull = np.array([case["model.pull"] for case in cases])
    zeta = np.array([case["respond.damping_ratio"] for case in cases])
    fortieths = np.sort((pull - 10) / 40 * 40).astype(int), np.sort(np.log10(zeta / 1e-3) * 20)
    assert fortieths[0].tolist() == list(range(40))
    assert fortieths[1].astype(int).tolist() == list(range(40))


def test_cases_share_what_is_checked(sweep, monkeypatch):
    """A section is validated once for each of its contents, and a stage reads once what is the
    same; the steps are those of each case alone."""
    path = sweep(
        """
[sweep.over]
model.pull = [60, 30, 15]
respond.levels = { start = 1, stop = 100, count = 5 }
contact.mu = [0.3, 0.5]
"""
    )
    cases, content = cases_of(load_study(path)), read_toml(path)
    alone = [chain(study_of_case(path, content, 1, case))[-1].key for case in cases]
    told = []
    validated, read, real = [], [], plan_module.read_from

    def validate(section, given, **options):
        validated.append(section.__name__)
        return BaseModel.model_validate.__func__(section, given, **options)

    monkeypatch.setattr(StudySection, "model_validate", classmethod(validate))
    monkeypatch.setattr(
        plan_module, "read_from", lambda name, *a: read.append(name) or real(name, *a)
    )
    whole = plan(path, content, cases, lambda *said: told.append(said))
    assert list(whole.last) == alone
    assert (len(told), told[14]) == (30, (0.5, "15 of 30 cases"))
    once = ("Top", "Tune", "Free", "PreloadSection")
    assert Counter(validated) == {
        **dict.fromkeys(once, 1),
        "Model": 3,
        "Respond": 5,
        "ContactSection": 2,
        "SideSection": 2,
    }
    assert Counter(read) == {"reduce": 1, "preload": 6, "tune": 3, "respond": 5}


def test_a_table_of_cases(sweep, tmp_path):
    (tmp_path / "cases.csv").write_text(
        'model.pull,respond.levels,contact.right.shape\n60,"[1, 5]",\n30,2,flat\n'
    )
    path = sweep('[sweep]\ncases = "cases.csv"\n[sweep.over]\ntune.stations = [[1, 1], [2, 2]]')
    cases, content = cases_of(load_study(path)), read_toml(path)
    assert len(cases) == 4
    assert cases[1] == {
        "tune.stations": [1, 1],
        "model.pull": 30,
        "respond.levels": 2,
        "contact.right.shape": "flat",
    }
    first = study_of_case(path, content, 1, cases[0])
    assert (first.respond.levels, first.sides["right"].shape) == ((1.0, 5.0), "cylinder")


def test_a_key_twice_in_a_table(sweep, tmp_path):
    (tmp_path / "cases.csv").write_text("model.pull,model.pull\n60,30\n")
    with pytest.raises(InputError, match=r"cases.csv: model.pull stands in its first line twice"):
        planned(sweep('[sweep]\ncases = "cases.csv"'))


def test_files_of_cases_are_looked_at(sweep):
    """All of them, before anything is made."""
    path = sweep('[sweep.over]\nmodel.matrices = ["model.npz", "other.npz"]')
    with pytest.raises(InputError) as raised:
        planned(path)
    assert "case 2 (model.matrices = other.npz): [model] matrices: file not found" in str(
        raised.value
    )


REFUSED = [
    ("model.pul = [1]", "unknown key 'pul'; did you mean 'pull'"),
    ("modl.pull = [1]", "unknown key 'modl'; did you mean 'model'"),
    (
        "contact.middle.kn = [1e6]",
        "no section [contact.middle]; there are left, right. A side of a",
    ),
    ("pull = [1]", "is no key of a section of the study, such as damper.pull"),
    ("sweep.seed = [1]", "is no key of a section"),
    ("model.pull = []", "model.pull has an empty list"),
    ("model.pull = 3", "model.pull must be a list or"),
    ("model.pull = { start = 1, stop = 1, count = 3 }", "the range is empty: start = stop = 1"),
    ("model.pull = { start = 1, stop = 2, count = 0 }", "count must lie between 1"),
    ("model.pull = { start = 1, stop = 2 }", "count is missing"),
    ("model.pull = { start = 0, stop = 2, count = 3, spacing = 'log' }", "above 0"),
    ("model.pull = { start = 1, stop = 2, count = 3, step = 1 }", "unknown key 'step'"),
    ("model.pull = [5, -1]", "case 2 (model.pull = -1): [model] pull = -1: must be above 0"),
    ("model.pull = { start = 1 }", "over = { model = { pull = { start = 1 } } }: model.pull"),
    ("damper.pull = [1]", "matrices and no [damper]: model.pull"),
    ("blades.modes = [4]", "[sweep] blades.modes: the study has matrices and no [blades]"),
    ('model.pull = [1]\nmodel."pull" = [2]', "Cannot overwrite a value"),
]


@pytest.mark.parametrize("line, answer", REFUSED)
def test_what_is_refused(sweep, line, answer):
    """Before anything is computed, naming key, value and case."""
    with pytest.raises(InputError) as raised:
        planned(sweep("\n[sweep.over]\n" + line))
    assert answer in str(raised.value)
    assert "study.toml" in str(raised.value)


@pytest.mark.parametrize("option", [[], ["--dry-run"]])
def test_more_stations_than_there_are_are_refused_at_the_door(sweep, capsys, option):
    """Before anything is made, with the number of the case."""
    over = "\n[sweep.over]\ntune.stations = [[1, 1], [3, 2]]\ncontact.mu = [0.3, 0.5]\n"
    path = sweep(over)
    assert main(["sweep", str(path), "--jobs", "1", "--quiet", *option]) == 2
    error = capsys.readouterr().err
    assert (
        "[sweep] case 3 (tune.stations = [3, 2], contact.mu = 0.3): tune.stations = [3, 2]: "
        in error
    )
    assert "there are 3 stations" in error and error.count("\n") == 1
    assert not (path.parent / "results" / "study" / "sweep" / "made").exists()


def test_a_study_without_cases(sweep):
    for text, answer in [("", "section [sweep] is missing"), ("[sweep]", "names no case")]:
        with pytest.raises(InputError, match=answer.replace("[", r"\[")):
            planned(sweep(text))


def test_a_table_parted_by_semicolons_is_told(sweep):
    path = sweep('\n[sweep]\ncases = "cases.csv"\n')
    path.with_name("cases.csv").write_text("contact.mu;model.pull\n0,4;60\n")
    with pytest.raises(InputError, match="cells are parted by commas, decimals are points"):
        planned(path)
