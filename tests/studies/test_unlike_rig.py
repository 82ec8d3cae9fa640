"""The rig with blades of tetrahedra whose covers do not match the damper, from one Abaqus file to a
report in one go; beside the same rig whose covers have the damper's nodes, in cells of the same
sizes."""

import re

import numpy as np
import pytest

from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable

pytestmark = pytest.mark.slow

pytest.importorskip("dolfinx")
pytest.importorskip("gmsh")

from tipdamp.meshes.rig import Rig  # noqa: E402
from tipdamp.meshes.tetrahedra import generate  # noqa: E402

KNOWN = {
    "E": "207e9",
    "nu": "0.3",
    "density": "7850",
    "pull": "113",
    "mu": "0.6",
    "levels": "[6]",
    "band": "[2600, 3400]\nboth_ways = false",
}
# of matching nodes, of contact points
STATIONS = r'(?m)^(stations = "all"|by = "area"\nkept_share = 1) .*$'
WRITTEN = {
    'harmonics = "auto"': "harmonics = 1",
    "damping_ratio = 0.005": "damping_ratio = 0.022",
    'shape = "flat"': 'shape = "flat"\nkn_per_area = 5.7e11\nkt_per_area = 5.2e11',
}


def completed(text, method):
    """A proposed study with what only a person knows."""
    text = re.sub(r"(?m)^# (\[\w+\]|\w+ = )", r"\1", text).replace(
        'stiffness = "halfspace"', f'method = "{method}"'
    )
    text = re.sub(STATIONS, "stations = [3, 2]", text)
    for key, value in KNOWN.items():
        text = text.replace(f'\n{key} = "?"', f"\n{key} = {value}")
    for old, new in WRITTEN.items():
        text = text.replace(old, new)
    return text


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Results with unlike and with matching meshes; the latter taken as surfaces too."""
    found = []
    for matching in (False, True):
        folder = tmp_path_factory.mktemp("matching" if matching else "unlike")
        generate(
            Rig.named("asymmetric"),
            "wedge",
            folder,
            edge=0.01,
            contact_edge=2e-3,
            cells=(15, 2),
            matching=matching,
        )
        assert main(["inspect", str(folder / "tet_rig.inp")]) == 0
        study = folder / "tet_rig.toml"
        assert (
            "the nodes match" in study.read_text()
            if matching
            else "the nodes do not match" in study.read_text()
        )
        study.write_text(completed(study.read_text(), "surfaces" if matching else "auto"))
        for verb in ("reduce", "preload", "tune", "respond") if matching else ("run",):
            assert main([verb, str(study), "--quiet"]) == 0
        found.append(Store(folder / "results" / "tet_rig"))
    return found


def test_from_an_abaqus_file_to_a_report(both):
    """79.90 N on each side by the balance of 113 N."""
    for store in both:
        sides = store.read_json("preload.json")["sides"]
        assert [s["sum_N"] for s in sides.values()] == pytest.approx([113 / 2**0.5] * 2, rel=1e-6)
        assert ContactTable.load(store.path("preload.csv")).on_surface.all()
    assert (both[0].folder / "report.html").is_file()
    summary = both[0].read_json("summary.json")
    assert not [w for w in summary["warnings"] if "indefinite" in w]


def test_stuck_frequencies(both):
    one, two = (store.read_json("tune.json")["stuck_hz"] for store in both)
    assert one == pytest.approx(two, rel=3e-3)


def test_preload_per_station(both):
    """Beside the blades' unstructured triangles, and beside triangles on the damper's own nodes."""
    forces = []
    for store in both:
        pairs = ContactTable.load(store.path("preload.csv"))
        forces.append(
            [
                [
                    np.maximum(pairs.preload[(pairs.side == s) & (pairs.station == k)], 0).sum()
                    for k in range(16)
                ]
                for s in ("left", "right")
            ]
        )
    assert np.array(forces[0]) == pytest.approx(np.array(forces[1]), rel=0.03)


def test_peaks(both):
    one, two = (store.read_json("respond.json")["responses"][0] for store in both)
    assert one["complete"] and two["complete"] and one["slipping_pairs"]
    assert one["peak_m"] == pytest.approx(two["peak_m"], rel=0.01)
    assert one["peak_hz"] == pytest.approx(two["peak_hz"], rel=3e-3)
