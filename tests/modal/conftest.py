"""A straight bar of one cell type, meshed by gmsh."""

import pytest

LENGTH, WIDTH, HEIGHT = 0.1, 0.02, 0.01


def make_bar(path, order=2, hexahedra=True, cells=6):
    """Write a bar along x with groups 'clamp' (x = 0), 'tip' (x = L), both surfaces, and volume
    'bar'."""
    import gmsh

    gmsh.initialize(readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("bar")
        gmsh.model.occ.addBox(0, 0, 0, LENGTH, WIDTH, HEIGHT)
        gmsh.model.occ.synchronize()
        for _, curve in gmsh.model.getEntities(1):
            box = gmsh.model.getBoundingBox(1, curve)
            gmsh.model.mesh.setTransfiniteCurve(curve, (cells if box[3] - box[0] > 0.05 else 2) + 1)
        for _, surface in gmsh.model.getEntities(2):
            gmsh.model.mesh.setTransfiniteSurface(surface)
            if hexahedra:
                gmsh.model.mesh.setRecombine(2, surface)
        gmsh.model.mesh.setTransfiniteVolume(1)
        gmsh.model.addPhysicalGroup(3, [1], 1)
        gmsh.model.setPhysicalName(3, 1, "bar")
        for tag, (name, x) in enumerate((("clamp", 0.0), ("tip", LENGTH)), start=2):
            faces = [
                s
                for _, s in gmsh.model.getEntities(2)
                if abs(gmsh.model.occ.getCenterOfMass(2, s)[0] - x) < 1e-9
            ]
            gmsh.model.addPhysicalGroup(2, faces, tag)
            gmsh.model.setPhysicalName(2, tag, name)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


@pytest.fixture(scope="session")
def bar_file(tmp_path_factory):
    pytest.importorskip("gmsh")
    return make_bar(tmp_path_factory.mktemp("bar") / "bar.msh")


@pytest.fixture(scope="session")
def bar(bar_file):
    from tipdamp.readers.dispatch import read_mesh

    return read_mesh(bar_file)
