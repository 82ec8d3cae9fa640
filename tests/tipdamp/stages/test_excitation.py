"""Forces on several nodes, with amplitude and phase."""

import numpy as np
import pytest

from tests.tipdamp.rig_study import CHAIN
from tipdamp.cli import main
from tipdamp.hbm.balance.receptance import linear_response
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.statics.model_inputs import excitation
from tipdamp.study.study import load_study

TWO = '[respond]\nexcitation = ["excitation", "patch_2"]\n'


def with_keys(study, text):
    study.write_text(CHAIN.replace("[respond]\n", text))
    return load_study(study)


@pytest.mark.parametrize(
    ("keys", "factor"),
    [
        ("", 1),
        ('phase = "in_phase"', 1),
        ('phase = "out_of_phase"', -1),
        ("phase = [60]", 0.5 + 1j * np.sqrt(0.75)),
        ("phase = 60", 0.5 + 1j * np.sqrt(0.75)),
        ("engine_order = 6\nblade_count = 24", 1j),
        ("engine_order = 24\nblade_count = 24", 1),
        ("amplitudes = [1, 0.25]\nphase = [-90]", -0.25j),
    ],
)
def test_force_on_two_blades(matrices_study, keys, factor):
    study = with_keys(matrices_study, TWO + keys + "\n")
    model = ReducedModel.load(matrices_study.parent / "model.npz")
    one, two = (model.displacement_row("blades", n, [0, 1, 0]) for n in (2, 12))
    np.testing.assert_allclose(excitation(study, model), one + factor * two, rtol=1e-15)


def test_a_group_shares_its_force_only_when_told(matrices_study, capsys):
    model = ReducedModel.load(matrices_study.parent / "model.npz")
    groups = {**model.groups, "blades/both": np.array([2, 12])}
    wide = ReducedModel(**{**vars(model), "groups": groups})
    study = with_keys(matrices_study, '[respond]\nexcitation = "both"\n')
    with pytest.raises(InputError, match="group 'both' has 2 nodes; set share_force = true"):
        excitation(study, wide)
    wide.save(matrices_study.parent / "model.npz")
    assert main(["inspect", str(matrices_study), "--quiet"]) == 2
    assert "group 'both' has 2 nodes; set share_force = true" in capsys.readouterr().err
    shared = excitation(
        with_keys(matrices_study, '[respond]\nexcitation = "both"\nshare_force = true\n'), wide
    )
    one, two = (model.displacement_row("blades", n, [0, 1, 0]) for n in (2, 12))
    np.testing.assert_allclose(shared, (one + two) / 2, rtol=1e-15)


def test_engine_order_on_both_blades(matrices_study):
    """Without slip the curve is the sum of the linear responses to both forces, the second a
    quarter turn ahead."""
    with_keys(matrices_study, TWO + "engine_order = 6\nblade_count = 24\n")
    assert [
        main([verb, str(matrices_study), "--quiet"])
        for verb in ("inspect", "reduce", "preload", "tune", "respond")
    ] == [0] * 5
    folder = matrices_study.parent / "results" / "study"
    curve = ForcedResponse.load(folder / "responses" / "Fe_5N_H1.npz")
    model = ReducedModel.load(folder / "model.npz")
    kept = ContactTable.load(folder / "kept.csv")
    kept = kept.select(kept.carrying)
    one, two = (model.displacement_row("blades", n, [0, 1, 0]) for n in (2, 12))
    first, second = (
        linear_response(model, kept, 5.0 * force, curve.frequency, 0.01, {"one": one})[:, 0]
        for force in (one, two)
    )
    assert not curve.slipping_pairs.size
    np.testing.assert_allclose(
        curve.harmonics[:, 0, 1], first + 1j * second, atol=1e-9 * np.abs(first).max()
    )


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        (TWO + "amplitudes = [1]\n", "2 needed, one for each group"),
        (TWO + "amplitudes = [0, 0]\n", "must not all be 0"),
        (TWO + "phase = [10, 20]\n", "1 angles needed"),
        (TWO + 'phase = "opposite"\n', "'in_phase'"),
        (TWO + "engine_order = 3\n", "engine_order and blade_count go together"),
        (TWO + 'phase = "in_phase"\nengine_order = 3\nblade_count = 24\n', "exclude each other"),
        ('[respond]\nphase = "out_of_phase"\n', "need two groups"),
        (
            '[respond]\nexcitation = ["a", "b", "c"]\nphase = "out_of_phase"\n',
            "of 3 groups, give 2 angles",
        ),
        ('[respond]\nexcitation = ["a", "a"]\n', "a is given twice"),
    ],
)
def test_contradictions(matrices_study, keys, why):
    with pytest.raises(InputError, match=why):
        with_keys(matrices_study, keys)
