"""summary.json: what is promised of it, and the warnings."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, cut, damage, results_of
from tipdamp.checks.pairs import pair_names
from tipdamp.report.checks import warnings_of
from tipdamp.report.introduction import introduction
from tipdamp.report.summary import summarise

# at least these, and so deep                                               [what a run promises to
# leave]
PROMISED = {
    "free_hz": {"out_of_phase", "in_phase"},
    "stuck_hz": {"full_area", "full_line", "tuned"},
    "tuned_pairs": {"front", "back"},
    "reduction": {"dofs", "masters", "modes"},
    "seconds": set(),
    "versions": {"tipdamp", "python", "numpy", "scipy", "numba"},
    "warnings": set(),
}
SIDE_FIGURES = {"sum_N", "min_N", "max_N", "detached", "equilibrium_N", "balance_error"}
RESPONSE_FIGURES = {
    "Fe_N",
    "H",
    "peak_hz",
    "peak_m",
    "min_peak_m",
    "points",
    "failed_points",
    "slipping_pairs",
    "seconds",
    "back",
}


def test_summary_holds_what_is_promised(plain_report):
    summary = json.loads(plain_report.path("summary.json").read_text())
    for key, inside in PROMISED.items():
        assert key in summary and inside <= set(summary[key])
    for key in ("preload", "preload_kept"):
        assert (
            all(SIDE_FIGURES == set(side) for side in summary[key].values())
            and len(summary[key]) == 2
        )
    assert (
        all(set(r) >= RESPONSE_FIGURES for r in summary["responses"])
        and len(summary["responses"]) == 4
    )
    last = summary["responses"][-1]
    assert (last["Fe_N"], last["H"], last["slipping_pairs"]) == (20.0, 3, 3)
    # 1e-6 m/N at resonance, by construction
    assert last["peak_m"] == pytest.approx(20e-6, rel=1e-3)
    assert set(summary["seconds"]) == {"inspect", "reduce", "preload", "tune", "report"}
    assert summary["warnings"] == []


def open_pair(files):
    preload = files["kept"].preload.copy()
    preload[0] = -0.5
    files["kept"] = files["kept"].replace(preload=preload)


@pytest.mark.parametrize(
    "change, words",
    [
        (
            damage("inspect", "bodies", "damper", "not_read", value=["tetra"]),
            "from the mesh of the damper: tetra",
        ),
        (
            damage("reduce", "free_hz", "out_of_phase", value=1640.0),
            "+3.1 % from the reference 1590 Hz",
        ),
        (damage("preload", "residual", value=1e-3), "residual of 1.0e-03"),
        (
            damage("preload", "sides", "left", "sum_N", value=70.01),
            "side 'left' is 70.01 N, not the 70.00 N",
        ),
        (
            damage("preload", "sides", "left", "balance_error", value=1e-4),
            "not in equilibrium: 1.0e-04",
        ),
        (
            damage("tune", "full_model_check", "tuned", "reduced_hz", value=[2806.5]),
            "stuck mode 1 (tuned), 2806 Hz, is off by 0.2 %, more than 0.1 %: keep more",
        ),
        (
            lambda files: [
                change(files)
                for change in (
                    damage("tune", "full_model_check", "tuned", "reduced_hz", value=[2806.5]),
                    damage("reduce", "reduction", "tractions", value={"blades": 200}),
                )
            ],
            "0.1 %: raise [contact] tractions",
        ),
        (
            damage("tune", "redistribution", "moment_Nm", value=-0.064),
            "moment of \N{MINUS SIGN}0.0640 N m",
        ),
        (
            damage("tune", "redistribution", value={"reactions": {"roll about y": 0.05}}),
            "0.0500 N m along 'roll about y'",
        ),
        (
            damage("tune", "tuned_pairs", "front", value=3),
            "keeps 3 + 2 stations, the reference is 2 + 2",
        ),
        (damage("tune", "history", 0, "hz", value=2700.0), "not monotone: with 3 + 2"),
        (damage("tune", "mac", "full_area", value=0.3), "a MAC of 0.30"),
        (damage("tune", "target_hz", value=2700.0), "misses the target of 2700 Hz by +3.7 %"),
        (open_pair, "1 of 8 kept pairs are open at rest: left 0"),
        (
            damage("responses", 1, "complete", value=False),
            "Fe = 20 N, H = 1 is incomplete: reached",
        ),
        (
            cut(),
            "H = 3 is incomplete: no peak, at least 15 um at 2700.0 Hz; stopped at 2700 Hz: the "
            "mean friction force is not balanced; followed the other way it has a peak, 20 um at "
            "2798.7 Hz",
        ),
        (
            damage("responses", 1, "back", "failed_points", value=2),
            "from the other end is incomplete, 2 points failed",
        ),
        (
            lambda files: files["responses"][1].update(
                peak_m=None, peak_hz=None, at_least_m=1e-5, at_least_hz=3300.0
            ),
            "H = 1 has no peak inside the band: it is largest at the end, 10 um at 3300.0 Hz; "
            "the nearest stuck mode has ",
        ),
        (damage("responses", 3, "back", "peak_m", value=1.9e-5), "sweeps give different peaks"),
        (
            damage("responses", 0, "peak_hz", value=2760.0),
            "from the stuck frequency: another mode is near",
        ),
        (
            lambda files: [files["responses"][k].update(slipping_pairs=["left 0"]) for k in (0, 2)],
            "lowest level, 1 N",
        ),
    ],
)
def test_warnings_appear_when_they_should(tmp_path, change, words):
    study, store = artefacts(tmp_path, damage=change)
    found = summarise(results_of(study, store))["warnings"]
    assert any(words in sentence for sentence in found), found


def test_a_peak_of_another_stuck_mode_is_not_set_beside_the_tracked_one(tmp_path):
    """At a stuck mode in phase it lies where it should, which `respond` tells; beside that mode it
    is told by how much."""

    def told(hz):
        def change(files):
            files["tune.json"]["stuck_modes_hz"]["tuned"] = [672.5, 2800.0]
            for k in (0, 2):
                files["responses"][k].update(peak_hz=hz)

        (folder := tmp_path / str(hz)).mkdir()
        found = warnings_of(results_of(*artefacts(folder, damage=change)))
        return [text for text in found if text.startswith("No pair slips") and "peak" in text]

    assert told(672.5) == []
    assert "the peak lies -1.86 % from the nearest stuck mode 1, 672.5 Hz" in told(660.0)[0]


def test_a_peak_with_slip_need_not_be_the_stuck_one(tmp_path):
    """At 20 N pairs slip: the peak may move and the curve differ from the linear one; at 1 N it is
    told."""

    def moved(files):
        for one in files["responses"]:
            one.update(peak_hz=2760.0, back=None)

    study, store = artefacts(tmp_path, damage=moved)
    content = store.read_json("respond.json")
    content["stuck_difference"] = {one["file"]: 1.0 for one in content["responses"]}
    store.write_json("respond.json", content)
    told = [text for text in warnings_of(results_of(study, store)) if "No pair slips" in text]
    assert len(told) == 4 and all("Fe = 1 N" in text for text in told)


def test_pairs_that_are_open_at_rest_do_not_slip(tmp_path):
    """They are on every curve, at the lowest level too, and say nothing of its damping."""

    def opened(files):
        for k in (0, 2):
            files["responses"][k].update(slipping_pairs=["left 0"])

    results = results_of(*artefacts(tmp_path, damage=opened))
    slipping = [text for text in warnings_of(results) if "already slip" in text]
    names = np.array(pair_names(results.kept, slice(None)))
    preload = np.where(names == "left 0", -1.0, 10.0)
    kept = replace(results.kept, preload=preload)
    assert slipping and not [
        text for text in warnings_of(replace(results, kept=kept)) if "already slip" in text
    ]


def test_curve_without_slip_must_be_the_linear_one(tmp_path):
    study, store = artefacts(tmp_path)
    content = store.read_json("respond.json")
    content["stuck_difference"] = {"responses/Fe_1N_H1.npz": 3e-5}
    store.write_json("respond.json", content)
    assert [
        w for w in summarise(results_of(study, store))["warnings"] if "differs from the linear" in w
    ]


def test_modes_that_the_band_does_not_see(tmp_path):
    """One far above it is off by 8 %, of three sets, the one inside by 0.3 %: one sentence, of
    that inside."""
    far = {"reduced_hz": [2809.3, 9000.0], "full_hz": [2800.9, 8333.0], "largest_error": 0.08}
    sets = {name: far for name in ("full_area", "full_line", "tuned")}
    results = results_of(
        *artefacts(tmp_path, damage=damage("tune", "full_model_check", value=sets))
    )
    said = [text for text in warnings_of(results) if "full model" in text]
    assert len(said) == 1 and "stuck mode 1" in said[0] and "off by 0.3 %" in said[0]


@pytest.mark.parametrize(
    "change, how",
    [
        ({}, "detaching stations (target 2800 Hz) leaves"),
        ({"target_hz": None}, "the study keeps"),
        ({"table": "own.csv"}, "its table own.csv keeps"),
    ],
)
def test_the_introduction_says_what_chose_the_kept_stations(tmp_path, change, how):
    results = results_of(*artefacts(tmp_path))
    tune = results.tune.model_copy(update=change)
    said = introduction(replace(results, tune=tune))[0]
    assert f"{how} {tune.kept_in_words}" in said


@pytest.mark.parametrize(
    "mac, words",
    [
        ((0.9, 0.95), ("the tracked mode lies at", "with which it lies at")),
        (
            (0.55, 0.86),
            (
                "the mode most like the free out-of-phase one (MAC 0.55) lies at",
                "with which the one most like it (MAC 0.86) lies at",
            ),
        ),
        ((0.43, 0.86), ("no mode resembles the free out-of-phase one, the nearest (MAC 0.43)",)),
    ],
)
def test_the_introduction_says_how_like_the_free_mode_the_stuck_one_is(tmp_path, mac, words):
    results = results_of(*artefacts(tmp_path))
    whole, kept = mac
    both = results.tune.mac.model_copy(update={"full_area": whole, "tuned": kept})
    tune = results.tune.model_copy(update={"mac": both})
    said = introduction(replace(results, tune=tune))[0]
    assert all(f"{one}" in said for one in words)
