"""Small made-up results as the stages leave them, for tests of the report; no finite elements.

Two sides of five stations, two rows on the right; the curves are those of one damped mass (2800 Hz,
zeta 0.022)."""

import json
from dataclasses import replace

import numpy as np

from tipdamp.engine.store import Store, plain
from tipdamp.engine.workers import Workers
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.result import ForcedResponse
from tipdamp.report.results import Results, load_results
from tipdamp.report.write import write_report
from tipdamp.stages.curve_facts import peak_of
from tipdamp.stages.report import said
from tipdamp.statics.model_inputs import in_patch
from tipdamp.study.study import load_study

STUDY = """
title = {title}
[model]
matrices = "rig.npz"
pull = 100
[contact]
pairs = "pairs.csv"
[contact.left]
shape = "cylinder"
[contact.right]
shape = "flat"
width = 1.6e-3
rows = "edge"
{rest}
[reference]
out_of_phase_hz = 1590
tuned_hz = 2800
front = 2
back = 2
"""
FULL = """
[tune]
target_hz = 2800
[respond]
levels = [1, 20]
harmonics = [1, 3]
band = [2300, 3300]
damping_ratio = 0.022
"""
HOSTILE = "<script>alert('x')</script> & $a_$ %{y}"
HOSTILE_NAMES = {"left": f"<b>{HOSTILE}", "patch_1": f"<img src=x onerror=alert(1)>{HOSTILE}"}


def table(weight=None, preload=10.0):
    side = np.array(["left"] * 5 + ["right"] * 10)
    station = np.r_[np.arange(5), np.repeat(np.arange(5), 2)]
    row = np.r_[np.zeros(5), np.tile([0, 1], 5)]
    n = len(side)
    return ContactTable(
        side,
        station,
        row,
        ["blades"] * n,
        np.arange(n),
        ["damper"] * n,
        np.arange(n),
        np.column_stack([np.zeros(n), 0.01 * station, np.zeros(n)]),
        np.tile(np.eye(3), (n, 1, 1)),
        np.zeros(n),
        np.full(n, 1e6),
        np.full(n, 9e5),
        np.full(n, 0.6),
        np.full(n, preload),
        np.ones(n) if weight is None else weight,
    )


def curve(Fe, H, failed=()):
    hz = np.linspace(2300, 3300, 41)
    x = 1e-6 * Fe * 0.044 / (1 - (hz / 2800) ** 2 + 0.044j * hz / 2800)
    harmonics = np.zeros((len(hz), 4, H + 1), dtype=complex)
    harmonics[:, :, 1] = x[:, None] * [1.0, 0.9, 0.5, 0.4]
    good = ~np.isin(np.arange(len(hz)), failed)
    harmonics[~good] = np.nan
    share = np.where(good, 0.2, np.nan)[:, None] * np.ones(6) * (Fe > 1)
    names = np.array(["patch_1:1", "patch_1:2", "patch_2:3", "patch_2:4"])
    return ForcedResponse(
        frequency=hz,
        output_names=names,
        harmonics=harmonics,
        parameter_name="frequency",
        parameter=hz,
        share_stick=1 - share,
        share_slip=share,
        share_open=0 * share,
        dissipated=share,
        converged=good,
        iterations=np.ones(len(hz), int),
        ended="reached the end of the band",
        complete=bool(good.all()),
        H=H,
        origin="preloaded",
        start="zero_slider",
        seconds=0.5,
        residual_calls=100,
        reached_end=True,
    )


def side_figures():
    return {
        s: {
            "sum_N": 70.0,
            "min_N": 1.0,
            "max_N": 9.0,
            "detached": 0,
            "equilibrium_N": 70.0,
            "balance_error": 1e-15,
        }
        for s in ("left", "right")
    }


def artefacts(folder, title="A rig", sections=FULL, failed=(), damage=None, names=None):
    """(study, store) with the files that the stages leave; `damage` changes {file: content} before
    it is written, names {name: another} those of sides and patches."""
    names = names or {}
    text = STUDY.format(title=json.dumps(title), rest=sections)
    for name, other in names.items():
        text = text.replace(f"contact.{name}", f"contact.{json.dumps(other)}")
    if names and sections == FULL:
        text = text.replace(
            "levels =", f'patches = [{json.dumps(names["patch_1"])}, "patch_2"]\nlevels ='
        )
    study_file = folder / "rig.toml"
    study_file.write_text(text, encoding="utf-8")
    study = load_study(study_file)
    store = Store(study.results)
    hz = np.linspace(1400, 1900, 50)
    kept = table(np.r_[1, 1, 0, 1, 1, [1, 0] * 2, 0, 0, [1, 0] * 2])
    files = {
        "inspect.json": {
            "bodies": {"blades": {"dofs": 90}, "damper": {"dofs": 30}},
            "pairs": {"left": 5, "right": 10},
        },
        "reduce.json": {
            "reduction": {"dofs": 120, "masters": 60, "modes": {"blades": 4, "damper": 2}},
            "rows": {"left": 1, "right": 2},
            "free_modes_hz": [1591.0, 1664.0],
            "free_hz": {"out_of_phase": 1591.0, "in_phase": 1664.0},
            "free_response": {
                "hz": hz,
                "m_per_N": {"patch_1": 1e-6 + 0 * hz, "patch_2": 2e-6 + 0 * hz},
            },
        },
        "preload.json": {
            "kn_kt_N_per_m": {"left": [1e6, 9e5], "right": [1e6, 9e5]},
            "sides": side_figures(),
            "residual": 1e-15,
            "iterations": 3,
            "method": "newton",
        },
        "tune.json": {
            "target_hz": 2800.0,
            "tuned_pairs": {"front": 2, "back": 2},
            "history": [
                {"front": 3, "back": 2, "hz": 2900.0, "mac": 0.8},
                {"front": 2, "back": 2, "hz": 2801.0, "mac": 0.9},
            ],
            "stuck_modes_hz": {"full_area": [3000.0], "full_line": [2900.0], "tuned": [2801.0]},
            "closed_pairs": {"full_area": 15, "full_line": 10, "tuned": 8},
            "open_pairs": {"full_area": 0, "full_line": 0, "tuned": 0},
            "stuck_hz": {"full_area": 3000.0, "full_line": 2900.0, "tuned": 2801.0},
            "mac": {"full_area": 0.7, "full_line": 0.8, "tuned": 0.9},
            "full_model_check": {
                "tuned": {"reduced_hz": [2801.0], "full_hz": [2800.9], "largest_error": 4e-5}
            },
            "preload_kept": side_figures(),
            "redistribution": {"scale": {"left": 1.5, "right": 1.6}, "moment_Nm": 1e-14},
            "roll_stiffness_Nm_per_rad": 1.7,
        },
        "kept": kept,
        "responses": [],
    }
    for H in (1, 3):
        for Fe in (1.0, 20.0):
            one = curve(Fe, H, failed if Fe > 1 else ())
            name = f"responses/Fe_{Fe:g}N_H{H}.npz"
            with store.writing(name) as path:
                replace(one, output_names=renamed(one.output_names, names)).save(path)
            peak = peak_of(one, in_patch(one.output_names, "patch_1")).model_dump()
            files["responses"].append(
                {
                    "file": name,
                    "Fe_N": Fe,
                    "H": H,
                    **peak,
                    "points": 41,
                    "patches": {},
                    "residual_calls": 100,
                    "failed_points": len(failed) if Fe > 1 else 0,
                    "complete": one.complete,
                    "ended": one.ended,
                    "slipping_pairs": ["left 0", "left 1", "right 4"] if Fe > 1 else [],
                    "seconds": 0.5,
                    "origin": "preloaded",
                    "start": "zero_slider",
                    "back": {
                        **peak,
                        "complete": True,
                        "ended": "",
                        "failed_points": 0,
                        "seconds": 0.5,
                    },
                }
            )
    if damage:
        damage(files)
    for name, pairs in (("preload.csv", table()), ("kept.csv", files["kept"])):
        with store.writing(name) as path:
            pairs.replace(side=renamed(pairs.side, names)).save(path)
    for name in ("inspect", "reduce", "preload", "tune"):
        store.write_json(f"{name}.json", renamed_json(files[f"{name}.json"], names))
        store.finish(name, "key", [f"{name}.json"], 1.25)
    store.write_json(
        "respond.json",
        renamed_json(
            {
                "responses": files["responses"],
                "law": {"name": "DryFriction2T"},
                "zeta": [0.022],
                "stuck_difference": {
                    f["file"]: 1e-15 for f in files["responses"] if not f["slipping_pairs"]
                },
            },
            names,
        ),
    )
    first = curve(1.0, 1)
    np.savez(
        store.path("stuck.npz"),
        frequency=first.frequency,
        response=first.harmonics[:, :, 1],
        output_names=renamed(first.output_names, names),
    )
    return study, store


def renamed(words, names) -> np.ndarray:
    return np.array(
        [
            next((w.replace(a, b) for a, b in names.items() if w.startswith(a)), w)
            for w in words.tolist()
        ]
    )


def renamed_json(content, names) -> dict:
    text = json.dumps(plain(content))
    for name, other in names.items():
        text = text.replace(f'"{name}', f'"{other}')
    return json.loads(text)


def written(folder, **options):
    """Store of a report that was written."""
    study, store = artefacts(folder, **options)
    write(study, store)
    return store


def write(study, store, jobs=1):
    with Workers(jobs) as workers:
        write_report(study, store, lambda *_: None, said(study, store), workers)


def results_of(study, store) -> Results:
    """The files of the stages, read back."""
    return load_results(study, store, said(study, store))


def damage(stage, *path, value):
    def change(files):
        target = files[stage] if stage == "responses" else files[f"{stage}.json"]
        for key in path[:-1]:
            target = target[key]
        target[path[-1]] = value

    return change


def cut(hz=2700.0, at_least=1.5e-5):
    """The curve of 20 N at H = 3 stopped and has no peak; the other way is complete."""

    def change(files):
        files["responses"][3].update(
            peak_hz=None,
            peak_m=None,
            min_peak_m=None,
            at_least_hz=hz,
            at_least_m=at_least,
            complete=False,
            ended=f"stopped at {hz:g} Hz: the mean friction force is not balanced",
        )

    return change
