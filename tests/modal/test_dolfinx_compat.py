"""The layer over dolfinx: nodes keep their places, fields and forms are right, and it is the only
place for versions.

The same tests run under dolfinx 0.5.2 (Debian 12) and 0.9 (Debian 13).
"""

import ast
import logging
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from tipdamp.modal.elasticity import strain  # noqa: E402
from tipdamp.modal.elements import dolfinx_compat  # noqa: E402
from tipdamp.modal.elements.dolfinx_compat import CELLS, CellBlock  # noqa: E402

from .blocks import block  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
# names of dolfinx, ufl and basix that only one of 0.5.2 and 0.9 has, or that mean another thing
# there
ONE_VERSION_ONLY = {
    "VectorFunctionSpace",
    "functionspace",
    "VectorElement",
    "TensorElement",
    "FiniteElement",
    "MixedElement",
    "TensorFunctionSpace",
    "blocked_element",
    "petsc_vec",
    "form_compiler_params",
    "form_compiler_options",
    "apply_lifting",
    "set_bc",
    "create_vector",
    "input_global_indices",
}


@pytest.fixture(params=list(CELLS))
def mesh(request):
    """A distorted box and one more node that no cell has; numbers shuffled."""
    made = block(request.param, distort=0.2)
    order = np.random.default_rng(3).permutation(len(made.node) + 1)
    position = np.vstack([made.position, [9.0, 9.0, 9.0]])[order]
    return request.param, position, np.argsort(order)[made.cells[request.param]]


def test_every_node_is_in_its_place(mesh):
    kind, position, cells = mesh
    found = CellBlock.of(position, kind, cells)
    assert np.sort(found.place).tolist() == np.unique(cells).tolist()
    assert (
        np.abs(found.V.tabulate_dof_coordinates()[: len(found.place)] - position[found.place]).max()
        < 1e-14
    )


def test_forms_of_fields(mesh):
    """integral of c strain(u) : strain(v) for linear fields is c times the volume times the product
    of their strains; a matrix entry of the unused node is nowhere."""
    kind, position, cells = mesh
    import ufl

    found = CellBlock.of(position, kind, cells)
    rng = np.random.default_rng(5)
    A, B = rng.standard_normal((2, 3, 3))
    a, b = position @ A.T, position @ B.T
    (c,) = found.constants(2.5)
    u, v = ufl.TrialFunction(found.V), ufl.TestFunction(found.V)
    K = found.matrix(c * ufl.inner(strain(u), strain(v)) * found.dx)
    M = found.matrix(ufl.inner(u, v) * found.dx)
    ones = np.tile([1.0, 0.0, 0.0], len(position))
    one = found.one_direction()
    p, q = ufl.TrialFunction(one.V), ufl.TestFunction(one.V)
    each = one.matrix(p * q * one.dx)
    assert 3 * each.nnz == M.nnz and abs(each - M).max() <= 1e-14 * abs(M).max()
    volume = ones @ M @ ones
    product = ((A + A.T) / 2 * (B + B.T) / 2).sum()
    assert a.ravel() @ K @ b.ravel() == pytest.approx(2.5 * volume * product, rel=1e-11)
    assert K.shape == (3 * len(position),) * 2 and abs(K - K.T).max() == 0
    unused = np.setdiff1d(np.arange(len(position)), cells)
    assert len(unused) == 1 and not K[3 * unused[0]].nnz
    # the field of a function is that of the nodal values: mass of x-displacement weighted by its
    # strain
    weighted = found.matrix(ufl.tr(strain(found.function(a))) * ufl.inner(u, v) * found.dx)
    assert ones @ weighted @ ones == pytest.approx(np.trace(A) * volume, rel=1e-11)


def test_quadrature_is_full(mesh):
    """The degree is ours, not the form compiler's guess."""
    kind, position, cells = mesh
    assert CellBlock.of(position, kind, cells).dx.metadata() == {
        "quadrature_degree": CELLS[kind][2]
    }


def test_the_compiler_keeps_quiet(caplog):
    before = logging.root.manager.disable
    with dolfinx_compat._quiet_compiler():
        logging.getLogger().info("gcc ...")
    assert not caplog.records and logging.root.manager.disable == before


def test_what_it_takes(monkeypatch):
    assert dolfinx_compat.takes("tetra10") and not dolfinx_compat.takes("wedge")
    monkeypatch.setattr(dolfinx_compat, "find_spec", lambda name: None)
    assert not dolfinx_compat.takes("tetra10")


def test_names_of_one_version_only_in_this_layer():
    """No name that one version lacks, and no question for a version, outside of the layer."""
    wrong = []
    for package in ("hbm", "modal", "static_contact", "tipdamp", "meshes"):
        for path in (ROOT / package).rglob("*.py"):
            name = path.relative_to(ROOT).as_posix()
            text = path.read_text(encoding="utf-8")
            if name == "modal/elements/dolfinx_compat.py" or not {"dolfinx", "ufl", "basix"} & set(
                _imports(text)
            ):
                continue
            wrong += [
                f"{name}: {used}"
                for used in _names(text)
                if used in ONE_VERSION_ONLY | {"__version__"}
            ]
    assert not wrong


def _imports(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or "").split(".")[0]


def _names(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.ImportFrom):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def test_ctrl_c_still_interrupts():
    """In a fresh process: gmsh, which dolfinx can load, would have Ctrl-C end it without a word."""
    program = (
        "import signal; from tipdamp.modal.elements.dolfinx_compat import CellBlock\n"
        "from tests.modal.blocks import block\n"
        "made = block('tetra'); CellBlock.of(made.position, 'tetra', made.cells['tetra'])\n"
        "import sys; assert 'dolfinx' in sys.modules and 'gmsh' not in sys.modules\n"
        "assert signal.getsignal(signal.SIGINT) is signal.default_int_handler"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        capture_output=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert done.returncode == 0, done.stderr
