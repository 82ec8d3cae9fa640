"""What is written and read again is the same: tables, models, curves, journals, meshes, measured
functions, and numbers in other units."""

import io
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.conftest import STUDY, changed
from tests.contact_tables import contact_table
from tests.modal.blocks import block, mixture
from tests.tipdamp import mesh_texts
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.curve.journal import JournalBlock, packed, unpacked
from tipdamp.hbm.matrices_out import KINDS, write_model
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.measured.universal import FrfAt, from_universal, write_universal
from tipdamp.readers.dispatch import read_mesh
from tipdamp.study.study import load_study

CASES = settings(
    max_examples=25,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
SEED = st.integers(0, 2**32 - 1)
SIZE = st.floats(1e-12, 1e12)
# with what a CSV, a spreadsheet or a JSON writes its own way
NAME = st.text("aZ09 _-./,;\"'#äµ日", min_size=1, max_size=8).filter(
    lambda text: text == text.strip() and text[0] != "-"
)
UNITS = {  # in SI
    "length": {"m": 1.0, "mm": 1e-3},
    "force": {"N": 1.0, "kN": 1e3},
    "stress": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    "density": {"kg/m3": 1.0, "t/mm3": 1e12, "g/cm3": 1e3},
}


def turned(rng, count):
    """(count, 3, 3) right-handed frames."""
    Q = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    return Q * np.linalg.det(Q)[:, None, None]


@st.composite
def tables(draw):
    """Contact tables with numbers of any size in every column."""
    count, rng, size = draw(st.integers(1, 5)), np.random.default_rng(draw(SEED)), draw(SIZE)

    def names():
        return draw(st.lists(NAME, min_size=count, max_size=count))

    return contact_table(
        turned(rng, count),
        side=names(),
        station=rng.integers(0, 99, count),
        row=rng.integers(0, 9, count),
        blade_body=names(),
        damper_body=names(),
        blade_node=rng.integers(1, 10**9, count),
        damper_node=rng.integers(1, 10**9, count),
        position=size * rng.normal(size=(count, 3)),
        area=size * rng.random(count) * draw(st.booleans()),
        weight=rng.random(count),
        **{name: size * rng.random(count) for name in ("kn", "kt", "mu")},
        **{name: size * rng.normal(size=count) for name in ("gap", "preload")},
    )


@CASES
@given(tables())
def test_contact_tables(tmp_path, table):
    again = ContactTable.load(table.save(tmp_path / "pairs.csv"))
    for name, column in vars(table).items():
        assert np.array_equal(vars(again)[name], column), name


@st.composite
def models(draw):
    """Models of two bodies with nodes and modes, loads and groups."""
    rng, count, size = np.random.default_rng(draw(SEED)), draw(st.integers(1, 4)), draw(SIZE)
    r = 3 * count + 2
    bodies = draw(
        st.lists(NAME.filter(lambda n: "/" not in n), min_size=2, max_size=2, unique=True)
    )
    first = 3 * draw(st.integers(0, count))
    node = rng.choice(10**6, count, replace=False) + 1
    body = np.array([bodies[int(i >= first)] for i in range(r)])
    mine = [n for n, name in zip(node, body[: 3 * count : 3], strict=True) if name == bodies[0]]
    A, B = rng.normal(size=(2, r, r))
    position = np.vstack(
        [np.repeat(rng.normal(size=(count, 3)), 3, axis=0), np.full((2, 3), np.nan)]
    )
    return ReducedModel.from_matrices(
        0.01 * (A @ A.T + r * np.eye(r)),
        size * 1e4 * (B @ B.T + r * np.eye(r)),
        np.diag(rng.random(r)) if draw(st.booleans()) else None,
        body=body,
        node=np.r_[np.repeat(node, 3), 1, 2],
        direction=["x", "y", "z"] * count + ["mode"] * 2,
        position=position,
        loads={name: size * rng.normal(size=r) for name in draw(st.sets(NAME, max_size=2))},
        groups={f"{bodies[0]}/{name}": mine for name in draw(st.sets(NAME, max_size=2)) if mine},
    )


@pytest.mark.filterwarnings("ignore::UserWarning")  # of M and K that look swapped
@pytest.mark.parametrize("kind", sorted({*KINDS} - {"pch"}))  # which has ten digits
@CASES
@given(model=models())
def test_models_in_files(tmp_path, kind, model):
    for old in tmp_path.iterdir():
        old.unlink()
    write_model(model, tmp_path, kind)
    if kind == "npz":
        again = ReducedModel.load(tmp_path / "model.npz")
    else:
        parts = ["M", "K"] + ["C"] * (model.C is not None)
        paths = {k: tmp_path / (f"{k}.mtx" if kind == "mtx" else f"model.{kind}") for k in parts}
        again = ReducedModel.from_files(
            **paths, dofs=None if kind == "mat" else tmp_path / "dofs.csv"
        )
    same_model(again, model)


def same_model(found, model):
    for name in ("M", "K", "C", "node", "position"):
        expected = vars(model)[name]
        got = vars(found)[name]
        assert (got is None) is (expected is None), name
        assert expected is None or np.array_equal(got, expected, equal_nan=True), name
    for name in ("body", "direction"):
        assert vars(found)[name].tolist() == vars(model)[name].tolist()
    for name in ("loads", "groups"):
        given, got = vars(model)[name], vars(found)[name]
        assert given.keys() == got.keys()
        assert all(np.array_equal(got[key], given[key]) for key in given), name


@st.composite
def curves(draw):
    """Curves of any shape, a failed point among them."""
    rng, size = np.random.default_rng(draw(SEED)), draw(SIZE)
    n, m, P, H = (draw(st.integers(1, high)) for high in (4, 3, 3, 3))

    def many(*shape):
        return size * rng.normal(size=shape)

    harmonics = many(n, m, H + 1) + 1j * many(n, m, H + 1)
    harmonics[rng.integers(n)] = np.nan
    return ForcedResponse(
        frequency=many(n),
        output_names=np.array(draw(st.lists(st.text("aé ./", max_size=5), min_size=m, max_size=m))),
        harmonics=harmonics,
        parameter_name=draw(NAME),
        parameter=many(n),
        **{f"share_{name}": rng.random((n, P)) for name in ("stick", "slip", "open")},
        dissipated=many(n, P),
        converged=rng.random(n) < 0.5,
        iterations=rng.integers(0, 99, n),
        ended=draw(NAME),
        complete=draw(st.booleans()),
        H=H,
        origin="preloaded",
        start="zero_slider",
        seconds=draw(SIZE),
        residual_calls=draw(st.integers(0, 10**6)),
        unknowns=many(n, P * (2 * H + 1)),
        carrying=rng.random(P) < 0.5,
        restarts=many(draw(st.integers(0, 2)), 2),
        contact_force=many(n, P, 1, H + 1) + 0j,
        truncation=many(n, m),
        held=np.array(["damper: slide along y"] * draw(st.integers(0, 1)), dtype=str),
        further=draw(NAME),
    )


@CASES
@given(curves())
def test_curves_in_files(tmp_path, curve):
    again = ForcedResponse.load(curve.save(tmp_path / "curve.npz"))
    assert again == curve and again.seconds == curve.seconds
    for field in fields(curve):
        one, other = (np.asarray(vars(c)[field.name]) for c in (again, curve))
        assert (one.dtype.kind, one.shape) == (other.dtype.kind, other.shape), field.name


@st.composite
def steps(draw):
    """Of a journal: (mark, real and complex arrays)."""
    rng = np.random.default_rng(draw(SEED))

    def array():
        shape = draw(st.lists(st.integers(0, 3), max_size=3))
        real = rng.normal(size=shape)
        return real + 1j * rng.normal(size=shape) if draw(st.booleans()) else real

    return [
        (draw(st.integers(0, 9)), tuple(array() for _ in range(draw(st.integers(0, 3)))))
        for _ in range(draw(st.integers(0, 3)))
    ]


@CASES
@given(steps())
def test_journals_in_files(given_steps):
    file = io.BytesIO()
    np.savez(file, **packed(given_steps)._asdict())
    file.seek(0)
    with np.load(file) as z:
        again = list(unpacked(JournalBlock(**z)))
    assert [mark for mark, _ in again] == [mark for mark, _ in given_steps]
    for (_, found), (_, expected) in zip(again, given_steps, strict=True):
        assert [(a.shape, a.dtype) for a in found] == [(a.shape, a.dtype) for a in expected]
        assert all(map(np.array_equal, found, expected))


# nodes of a cell in the order of meshio, which is that of VTK: the last two edges change places
ORDER = {"tetra": range(4), "hexahedron": range(8), "wedge": range(6), "tetra10": [*range(8), 9, 8]}


@st.composite
def blocks(draw):
    """Blocks of one cell type, of any size and proportions."""
    kind = draw(st.sampled_from(list(ORDER)))
    divisions = tuple(draw(st.integers(1, 3)) for _ in range(3))
    size = tuple(draw(st.floats(1e-3, 1e3)) * draw(st.floats(1, 5)) for _ in range(3))
    return block(kind, divisions, draw(st.floats(0, 0.1)), size)


@pytest.mark.parametrize("unit", UNITS["length"])
@pytest.mark.parametrize("end, file_format", [(".inp", "abaqus"), (".msh", "gmsh22")])
@CASES
@given(mesh=blocks())
def test_meshes_that_meshio_writes(tmp_path, end, file_format, unit, mesh):
    """Numbers are those of the file, 1 to n; places are in m whatever the unit of the file is."""
    meshio = pytest.importorskip("meshio")
    (kind, cells), factor = next(iter(mesh.cells.items())), UNITS["length"][unit]
    path = tmp_path / f"mesh{end}"
    sets = {name: mesh.index(numbers) for name, numbers in mesh.groups.items()}
    meshio.write(
        path,
        meshio.Mesh(mesh.position / factor, [(kind, cells[:, ORDER[kind]])], point_sets=sets),
        file_format=file_format,
    )
    again = read_mesh(path, factor)
    assert again.node.tolist() == list(range(1, len(mesh.node) + 1))
    assert np.allclose(again.position, mesh.position, rtol=1e-14, atol=0)
    assert list(again.cells) == [kind] and np.array_equal(again.cells[kind], cells)
    if file_format == "abaqus":
        assert again.groups.keys() == sets.keys()
        assert all(np.array_equal(again.group(name), at + 1) for name, at in sets.items())


STYLES = {  # of programs that meshio does not write: (writer, end of the name, their precision)
    "abaqus cae": (mesh_texts.abaqus_cae, ".inp", 1e-15),
    "ansys": (mesh_texts.ansys, ".cdb", 1e-13),
    "ansys etblock": (lambda m: mesh_texts.ansys(m, etblock="columns"), ".cdb", 1e-13),
    "ansys wide": (lambda m: mesh_texts.ansys(m, 10, "blanks"), ".cdb", 1e-13),
    "nastran small": (mesh_texts.nastran, ".bdf", 1e-3),
    "nastran large": (lambda m: mesh_texts.nastran(m, "large"), ".bdf", 1e-9),
    "nastran free": (lambda m: mesh_texts.nastran(m, "free"), ".bdf", 1e-15),
}


@st.composite
def numbered(draw):
    """Meshes of one cell type or several, anywhere, with numbers and groups as users have them."""
    rng, size = np.random.default_rng(draw(SEED)), draw(st.floats(1e-3, 1e3))
    box = tuple(size * draw(st.floats(1, 5)) for _ in range(3))
    distort = draw(st.floats(0, 0.1))
    if draw(st.booleans()):
        mesh = mixture(draw(st.integers(1, 2)), (2, draw(st.integers(1, 2)), 2), distort, box)
    else:
        kind = draw(st.sampled_from([*ORDER, "hexahedron20", "wedge15"]))
        divisions = (2, *(draw(st.integers(1, 2)) for _ in range(2)))
        mesh = block(kind, divisions, distort, box)
    node = numbers(rng, len(mesh.node), draw(st.integers(1, 20)))
    number, first = {}, 1
    for kind, cells in mesh.cells.items():
        number[kind] = first + numbers(rng, len(cells), draw(st.integers(1, 20)))
        first = int(number[kind][-1]) + 1
    groups = {
        name: np.sort(rng.choice(node, rng.integers(1, len(node) + 1), replace=False))
        for name in ("clamp", "tip")
    }
    position = mesh.position + size * rng.normal(size=3)
    return replace(mesh, position=position, node=node, number=number, groups=groups, cell_groups={})


def numbers(rng, count, spread):
    """(count,) rising numbers from 1 on, with gaps where spread is above 1."""
    return np.cumsum(rng.integers(1, spread + 1, count))


@pytest.mark.parametrize("unit", UNITS["length"])
@pytest.mark.parametrize("style", STYLES)
@CASES
@given(mesh=numbered())
def test_meshes_of_pre_processors(tmp_path, style, unit, mesh):
    """Nodes, numbers, places, cells and groups, of nodes and of cells."""
    (write, end, precision), factor = STYLES[style], UNITS["length"][unit]
    path = tmp_path / f"mesh{end}"
    path.write_text(write(replace(mesh, position=mesh.position / factor)))
    again = read_mesh(path, factor)
    assert np.array_equal(again.node, mesh.node)
    largest = np.abs(mesh.position).max()
    assert np.allclose(again.position, mesh.position, rtol=2 * precision, atol=1e-15 * largest)
    assert again.cells.keys() == mesh.cells.keys()
    for kind, cells in mesh.cells.items():
        order = np.argsort(again.number[kind])
        assert np.array_equal(again.number[kind][order], mesh.number[kind])
        assert np.array_equal(again.cells[kind][order], cells)
    groups = {name.lower(): members for name, members in again.groups.items()}
    late = mesh.node[len(mesh.node) // 2 :]
    expected = mesh.groups | {"set_3" if end == ".bdf" else "late": late}
    assert all(np.array_equal(groups[name], expected[name]) for name in expected)
    cells = {name.lower().replace(" ", "_"): n for name, n in again.cell_groups.items()}
    chosen = cells["pid_7" if end == ".bdf" else "some_cells"]
    assert np.array_equal(chosen, mesh_texts.first_cells(mesh))


@st.composite
def receptances(draw):
    """Functions of a universal file, over rising frequencies that six digits can tell apart."""
    rng, count, size = np.random.default_rng(draw(SEED)), draw(st.integers(2, 9)), draw(SIZE)
    hz = draw(st.floats(1.0, 1e4)) * np.cumsum(rng.uniform(0.01, 1.0, count))
    return FrfAt(
        title=draw(st.text("aZ09 :,=", min_size=1, max_size=20).filter(str.strip)),
        hz=hz,
        response=size * (rng.normal(size=count) + 1j * rng.normal(size=count)),
        response_node=draw(st.integers(1, 10**9)),
        force_node=draw(st.integers(1, 10**9)),
        direction=draw(st.integers(-3, 3)),
    )


@CASES
@given(st.lists(receptances(), min_size=1, max_size=3))
def test_receptances_in_universal_files(tmp_path, functions):
    pytest.importorskip("pyuff")
    path = write_universal(tmp_path / "a.unv", functions)
    for k, one in enumerate(functions, 1):
        ((quantity, hz, response, _, label, factor),) = from_universal(path, (k,))
        assert (quantity, label, factor) == ("receptance", "m", 1)
        assert hz == pytest.approx(one.hz, rel=1e-5)
        assert np.allclose(response, one.response, rtol=1e-10, atol=0)
    places = [(f.response_node, f.force_node, f.direction) for f in functions]
    if len(set(places)) == 1:
        assert len(from_universal(path, ())) == len(functions)


NUMBERS = {  # in the study of the rig: as they stand there in SI, and the units of each
    "E = 207e9": ("stress", 1),
    "density = 7850": ("density", 1),
    "pull = 113": ("force", 1),
    "kn = 3.32e6": ("force", 1, "length", -1),
    "width = 1.6e-3": ("length", 1),
}


@CASES
@given(st.fixed_dictionaries({key: st.sampled_from(list(UNITS[key])) for key in UNITS}))
def test_numbers_in_other_units(tmp_path, unit):
    factor = {key: UNITS[key][name] for key, name in unit.items()}
    text = "[units]\n" + "".join(f'{key} = "{name}"\n' for key, name in unit.items()) + STUDY
    for line, powers in NUMBERS.items():
        key, _, value = line.split()
        value = float(value)
        for of, power in zip(powers[::2], powers[1::2], strict=True):
            value /= factor[of] ** power
        text = changed(text, (line, f"{key} = {value!r}"))
    path = tmp_path / "study.toml"
    path.write_text(text)
    study = load_study(path)
    left, right = study.sides["left"], study.sides["right"]
    found = study.material.E, study.material.density, study.damper.pull, left.kn, right.width
    assert found == pytest.approx((207e9, 7850, 113, 3.32e6, 1.6e-3), rel=1e-14)
    assert study.length_unit == factor["length"]
