"""Materials, supports and master nodes of the bodies."""

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.bad_meshes import inspect
from tests.tipdamp.rig_study import edit
from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.read import read_meshes
from tipdamp.cli import main
from tipdamp.study.study import load_study

TITANIUM = (
    '[material.titanium]\ngroup = "blade two"\nE = 110e9\nnu = 0.31\ndensity = 4430\n[blades]'
)
CUBE = corner_study.A**3


def test_materials_by_group(tmp_path):
    """Blade two of titanium: the mass of the free blades is that of one cube of each."""
    study = load_study(corner_study.write(tmp_path, change=[("[blades]", TITANIUM)]))
    meshes = read_meshes(study)
    blades, damper = assemble_bodies(study, meshes, lambda *_: None)
    held = np.union1d(blades.groups["clamp_one"], blades.groups["clamp_two"])
    assert len(np.setdiff1d(blades.node, held)) * 3 == blades.dofs  # both clamps hold
    # a unit motion of the free nodes falls linearly to zero over the layer at the clamp, half the
    # length: 1/3 of its mass moves, and all of the other half
    moving = (1 / 3 + 1) / 2
    assert blades.mass() == pytest.approx(np.full(3, moving * (7850 + 4430) * CUBE), rel=1e-9)
    assert damper.mass() == pytest.approx(np.full(3, 7850 * CUBE), rel=1e-9)


def test_a_body_that_nothing_holds(copy, capsys):
    """The clamp group is a single node: it exists, but three rotations stay free."""
    path = edit(copy, 'clamp = "clamp"', 'clamp = "excitation"')
    path = edit(copy, "[respond]", '[respond]\nexcitation = "patch_1"')
    assert main(["inspect", path, "--quiet"]) == 2
    assert (
        "body 'blades': it is not fully supported, 3 rigid motions are free"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    "old, new, words",
    [
        (
            '"clamp_two"]',
            '"touch_two"]',
            "[contact.two] the pairs: node 98 of the blades is clamped by group 'touch_two'",
        ),
        (
            '"touch_two"]',
            '"clamp_two"]',
            "[respond] group 'clamp_two': node 104 of the blades is clamped by",
        ),
    ],
)
def test_clamped_nodes_that_must_move(tmp_path, capsys, nothing_is_assembled, old, new, words):
    code, error, _ = inspect(corner_study.write(tmp_path, change=[(old, new)]), capsys)
    assert code == 2 and words in error and "9 such nodes" in error


def test_load_cases_are_checked_by_inspect(tmp_path, capsys, nothing_is_assembled):
    change = [("[respond]", '[loads.gas]\nforces = [["blades", "touch_on", 1, 0, 0]]\n[respond]')]
    code, error, _ = inspect(corner_study.write(tmp_path, change=change), capsys)
    assert code == 2 and "[loads.gas] forces" in error and "did you mean 'touch_one'" in error
