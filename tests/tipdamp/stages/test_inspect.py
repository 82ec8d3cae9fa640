"""Stage inspect: what was read and what was not."""

import json

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
