"""Blades and damper of a mesh file that holds both: told apart by groups of cells, or by what is
connected."""

from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm.errors import InputError, shown
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import parts


@dataclass(frozen=True)
class Wanted:
    """What the study says of the cells of a body. cells - groups, () where it names none; holds - a
    group of nodes of the body, by which its connected piece is found; where - of the body in the
    study, for messages."""

    where: str
    cells: tuple[str, ...]
    holds: str = ""


def cut(mesh: Mesh, members: dict[str, np.ndarray], source: str) -> Mesh:
    """The cells {type: (c,) bool} of a mesh as a mesh of its own, with the groups that reach it."""
    cells = {kind: mesh.cells[kind][mine] for kind, mine in members.items() if mine.any()}
    used = np.unique(np.concatenate([block.ravel() for block in cells.values()]))
    node = mesh.node[used]
    number = {kind: mesh.number[kind][members[kind]] for kind in cells}
    groups = {name: found[np.isin(found, node)] for name, found in mesh.groups.items()}
    # a face of two bodies belongs to both: which of them it bounds is known where it is used
    faces = {
        name: found[np.isin(found, [*node, -1]).all(axis=1)]
        for name, found in mesh.face_groups.items()
    }
    cell_groups = {
        name: found[np.isin(found, np.concatenate(list(number.values())))]
        for name, found in mesh.cell_groups.items()
    }
    return replace(
        mesh,
        node=node,
        position=mesh.position[used],
        source=source,
        number=number,
        cells={kind: np.searchsorted(used, block) for kind, block in cells.items()},
        groups=_filled(groups),
        face_groups=_filled(faces),
        cell_groups=_filled(cell_groups),
    )


def _filled(groups: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: found for name, found in groups.items() if len(found)}


def split(mesh: Mesh, blades: Wanted, damper: Wanted) -> tuple[Mesh, Mesh]:
    """(blades, damper) of one mesh. Cells that one of them names are its own, all others belong to
    the other where that names none; where both name none the damper is the connected piece with the
    nodes that it holds.

    Raises InputError for a cell that both name, a body without cells, and a mesh in one piece.
    """
    if damper.cells:
        of_damper = named_cells(mesh, damper)
    elif blades.cells:
        of_damper = {kind: ~mine for kind, mine in named_cells(mesh, blades).items()}
    else:
        of_damper = _connected(mesh, damper)
    of_blades = (
        named_cells(mesh, blades)
        if blades.cells
        else {kind: ~mine for kind, mine in of_damper.items()}
    )
    for kind, mine in of_blades.items():
        both = mine & of_damper[kind]
        if both.any():
            raise InputError(
                f"{damper.where} cells and {blades.where} cells: {int(both.sum())} {kind} cells "
                f"belong to both (first: element {mesh.number[kind][both][0]}); name groups that "
                "do not overlap"
            )
    return cut_named(mesh, blades, of_blades), cut_named(mesh, damper, of_damper)


def cut_named(mesh: Mesh, wanted: Wanted, members: dict[str, np.ndarray]) -> Mesh:
    """`cut`, with the body in the name of its source."""
    if not any(mine.any() for mine in members.values()):
        raise InputError(
            f"{wanted.where}: no cells of {mesh.source} are left for it; name its own: cells = "
            '"..."'
        )
    return cut(mesh, members, f"{mesh.source}, {wanted.where}")


def named_cells(mesh: Mesh, wanted: Wanted) -> dict[str, np.ndarray]:
    """{type: (c,) bool} of the groups of cells that a body names."""
    found = {kind: np.zeros(len(block), dtype=bool) for kind, block in mesh.cells.items()}
    for name in wanted.cells:
        try:
            for kind, mine in mesh.members(name).items():
                found[kind] |= mine
        except InputError as error:
            raise InputError(f"{wanted.where} cells: {error}") from None
    return found


def _connected(mesh: Mesh, damper: Wanted) -> dict[str, np.ndarray]:
    """Cells of the pieces that hold nodes of the damper's group."""
    count, label = parts(mesh)
    pieces = np.unique(label[mesh.index(mesh.group(damper.holds))])
    if len(pieces) == count:
        raise InputError(
            f"{damper.where}: mesh is the file of the [blades] too, and "
            + (
                "all its cells are connected"
                if count == 1
                else f"'{shown(damper.holds)}' has nodes on every piece of it"
            )
            + '; name another file, or the groups of cells of each body: cells = "..."'
        )
    return {kind: np.isin(label[block[:, 0]], pieces) for kind, block in mesh.cells.items()}
