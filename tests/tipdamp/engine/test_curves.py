"""The store of curves: only what is missing is made, whatever ended the run before."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.hbm.search.test_curves_beside import ABSORBER, HZ
from tests.tipdamp.report.files import table
from tests.tipdamp.rig_study import CHAIN, CHAIN_OF_STAGES, files
from tests.tipdamp.rig_study import run_chain as run
from tipdamp.cli import main
from tipdamp.engine import curves, further
from tipdamp.engine.further import (
    cross_levels,
    follow_further,
    level_branches,
    level_search,
)
from tipdamp.engine.store import Store
from tipdamp.hbm.curve.journal import Journal, JournalBlock
from tipdamp.hbm.drawing.figure import Curve
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.laws import IsotropicFriction
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.search.beside import Search
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects import peaks, response
from tipdamp.stages import response_doubts
from tipdamp.stages.curve_facts import curve_result
from tipdamp.study.schema import Respond

ROOT = Path(__file__).parents[3]
# Without a search: twice in a fresh checkout a repeated study said something else with one, why is
# not known
STUDY = CHAIN.replace("levels = [5]", "levels = [5, 40]\nsearch = 0")


@pytest.fixture
def study(matrices_study):
    matrices_study.write_text(STUDY)
    return matrices_study


def results(study):
    """Everything that the responses say, but for the time that they took."""
    store = Store(study.parent / "results" / study.stem)
    found = store.read_json("respond.json")
    for one in found["responses"]:
        one["seconds"] = None
    return found, {
        p.name: ForcedResponse.load(p) for p in sorted(store.path("responses").glob("*.npz"))
    }


def test_extended_studies_make_what_is_missing(study, made):
    assert run(study) == 0
    assert made == ["Fe_40N_H1", "Fe_5N_H1"]
    made.clear()
    study.write_text(
        STUDY.replace("[5, 40]", "[5, 12.5, 40]").replace("harmonics = [1]", "harmonics = [3, 1]")
    )
    assert run(study) == 0
    assert made == [
        "Fe_40N_H3",
        "Fe_12.5N_H3",
        "Fe_5N_H3",
        "Fe_12.5N_H1",
    ]
    made.clear()
    study.write_text(STUDY.replace("damping_ratio = 0.01", "damping_ratio = 0.011"))
    assert run(study) == 0 and len(made) == 2
    left = sorted(p.name for p in (study.parent / "results" / "study" / "responses").iterdir())
    assert left == ["Fe_40N_H1.npz", "Fe_5N_H1.npz"]
    made.clear()
    assert run(study, "--force") == 0 and len(made) == 2


def test_curves_that_may_differ_are_followed_back(study, made, monkeypatch):
    """Those whose far end is not found again by itself; where it is, both ways give one curve."""
    monkeypatch.setattr(ForcedResponse, "alike_backwards", property(lambda curve: curve.H == 1))
    study.write_text(STUDY.replace("harmonics = [1]", "harmonics = [1, 3]"))
    assert run(study) == 0
    of_three = ["Fe_40N_H3", "Fe_5N_H3"]
    assert made == [*of_three, "Fe_40N_H1", "Fe_5N_H1", *(f"{name}_back" for name in of_three)]
    for one in results(study)[0]["responses"]:
        assert (one["back"] is None) == one["alike_backwards"] == (one["H"] == 1)
        if one["back"]:
            assert one["back"]["peak_m"] == pytest.approx(one["peak_m"], rel=1e-7)
    study.write_text(STUDY.replace("levels", "both_ways = false\nlevels"))
    made.clear()
    assert run(study) == 0 and made == []


def test_jobs_do_not_change_the_numbers(study):
    assert run(study, "--jobs", "2") == 0
    two = results(study)
    assert run(study, "--force") == 0 and results(study) == two


def test_everything_counts_in_the_key(tmp_path):
    """Each field of the problem, those of its records too; only the words for motions do not."""
    problem = oscillator()
    base = curves.Curves(problem, FORCE.real, Y2, None, Store(tmp_path))
    case = curves.CurveCase(1.0, 3, (1.0, 2.0))

    def other(**changes):
        return replace(base, problem=replace(problem, **changes))

    two, x = np.ones(2), np.ones(6)
    changed = [
        other(M=1.1 * problem.M),
        other(C=1.1 * problem.C),
        other(K=1.1 * problem.K),
        other(B=1.1 * problem.B),
        other(C=None, damping_ratio=0.01),
        other(static=x),
        other(preloaded=True),
        other(law=IsotropicFriction()),
        other(held=(HeldMotion("along y", "N", x, x, 10.0),)),
        other(held=(HeldMotion("along y", "N", x, x, 20.0),)),
        *(
            other(contacts=replace(problem.contacts, **{f.name: 7 * two}))
            for f in fields(problem.contacts)
        ),
        replace(base, force=x),
        replace(base, rows={"y2": x}),
        replace(base, rows={"y": Y2["y2"]}),
        replace(base, start=np.zeros((2, 2))),
    ]
    keys = [made.key(case) for made in (base, *changed)]
    keys += [
        base.key(replace(case, **one)) for one in ({"Fe_N": 2.0}, {"H": 4}, {"band": (2.0, 1.0)})
    ]
    assert len(set(keys)) == len(keys)
    assert other(describe=len).key(case) == base.key(case) == replace(base).key(case)


def looked_beside(made, case, effort):
    """The case with its curve, and with what an effort finds beside it."""
    made.make(case, lambda *_: None)
    search = level_search(made, [case], [effort])
    branches = level_branches(made, search)
    for branch in branches:
        cross_levels(made, branch, lambda *_: None)
    follow_further(made, (search.cases[0], branches), lambda *_: None)
    return search.cases[0]


def test_small_models_are_searched_all_round(tmp_path, monkeypatch):
    """0.3 of a curve of a small model are some hundred evaluations, and three of twelve
    frequencies; a large one has its share."""
    force = np.eye(2)[0]
    rows = {"patch:1": force}
    absorber = curves.Curves(ABSORBER.contact_problem, force, rows, None, Store(tmp_path))
    case = curves.CurveCase(0.0311, 1, (0.6 * HZ, 1.6 * HZ))
    absorber.make(case, lambda *_: None)
    share = Respond.model_fields["search"].default
    assert level_search(absorber, [case], [share]).calls == Search().least_calls
    assert level_search(absorber, [case], [0.0]).calls == 0
    monkeypatch.setattr(further, "SMALL", 1)
    own = share * absorber.load(case).residual_calls
    assert level_search(absorber, [case], [share]).calls == pytest.approx(own)


def test_curves_that_are_found_beside_one(tmp_path, made):
    """The detached resonance of an absorber is kept beside its curve, which says what was looked
    for; another effort makes the search anew, not the curve."""
    store, force = Store(tmp_path), np.eye(2)[0]
    absorber = curves.Curves(ABSORBER.contact_problem, force, {"patch:1": force}, None, store)
    case = looked_beside(absorber, curves.CurveCase(0.0311, 1, (0.6 * HZ, 1.6 * HZ)), 4.0)
    assert absorber.finished(case) and made == [case.name]
    files = absorber.files(case)
    assert [Path(file).name for file in files] == [
        "Fe_0.0311N_H1.npz",
        "Fe_0.0311N_H1_beside.json",
        "Fe_0.0311N_H1_beside1.npz",
    ]
    curve, beside = absorber.load(case), absorber.beside(case)
    assert "1 further curve found" in curve.searched and list(beside) == files[2:]
    band = list(case.band)
    settings = Respond(levels=[case.Fe_N], band=band, damping_ratio=0.01, patches=["patch"])
    facts = curve_result(settings, table(), absorber.problem, case, (curve,), beside)
    (found,) = facts.beside
    assert found.closed and found.complete
    assert found.highest_m > 18 * facts.peak_m
    assert found.from_hz < 0.93 * HZ < found.to_hz
    (said,) = response_doubts._beside(facts)
    assert "lies a further curve, detached, over 0.1153 to 0.1542 Hz" in said
    reported = ReportedCurve(facts, curve, tuple(beside.values()))
    assert peaks._trusted(Results(study=None), reported)["beside"] == "1"
    shown = SimpleNamespace(first_patch="patch")
    drawn = [
        item
        for item in response._family_curve(shown, reported, "red", 1.0)
        if isinstance(item, Curve)
    ]
    # stable and dashed parts, each with gaps where the other is
    highest = max(drawn, key=lambda item: np.nanmax(item.y, initial=0.0))
    assert np.nanmax(highest.y) > 18 * np.nanmax(drawn[0].y) and highest is not drawn[0]
    assert highest.x.max() < case.band[1]
    assert absorber.finished(replace(case, search=""))
    assert looked_beside(absorber, case, 4.0) == case
    share = looked_beside(absorber, case, Respond.model_fields["search"].default)
    assert "1 further curve found" in absorber.load(share).searched
    less = looked_beside(absorber, case, 0.0)
    assert less.search not in ("", case.search) and not absorber.finished(case)
    assert made == [case.name] and absorber.files(less) == files[:2]
    assert not store.path(files[2]).exists() and "more may exist" in absorber.load(less).searched


def test_levels_that_look_alike_have_files_of_their_own():
    names = {
        curves.CurveCase(level, 1, (1.0, 2.0)).name
        for level in (5.0, 5.0000001, 1e-7, 1.00000001e-7)
    }
    assert len(names) == 4


def interrupted(study, made, monkeypatch):
    """The study, interrupted in its second curve; the store, and what the whole study gives."""
    monkeypatch.setattr(Journal, "every", 0.01)
    assert run(study) == 0
    whole = results(study)
    (study.parent / "results").rename(study.parent / "whole")
    real, calls = curves.follow_band, []

    def stopped(*arguments, **options):
        def progress(*_):
            calls.append(len(made))
            if len(made) == 2 and calls.count(2) == 25:
                raise KeyboardInterrupt

        return real(*arguments, **{**options, "progress": progress})

    made.clear()
    monkeypatch.setattr(curves, "follow_band", stopped)
    assert run(study) == 130
    monkeypatch.setattr(curves, "follow_band", real)
    made.clear()
    return Store(study.parent / "results" / "study"), whole


def test_a_block_costs_the_same_however_many_there_are(tmp_path, monkeypatch):
    """Its file alone is asked for, and a further run goes on with the next number."""
    problem, store = oscillator(), Store(tmp_path)
    one = curves.Curves(problem, FORCE.real, Y2, None, store)
    case, asked, real = curves.CurveCase(1.0, 3, (1.0, 2.0)), [], Store.path
    monkeypatch.setattr(Store, "path", lambda self, name: asked.append(name) or real(self, name))
    blocks = [JournalBlock(np.array([float(i)]), np.array([i, 1, 0, 0])) for i in range(12)]
    for part in (blocks[:8], blocks[8:]):
        keep, before = one._keep(case), len(asked)
        for block in part:
            keep(block)
        assert len(asked) - before <= len(part)
    assert [block.numbers[0] for block in one._journal(case)] == list(range(12))


def test_curves_of_an_interrupted_study(study, made, monkeypatch, capsys):
    """One curve is kept, and the second goes on."""
    store, whole = interrupted(study, made, monkeypatch)
    assert "interrupted; finished stages and curves are kept" in capsys.readouterr().err
    assert list(store.path(".stages").glob("Fe_5N_H1.*.npz"))
    assert run(study) == 0 and made == ["Fe_5N_H1"]
    assert results(study) == whole and not list(store.path(".stages").glob("Fe_*.npz"))


@pytest.mark.parametrize("how", ["flipped", "cut", "of another curve", "pickled"])
def test_a_damaged_journal_is_not_used(study, made, monkeypatch, how, tmp_path):
    store, whole = interrupted(study, made, monkeypatch)
    block = sorted(store.path(".stages").glob("Fe_5N_H1.*.npz"))[-1]
    content = bytearray(block.read_bytes())
    if how == "flipped":
        content[len(content) // 2] ^= 16
    elif how == "cut":
        content = content[:-100]
    block.write_bytes(content)
    if how == "of another curve":
        with np.load(block) as z:
            np.savez(block, numbers=z["numbers"], layout=np.r_[12345, z["layout"][1:]])
    elif how == "pickled":
        np.savez(
            block,
            numbers=np.array([Planted(tmp_path / "ran")], dtype=object),
            layout=np.zeros(1, dtype=int),
        )
    assert run(study) == 0 and results(study) == whole and not (tmp_path / "ran").exists()


class Planted:
    """Makes a file when it is unpickled."""

    def __init__(self, file):
        self.file = file

    def __reduce__(self):
        return Path.touch, (self.file,)


def test_old_curves_are_swept_or_named(study, made, caplog):
    """Those of a run that never came to its end; one of them was changed by hand, one record is
    forged."""
    assert run(study) == 0
    store = Store(study.parent / "results" / "study")
    store.path(".stages/respond.json").unlink()
    store.write_json("notes.json", {"mine": 1})
    forged = json.loads(store.path(".stages/Fe_40N_H1.json").read_text())
    store.finish("Fe_7N_H1", forged["key"], ["notes.json"], 1.0)
    for name in ("Fe_5N_H1.00.7.npz", ".tmp-1234-Fe_5N_H1.npz"):
        store.path(f".stages/{name}").write_bytes(b"litter")
    store.path("responses/.tmp-77-Fe_5N_H1.npz").write_bytes(b"litter")
    changed = store.path("responses/Fe_40N_H1.npz")
    changed.write_bytes(changed.read_bytes() + b"by hand")
    study.write_text(STUDY.replace("[5, 40]", "[5]"))
    made.clear()
    assert main(["respond", str(study), "--quiet"]) == 0 and made == []
    there = {str(p.relative_to(store.folder)) for p in files(store.folder)}
    assert {n for n in there if "Fe_" in n} == {
        "responses/Fe_5N_H1.npz",
        "responses/Fe_40N_H1.npz",
        ".stages/Fe_5N_H1.json",
    }
    assert store.path("notes.json").is_file()
    assert "Fe_40N_H1.npz is not of this study, and was changed; it stays" in caplog.text


def test_planted_records_touch_nothing(study, tmp_path):
    """A folder and a link out of the results folder in the places of two records."""
    assert run(study) == 0
    whole, store = results(study), Store(study.parent / "results" / "study")
    (tmp_path / "victim").write_text("precious")
    for name in ("respond", "Fe_40N_H1", "Fe_5N_H1"):
        store.path(f".stages/{name}.json").unlink()
    store.path(".stages/Fe_40N_H1.json").mkdir()
    (store.folder / ".stages" / "Fe_5N_H1.json").symlink_to(tmp_path / "victim")
    assert main(["respond", str(study), "--quiet"]) == 0 and results(study) == whole
    assert (
        (tmp_path / "victim").read_text() == "precious"
        and store.record("Fe_40N_H1")
        and store.record("Fe_5N_H1")
    )


@pytest.mark.parametrize("what", ["curve", "record", "no curve"])
def test_damage_is_noticed_and_made_good(study, made, what, caplog):
    assert run(study) == 0
    whole = results(study)
    store = Store(study.parent / "results" / "study")
    random = np.random.default_rng(5)
    store.path(".stages/respond.json").unlink()
    path = store.path(".stages/Fe_40N_H1.json" if what == "record" else "responses/Fe_40N_H1.npz")
    content = bytearray(path.read_bytes())
    content[random.integers(len(content))] ^= 4
    path.write_bytes(content)
    if what == "no curve":
        path.unlink()
    made.clear()
    assert main(["respond", str(study), "--quiet"]) == 0
    assert made == ["Fe_40N_H1"] and results(study) == whole
    assert caplog.text.count("is damaged, changed or gone; it is made anew") == ("curve" in what)


def alive(mark):
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            found += [process.name] * (
                f"MARK={mark}".encode() in (process / "environ").read_bytes().split(b"\0")
            )
        except OSError:
            pass
    return found


ENDED = """
import os, signal, sys
from contextlib import contextmanager
from tipdamp.hbm.curve.journal import Journal, JournalBlock
from tipdamp.engine.store import Store
from tipdamp.engine.workers import Workers

Journal.every, how, left = 0.0, int(sys.argv.pop(1)), [int(sys.argv.pop(1))]


def counted():
    left[0] -= 1
    if not left[0]:
        os.kill(os.getpid(), how)


@contextmanager
def writing(self, name, real=Store.writing):
    counted()
    with real(self, name) as path:
        yield path
        counted()


def heard(self, *given, real=Workers._heard):
    counted()
    yield from real(self, *given)


Store.writing, Workers._heard = writing, heard
from tipdamp.cli import command
command()
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "how, code, jobs, at",
    [
        (signal.SIGKILL, -9, 1, (40, 400)),
        (signal.SIGKILL, -9, 2, (3, 6)),
        (signal.SIGTERM, 143, 2, (6,)),
        (signal.SIGINT, 130, 1, (399,)),
    ],
)
def test_ended_in_the_middle_of_things(study, how, code, jobs, at):
    """By a signal before or within a write, and while others are at work: the same numbers, no
    finished curve made twice, no process and no litter left. The moments are counts of writes and
    messages, not times."""
    assert run(study) == 0
    whole = results(study)
    (study.parent / "results").rename(study.parent / "whole")
    for stage in CHAIN_OF_STAGES[:-1]:
        assert main([stage, str(study), "--quiet"]) == 0
    store, kept = Store(study.parent / "results" / "study"), {}
    for attempt, count in enumerate((*at, 10**9)):
        mark = f"{os.getpid()}-{how}-{jobs}-{attempt}"
        process = subprocess.run(
            [
                sys.executable,
                "-c",
                ENDED,
                str(int(how)),
                str(count),
                "respond",
                str(study),
                "--quiet",
                "--jobs",
                str(jobs),
            ],
            text=True,
            capture_output=True,
            env={**os.environ, "MARK": mark, "PYTHONPATH": str(ROOT)},
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )
        last = count == 10**9
        assert (process.returncode, process.stderr.count("\n")) == (
            (0, 0) if last else (code, int(code > 0))
        ), process.stderr
        now = {p.name: p.stat().st_mtime_ns for p in store.path("responses").glob("Fe_*.npz")}
        assert kept.items() <= now.items(), "a finished curve was made again"
        began = time.monotonic()
        while alive(mark):
            assert time.monotonic() - began < 300
            time.sleep(0.05)
        kept = {
            name: now[name] for name in now if store.path(f".stages/{name[:-4]}.json").is_file()
        }
    assert results(study) == whole
    assert not list(store.folder.rglob(".tmp-*")) and not list(
        store.path(".stages").glob("Fe_*.npz")
    )


def test_named_points_of_a_study(study):
    """Pairs that begin to slip are named; without stability of all points the names go."""
    study.write_text(STUDY.replace("levels = [5, 40]", 'levels = [40]\nstability = "all"'))
    assert run(study) == 0
    store = Store(study.parent / "results" / "study")
    (one,) = store.read_json("respond.json")["responses"]
    begin = next(point for point in one["named"] if point["kind"] == "onset of slip")
    assert begin["pair"] in one["slipping_pairs"] and 900 < begin["hz"] < 1400
    assert begin["within_hz"] < 1e-3 and 0 < begin["largest_m"] < one["peak_m"]
    study.write_text(STUDY.replace("levels = [5, 40]", "levels = [40]"))
    assert run(study) == 0
    assert store.read_json("respond.json")["responses"][0]["named"] == []
