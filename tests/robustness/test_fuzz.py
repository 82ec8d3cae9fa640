"""A seeded share of the long runs, and property-based studies, tables, matrices and meshes of all
four readers."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.modal.blocks import block
from tests.robustness import flips, fuzz
from tests.robustness.meshes import WRITTEN
from tests.tipdamp.rig_study import CHAIN, write_chain
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.readers.dispatch import read_mesh
from tipdamp.study.study import load_study

CASES = settings(
    max_examples=30,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
PLAIN = st.one_of(st.integers(-(10**20), 10**20), st.floats(), st.booleans(), st.text(max_size=20))
VALUES = st.recursive(
    PLAIN,
    lambda v: st.lists(v, max_size=4) | st.dictionaries(st.text(max_size=5), v, max_size=3),
    max_leaves=8,
)
KEYS = [line.split(" =")[0] for line in CHAIN.splitlines() if " = " in line]


def one_line(path, error):
    """A refusal names its file, in a line that a terminal can show."""
    assert path.name in str(error) and str(error).isprintable() and len(str(error)) < 2000, error


def toml(value) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(str(k))} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return (
            '"'
            + "".join(f"\\U{ord(c):08x}" if not 0xD800 <= ord(c) < 0xE000 else "?" for c in value)
            + '"'
        )
    return repr(value)


@CASES
@given(st.sampled_from(KEYS), VALUES)
def test_any_value_of_any_key(tmp_path, key, value):
    path = tmp_path / "study.toml"
    path.write_text(
        "\n".join(
            f"{key} = {toml(value)}" if line.startswith(f"{key} =") else line
            for line in CHAIN.splitlines()
        ),
        encoding="utf-8",
    )
    try:
        study = load_study(path)
    except InputError as error:
        one_line(path, error)
    else:
        assert np.isfinite(study.model.pull) and all(np.isfinite(study.respond.levels))


@CASES
@given(st.integers(0, 6), st.integers(0, 30), st.text(max_size=12))
def test_any_text_in_a_table_of_pairs(tmp_path, line, column, text):
    write_chain(tmp_path)
    path = tmp_path / "pairs.csv"
    lines = [row.split(",") for row in path.read_text().splitlines()]
    lines[line][column % len(lines[line])] = text.encode("utf-8", "replace").decode()
    path.write_text("\n".join(map(",".join, lines)) + "\n", encoding="utf-8", newline="")
    try:
        table = ContactTable.load(path)
    except InputError as error:
        assert str(error).isprintable() and len(str(error)) < 2000
    else:
        assert np.isfinite(table.kt).all() and (table.mu >= 0).all()


@pytest.mark.filterwarnings("ignore:K is indefinite")
@CASES
@given(st.integers(0, 3), st.integers(0, 3), st.floats(), st.booleans())
def test_any_number_in_a_matrix(i, j, value, both):
    K = 1e6 * np.array([[2.0, -1, 0, 0], [-1, 2, -1, 0], [0, -1, 2, -1], [0, 0, -1, 2]])
    K[i, j] = value
    if both:
        K[j, i] = value
    try:
        model = ReducedModel.from_matrices(np.eye(4), K)
    except InputError as error:
        assert str(error).startswith(("K", "M and K")) and str(error).isprintable()
    else:
        assert np.isfinite(model.K).all() and np.array_equal(model.K, model.K.T)


@CASES
@given(
    st.sampled_from(list(WRITTEN)), st.integers(0, 10**6), st.binary(max_size=8), st.integers(0, 12)
)
def test_any_bytes_in_a_mesh(tmp_path, end, place, new, lost):
    data = WRITTEN[end](block("hexahedron", (2, 1, 1))).encode()
    at = place % len(data)
    path = tmp_path / f"mesh{end}"
    path.write_bytes(data[:at] + new + data[at + lost :])
    try:
        mesh = read_mesh(path)
    except InputError as error:
        one_line(path, error)
    else:
        assert np.isfinite(mesh.position).all() and all(
            c.max() < len(mesh.node) for c in mesh.cells.values()
        )


def test_seeded_studies(tmp_path):
    assert fuzz.studies(30, 3, tmp_path)["ran"] > 1


def test_seeded_meshes(tmp_path):
    assert fuzz.meshes(24, 4, tmp_path)["ran"] > 1


def test_seeded_flips(tmp_path):
    """Noticed or harmless: an assertion inside says which is neither."""
    assert sum(flips.flips(6, 5, tmp_path).values()) == 6
