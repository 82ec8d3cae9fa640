"""[respond] law = "my_law.py:MyLaw": a file beside the study, that runs where it is allowed."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import run_chain
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import Contacts, DryFriction2T, Motion
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.result import ForcedResponse
from tipdamp.stages.assembly import assembled
from tipdamp.study.own_law import code_allowed
from tipdamp.study.study import load_study

LINEAR = """
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tipdamp.hbm.laws import ContactLaw

Path = print("it runs")


@dataclass(frozen=True)
class Spring(ContactLaw):
    components: ClassVar[tuple] = ("t1",)
    stiffness: float
    more: float = 0.0

    def step(self, motion, state, contacts):
        return (self.stiffness + self.more) * motion.u, state


@dataclass(frozen=True)
class BrokenWhereStiff(ContactLaw):
    components: ClassVar[tuple] = ("t1",)
    stiffness: float = 1.0

    def step(self, motion, state, contacts):
        u = np.abs(motion.u) if self.stiffness > 10 else motion.u
        return self.stiffness * u, state


class Broken(ContactLaw):
    components: ClassVar[tuple] = ("t1",)

    def step(self, motion, state, contacts):
        return np.abs(motion.u), state
"""

SMOOTH = """
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tipdamp.hbm.laws import ContactLaw


@dataclass(frozen=True)
class Smooth(ContactLaw):
    components: ClassVar[tuple] = ("t1",)
    v0: float

    def step(self, motion, state, contacts):
        return (contacts.mu * contacts.preload)[:, None] * np.tanh(motion.v / self.v0), state
"""


def study_with(folder, law, text=LINEAR):
    if text is not None:
        (folder / "my_law.py").write_text(text)
    change = [("[respond]", f"[respond]\nlaw = {law}")]
    return corner_study.write(folder, change=change)


def test_it_runs_only_where_that_is_allowed(tmp_path, capsys):
    study = load_study(study_with(tmp_path, '{ name = "my_law.py:Spring", stiffness = 2e6 }'))
    with pytest.raises(InputError, match=r"law = 'my_law.py:Spring': .* with --allow-code"):
        study.respond.law.make()
    assert capsys.readouterr().out == ""
    with code_allowed():
        law = study.respond.law.make()
    assert capsys.readouterr().out == "it runs\n"
    motion = Motion(np.ones((1, 1)), np.zeros((1, 1)), 1.0)
    assert law.step(motion, np.zeros((1, 0)), Contacts([1], [1], [1], [1]))[0] == 2e6
    with pytest.raises(InputError, match="allow-code"):
        study.respond.law.make()


def test_it_travels_to_other_processes(tmp_path):
    study = load_study(study_with(tmp_path, '{ name = "my_law.py:Spring", stiffness = 2e6 }'))
    with code_allowed():
        law = study.respond.law.make()
    assert pickle.loads(pickle.dumps(law)) == law


def test_the_content_of_the_file_is_part_of_the_study(tmp_path):
    path = study_with(tmp_path, '{ name = "my_law.py:Spring", stiffness = 2e6 }')
    before = load_study(path).respond
    (tmp_path / "my_law.py").write_text(LINEAR + "# another law\n")
    assert load_study(path).respond.model_dump() != before.model_dump()
    with code_allowed(), pytest.raises(InputError, match="has changed since the study was read"):
        before.law.make()


@pytest.mark.parametrize(
    "law, words",
    [
        ('"my_law.py:Sprng"', "has no law 'Sprng'; did you mean 'Spring'"),
        ('"my_law.py:Spring"', "the parameter 'stiffness' of Spring is missing"),
        ('{ name = "my_law.py:Spring", stifness = 1 }', "no parameter 'stifness'; did you mean"),
        ('"my_law.py:Broken"', "does not keep the contract of a law"),
        (
            '{ name = "my_law.py:BrokenWhereStiff", stiffness = 2e6 }',
            "does not keep the contract of a law, stiffness = 2e\\+06: ",
        ),
    ],
)
def test_what_the_file_does_not_hold(tmp_path, law, words):
    chosen = load_study(study_with(tmp_path, law)).respond.law
    with code_allowed(), pytest.raises(InputError, match=words) as error:
        chosen.make()
    assert "[respond] law" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    "law, text",
    [
        ('{ name = "my_law.py:BrokenWhereStiff", stiffness = 5 }', LINEAR),
        ('{ name = "my_law.py:Smooth", v0 = 1e-3 }', SMOOTH),
        ('{ name = "my_law.py:Smooth", v0 = 1e-2 }', SMOOTH),
    ],
)
def test_parameters_of_a_machine_are_tried_at_its_size(tmp_path, law, text):
    """At motions of 1 m this friction is a jump, which no number of samples resolves."""
    chosen = load_study(study_with(tmp_path, law, text)).respond.law
    with code_allowed():
        assert chosen.make().name


@pytest.mark.parametrize(
    "text, words",
    [
        ("import nothing_such", "does not run: ModuleNotFoundError"),
        ("class A(:", "does not run: SyntaxError"),
        ("raise SystemExit(3)", "does not run: SystemExit"),
    ],
)
def test_a_file_that_does_not_run(tmp_path, text, words):
    chosen = load_study(study_with(tmp_path, '"my_law.py:Spring"', text)).respond.law
    with code_allowed(), pytest.raises(InputError, match=words):
        chosen.make()


@pytest.mark.parametrize(
    "law, words",
    [
        ('"my_law.py:Spring"', "file not found: .*my_law.py"),
        ('"my_law:Spring"', "dahl.py:Dahl"),
        ('"my_law.py"', "names a file, not a law in it: write 'my_law.py:NAME'"),
        ('{ name = "my_law.py:Spring", stiffness = "soft" }', "stiffness must be a number"),
    ],
)
def test_refused_when_the_study_is_read(tmp_path, law, words):
    with pytest.raises(InputError, match=words):
        load_study(study_with(tmp_path, law, None))


@pytest.mark.parametrize(
    "law, text, words",
    [
        ('"my_law.py:Sprng"', LINEAR, "has no law 'Sprng'"),
        ('"my_law.py:Broken"', LINEAR, "does not keep the contract"),
        ('"my_law.py:Spring"', "class A(:", "does not run: SyntaxError"),
        ('{ name = "my_law.py:Smooth", v0 = 0 }', SMOOTH, "not finite with v0 = 0"),
    ],
)
def test_told_at_the_door_where_the_file_may_run(tmp_path, law, text, words, recwarn):
    """Not by `respond`, after all that comes before it; of numpy's warnings no line is left."""
    path = study_with(tmp_path, law, text)
    load_study(path)
    with code_allowed(), pytest.raises(InputError, match=words) as error:
        load_study(path)
    said = str(error.value)
    assert said.startswith(f"{path}: [respond] law = 'my_law.py:") and said.count("[respond]") == 1
    assert not recwarn.list


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """The first study, with a law beside it that is a shipped one under another name."""
    folder = tmp_path_factory.mktemp("first")
    main(["init", str(folder)])
    text = "from tipdamp.hbm.laws import DryFriction2T\n\n\nclass Mine(DryFriction2T):\n    pass\n"
    (folder / "my_law.py").write_text(text)
    study = folder / "study.toml"
    change = '[respond]\nlaw = "my_law.py:Mine"\nsearch = 0\nboth_ways = false'
    text = study.read_text().replace("levels = [2, 10, 20]", "levels = [10]")
    study.write_text(text.replace("[respond]", change))
    return study


@pytest.mark.slow
def test_a_run_is_refused_before_it_begins(first, capsys):
    assert main(["run", str(first), "--quiet"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1 and "--allow-code" in said.err


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_curves_of_a_law_by_file(first, jobs, capsys, tmp_path):
    """As those of the same law called in Python, in this process and beside it; the report names
    it."""
    out = tmp_path / "out"
    call = ["run", str(first), "--quiet", "--jobs", jobs, "--allow-code", "--out", str(out)]
    assert main(call) == 0
    found = ForcedResponse.load(out / "responses" / "Fe_10N_H5.npz")
    with code_allowed():
        curves = assembled(load_study(first), Store(out)).curves
    problem = replace(curves.problem, law=DryFriction2T())
    options = {"harmonics": 5, "outputs": curves.rows, "peaks": curves.peaks}
    alone = follow_band(problem, 10 * curves.force, (1000, 1700), **options)
    assert found.peak("patch_2:8")[1] == pytest.approx(alone.peak("patch_2:8")[1], rel=1e-9)
    law = json.loads((out / "respond.json").read_text())["law"]
    assert law["name"] == "my_law.py:Mine" and len(law["content"]) == 64
    assert "my_law.py:Mine" in (out / "report.html").read_text()


@pytest.mark.slow
def test_another_law_is_computed_anew_and_a_sweep_knows_it(first, capsys):
    assert run_chain(first, "--jobs", "1", "--allow-code") == 0
    capsys.readouterr()
    assert main(["respond", str(first), "--quiet", "--jobs", "1"]) == 0
    assert "up to date" in capsys.readouterr().out
    file = first.with_name("my_law.py")
    file.write_text(file.read_text() + "\n# looked at again\n")
    assert main(["respond", str(first), "--quiet", "--jobs", "1"]) == 2
    assert "--allow-code" in capsys.readouterr().err
    assert main(["respond", str(first), "--quiet", "--jobs", "1", "--allow-code"]) == 0
    assert "[respond] law changed" in capsys.readouterr().out
    first.write_text(first.read_text() + "\n[sweep.over]\nmodel.pull = [50, 60]\n")
    assert main(["sweep", str(first), "--quiet", "--jobs", "2"]) == 2
    assert "--allow-code" in capsys.readouterr().err
    assert main(["sweep", str(first), "--quiet", "--jobs", "2", "--allow-code"]) == 0
