"""Study files: units, defaults, and one clear line for everything that is wrong."""

from pathlib import Path

import pytest

from tests.conftest import STUDY
from tipdamp.hbm.errors import InputError
from tipdamp.study.study import load_study

STUDIES = sorted((Path(__file__).parents[3] / "docs" / "studies" / "two_blade_rig").glob("*.toml"))


def write(tmp_path, text):
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("path", STUDIES, ids=lambda p: p.stem)
def test_the_projects_own_studies_are_valid(path):
    study = load_study(path)
    assert len(study.sides) == 2 and study.damper.pull == 113.0


def test_a_percent_sign_in_a_path_is_one(tmp_path):
    folder = tmp_path / "50% pull"
    folder.mkdir()
    assert list(load_study(write(folder, STUDY)).sides) == ["left", "right"]
    with pytest.raises(InputError, match=r"50% pull/rig.toml: \[contact.left\] kn = 0"):
        load_study(write(folder, STUDY.replace("kn = 3.32e6", "kn = 0")))


def test_units_are_converted_once(tmp_path):
    """The same study in mm, kN, MPa and t/mm3."""
    si = load_study(write(tmp_path, STUDY))
    text = '[units]\nlength = "mm"\nforce = "kN"\nstress = "MPa"\ndensity = "t/mm3"\n' + STUDY
    for old, new in (
        ("207e9", "207e3"),
        ("density = 7850", "density = 7.85e-9"),
        ("pull = 113", "pull = 0.113"),
        ("3.32e6", "3.32"),
        ("3.02e6", "3.02"),
        ("1.03e6", "1.03"),
        ("0.94e6", "0.94"),
        ("1.6e-3", "1.6"),
        ("levels = [1, 20]", "levels = [1e-3, 20e-3]"),
    ):
        text = text.replace(old, new)
    mm = load_study(write(tmp_path, text))
    assert dict(mm.material) == {k: pytest.approx(v) for k, v in dict(si.material).items()}
    assert mm.damper.pull == pytest.approx(113.0)
    assert mm.sides["right"].kn == pytest.approx(1.03e6) and mm.sides[
        "right"
    ].width == pytest.approx(1.6e-3)
    assert mm.respond.levels == pytest.approx((1.0, 20.0)) and mm.length_unit == 1e-3


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("pull = 113", "pul = 113", r"\[damper\] unknown key 'pul'; did you mean 'pull'"),
        ("[tune]", "[tunes]", "unknown key 'tunes'; did you mean 'tune'"),
        (
            "pull = 113",
            "pul = 113\nweight = 3\nmeshes = 4",
            r"\[damper\] unknown keys 'pul' \(did you mean 'pull'\?\), 'weight', 'meshes' \(did "
            r"you mean 'mesh'\?\); valid: ",
        ),
        (
            "[material]",
            "[materal]\n[material]\nEE = 1",
            r"toml: unknown key 'materal'; did you mean 'material'.*; \[material\] unknown key "
            r"'EE'; did you mean 'E'",
        ),
        ("pull = 113", "pull = -5", r"\[damper\] pull = -5: must be above 0"),
        ("pull = 113", "pull = inf", r"\[damper\] pull = inf: must be finite and above 0"),
        ("pull = 113", 'pull = "113"', r"\[damper\] pull = '113': must be a number"),
        ("pull = 113", "pull = nan", r"\[damper\] pull = nan: must be finite and above 0"),
        ("mu = 0.6", "mu = -0.1", r"\[contact\] mu = -0.1: must be at least 0"),
        ("mu = 0.6", "mu = { value = 0.6 }", r"\[contact\] mu = { value = 0.6 }: must be a number"),
        ("nu = 0.3", "nu = { value = 0.3 }", r"\[material\] nu = { value = 0.3 }: must be"),
        ("mu = 0.6", "", r"\[contact\] mu is missing"),
        ("kn = 3.32e6", "kn = 0", r"\[contact.left\] kn = 0: must be above 0"),
        ("kn = 3.32e6", "", r"\[contact.left\] kn and kt are missing"),
        (
            'shape = "flat"',
            'shape = "flt"',
            r"\[contact.right\] shape = 'flt': did you mean 'flat'",
        ),
        ("width = 1.6e-3", "", r"\[contact.right\] width is missing"),
        (
            "band = [2300, 3300]",
            "band = [3300, 2300]",
            r"\[respond\] band = \[3300, 2300\]: the band is empty",
        ),
        ("band = [2300, 3300]", "band = [2300, 2300]", "the band is empty"),
        ("band = [2300, 3300]", "band = [0, 2300]", "must be above 0"),
        ("levels = [1, 20]", "levels = []", "must be a list that is not empty"),
        ("harmonics = [1]", "harmonics = [0]", "must lie between 1 and 99"),
        ("harmonics = [1]", "harmonics = [1.5]", "must be a whole number"),
        (
            "harmonics = [1]",
            'harmonics = "automatic"',
            r"\[respond\] harmonics = 'automatic': must be a whole number from 1 to 99, or 'auto'",
        ),
        ("harmonics = [1]", 'harmonics = ["auto", 5]', "'auto' stands alone, not in a list"),
        (
            "harmonics = [1]",
            'harmonics = "auto"\nsamples = 64',
            r"\[respond\] samples = 64: .* at least 180 for harmonics = 45",
        ),
        (
            "harmonics = [1]",
            "harmonics = [1]\ntolerance = 0",
            r"\[respond\] tolerance = 0: must be above 0 and at most 0.1",
        ),
        ("harmonics = [1]", "harmonics = [1]\ntolerance = 1", "tolerance = 1: must be above 0"),
        (
            "harmonics = [1]",
            'harmonics = [1]\ntolerance = "low"',
            r"\[respond\] tolerance = 'low': must be a number",
        ),
        ("damping_ratio = 0.022", "damping_ratio = 1.2", "must be at least 0 and at most 0.9999"),
        ("stations = [5, 4]", "", "needs either target_hz, or stations"),
        ("stations = [5, 4]", "stations = [5]", r"must be two numbers \[front, back\]"),
        ("modes = 30", "modes = -1", r"\[blades\] modes = -1: must lie between 0 and 2000"),
        (
            "modes = 30",
            "modes = 30\nerror = 1e-4",
            r"\[blades\] modes and error exclude each other",
        ),
        ("modes = 30", "modes_below_hz = 0", r"\[blades\] modes_below_hz = 0: must be above 0"),
        (
            "modes = 30",
            "error = 0.5",
            r"\[blades\] error = 0.5: must be at least 1e-09 and at most 0.1",
        ),
        ("[material]", "[material]\nE = 1.0", "not a valid TOML file"),
        ("nu = 0.3", "nu = 0.5", r"\[material\] nu = 0.5"),
        (
            "[contact.right]",
            "[contact.left2]\n[contact.right]",
            r"\[contact.left2\] shape is missing",
        ),
        (
            "[material]",
            "[units]\nlength = [1]\n[material]",
            r"\[units\] length = \[1\]: valid: m, mm",
        ),
        ("pull = 113", "pull = 113\naxis = [0, 0, 0]", "axis = .*must not be zero"),
    ],
)
def test_one_line_for_each_mistake(tmp_path, old, new, message):
    assert old in STUDY
    path = write(tmp_path, STUDY.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as caught:
        load_study(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value).strip()


def test_matrices_and_meshes_exclude_each_other(tmp_path):
    with pytest.raises(InputError, match=r"\[model\] and \[material\] exclude each other"):
        load_study(write(tmp_path, STUDY + '[model]\nmatrices = "m.npz"\npull = 1\n'))


def test_missing_study_file(tmp_path):
    with pytest.raises(InputError, match="study file not found"):
        load_study(tmp_path / "none.toml")


def test_b33_damping_ratios(tmp_path):
    """Below 0 and from 1 on: refused. From 0.2 on: run, with the warning that it may be in
    percent."""
    from tipdamp.checks.plausibility import damping_warnings

    for bad in ("-0.01", "1.0"):
        with pytest.raises(
            InputError, match=rf"\[respond\] damping_ratio = {bad}: must be at least 0"
        ):
            load_study(
                write(tmp_path, STUDY.replace("damping_ratio = 0.022", f"damping_ratio = {bad}"))
            )
    large = load_study(
        write(tmp_path, STUDY.replace("damping_ratio = 0.022", "damping_ratio = [0.02, 0.3]"))
    )
    assert [w for w in damping_warnings(large)] == [
        "[respond] damping_ratio = 0.3: is it in percent? expected a ratio (2 % is 0.02)"
    ]
    assert not [*damping_warnings(load_study(write(tmp_path, STUDY)))]


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "[material]",
            '[material.tip]\ngroup = "tip"\nE = 1e9\n[material]',
            r"\[material.tip\] nu is missing",
        ),
        (
            "[material]",
            "[material.tip]\nE = 1e9\nnu = 0.3\ndensity = 1\n[material]",
            r"\[material.tip\] group is missing",
        ),
        ('clamp = "clamp"', "clamp = []", "clamp = .*must be a list that is not empty"),
        ('clamp = "clamp"', 'clamp = ["a", 3]', "must be a text in quotes"),
        (
            "mu = 0.6",
            'mu = 0.6\ndistance = "open"',
            r"\[contact\] distance = 'open': .*valid: auto, closed, gap",
        ),
        (
            "nu = 0.3",
            "nu = 0.3\nwave_speed = [7000, 2000]",
            r"\[material\] wave_speed = .*the band is empty",
        ),
    ],
)
def test_materials_clamps_and_distance(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        load_study(write(tmp_path, STUDY.replace(old, new, 1)))


def test_several_materials_and_clamps(tmp_path):
    text = STUDY.replace(
        "[blades]",
        '[material.shroud]\ngroup = "top"\nE = 110e9\nnu = 0.3\ndensity = 4430\n[blades]',
    )
    study = load_study(
        write(tmp_path, text.replace('clamp = "clamp"', 'clamp = ["left", "right"]'))
    )
    assert study.materials["shroud"].group == "top" and study.materials["shroud"].E == 110e9
    assert study.blades.clamp == ("left", "right") and study.material.E == 207e9
    assert load_study(write(tmp_path, STUDY)).blades.clamp == ("clamp",)
