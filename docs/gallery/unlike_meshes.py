"""Contact between unlike meshes

A damper of 5 x 3 faces on a blade of 4 x 3 larger ones: no node meets a node. Each corner of a face
of the damper is a contact point with the area around it. (In a study: name both surfaces.)
"""

import matplotlib.pyplot as plt
import numpy as np

from tipdamp import Mesh
from tipdamp.meshes.structured import extrude, join, ruled
from tipdamp.modal.faces import boundary_faces
from tipdamp.static_contact.surfaces.facets import Surface
from tipdamp.static_contact.surfaces.pairing import Side
from tipdamp.static_contact.surfaces.points import FacingSides, surface_contact


def block(x, y, z, first):  # of 27-node hexahedra, nodes numbered from the first
    place, cells = extrude(*join([ruled(*([(a, c) for a in x] for c in z), 1)]), y)
    return Mesh(first + np.arange(len(place)), place, {"hexahedron27": cells})


def surface(mesh, z):
    return Surface(mesh, [f[(mesh.position[f][..., 2] == z).all(1)] for f in boundary_faces(mesh)])


line = np.linspace  # m
damper = surface(block(line(2e-3, 0.012, 11), line(1e-3, 7e-3, 7), (5e-3, 8e-3), 1), 5e-3)
blade = surface(block(line(0, 0.014, 9), line(0, 8e-3, 7), (0, 5e-3), 5001), 5e-3)
side = FacingSides(Side("under", "top", "foot"), blade, damper)
pairs, _, _ = surface_contact([side], axis=[1, 0, 0], pull=[0, 0, -1])
axes = plt.figure(layout="constrained").subplots()
for one, colour in ((blade, "0.6"), (damper, "tab:orange")):
    for corners in one.mesh.position[one.faces[0][:, [0, 1, 2, 3, 0]]]:
        axes.plot(*1e3 * corners[:, :2].T, colour)
axes.scatter(*1e3 * pairs.position[:, :2].T, s=3e7 * pairs.area, zorder=3)
axes.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")

assert np.isclose(pairs.area.sum(), 0.010 * 0.006)  # m2, all that both cover
