"""All rows, in the order of the catalogue."""

from tests.robustness import matrices, meshes, studies
from tests.robustness.rows import ROWS

__all__ = ["ROWS", "matrices", "meshes", "studies"]
