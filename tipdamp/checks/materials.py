"""Materials that a mesh file gives, beside those of the study."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.errors import shown
from tipdamp.modal.mesh import Mesh
from tipdamp.study.view import Study

ALIKE = 1e-3  # of each constant: people round them


def unlike_materials(study: Study, mesh: Mesh) -> Iterator[str]:
    """Of each group of cells the material of the file, in its own units, where the study has
    another for these cells: it is not taken over."""
    stated = {one.group: one for one in study.materials.values()}
    for group, given in mesh.materials.items():
        if group not in mesh.cell_groups:  # of the other body of the file
            continue
        own = stated.get(group, study.material)
        alike = np.isclose(
            [own.E, own.nu, own.density],
            given.in_si(study.length_unit),
            rtol=ALIKE,
            atol=0.0,
        )
        if not alike.all():
            yield (
                f"material {shown(given.name)} of '{shown(group)}' (E = {given.E:g}, nu = "
                f"{given.nu:g}, density = {given.density:g} in the units of the file)"
            )
