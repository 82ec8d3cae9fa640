"""All rows, in the order of the catalogue."""

from tests.robustness import hostile, matrices, meshes, runtime, solver, studies, tables
from tests.robustness.rows import in_order

FILES = (meshes, matrices, studies, tables, solver, runtime, hostile)
ROWS = in_order()
