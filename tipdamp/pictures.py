"""Shapes on the meshes as .vtu files, for ParaView and the like. Written by meshio; left out where it is missing."""

import numpy as np

# straight cells through the corners: every viewer draws them, and the shapes are at the user's own nodes
_CORNERS = {"tetra": 4, "wedge": 6, "hexahedron": 8}


def write_shapes(path, mesh, shapes: dict) -> bool:
    """One file with the cells of a mesh and, at its nodes, the numbers of the user and vectors {name: (n, 3)}.

    Returns False where meshio is not installed.
    """
    try:
        import meshio
    except ImportError:
        return False
    blocks = []
    for kind, cells in mesh.cells.items():
        straight = kind.rstrip("0123456789")
        blocks.append((straight, cells[:, :_CORNERS[straight]]))
    used = np.unique(np.concatenate([cells.ravel() for _, cells in blocks]))
    blocks = [(kind, np.searchsorted(used, cells)) for kind, cells in blocks]
    data = {"node": mesh.node[used], **{name: shape[used] for name, shape in shapes.items()}}
    meshio.write(path, meshio.Mesh(mesh.position[used], blocks, point_data=data), file_format="vtu")
    return True
