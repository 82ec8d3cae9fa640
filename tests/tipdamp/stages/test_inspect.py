"""Stage inspect: what was read and what was not."""

import json
import subprocess
import sys
from pathlib import Path

from tests.tipdamp import corner_study
from tipdamp.cli import main


def test_inspection_of_groups_read_and_unread(tmp_path, capsys):
    mesh = corner_study.blades("hexahedron20")
    path = corner_study.write(tmp_path, mesh, corner_study.damper("hexahedron20"))
    with open(tmp_path / "blades.inp", "a") as f:
        f.write("*NODE\n9999, 0, 0, 0\n*BOUNDARY\nclamp_one, 1, 3\n")
    assert main(["inspect", str(path), "--quiet"]) == 0
    found = json.loads((tmp_path / "results" / "corner" / "inspect.json").read_text())["bodies"][
        "blades"
    ]
    assert found["format"] == "Abaqus or CalculiX" and found["cells"] == {"hexahedron20": 16}
    assert found["groups"]["touch_one"] == 21 and found["groups_are"]["touch_one"] == "nodes"
    assert (
        found["cell_groups"] == {"blade two": 8} and found["groups_are"]["blade two"] == "a volume"
    )
    assert (
        "1 nodes that no solid cell uses" in found["not_read"]
        and "keywords *BOUNDARY (1)" in found["not_read"]
    )
    assert any("C3D20R" in line and "full integration" in line for line in found["not_read"])


def test_no_finite_elements_are_loaded_to_look_at_meshes(tmp_path):
    """In a fresh process: mass and support are told by the meshes."""
    path = corner_study.write(
        tmp_path, corner_study.blades("hexahedron"), corner_study.damper("hexahedron")
    )
    program = (
        "import sys; from tipdamp.cli import main\n"
        f"assert main(['inspect', {str(path)!r}, '--quiet']) == 0\n"
        "assert not {'dolfinx', 'gmsh'} & set(sys.modules)"
    )
    root = Path(__file__).parents[3]
    done = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "results" / "corner" / "inspect.json").read_text())["bodies"]
    cube = 7850 * corner_study.A**3
    assert abs(found["damper"]["moving_mass_kg"][0] / cube - 1) < 1e-12
    assert abs(found["damper"]["mass_kg"] / cube - 1) < 1e-12
    blades = found["blades"]["mass_kg"] / cube  # with what is clamped of them: so many cubes
    assert blades > 1 and abs(blades - round(blades)) < 1e-9
    assert (found["blades"]["rigid_modes"], found["damper"]["rigid_modes"]) == (0, 6)


def test_a_set_that_is_not_told_to_share_its_force_is_refused_at_once(tmp_path, capsys):
    """And not after the reduction; the damper's sets have nothing to do with it."""
    path = corner_study.write(tmp_path, change=[("share_force = true\n", "")])
    assert main(["inspect", str(path), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "[respond] excitation: group 'touch_one' has 9 nodes; set share_force = true" in said
    path.write_text(corner_study.TEXT)
    assert main(["inspect", str(path), "--quiet"]) == 0
