"""Cylinder on a block with hard contact: peak pressure and half width against Hertz, as the mesh is
refined.

Plane strain (one layer of hex8, nothing moves along y), half of the section. Both bodies of steel,
R = 100 a, 50 a wide and high: what the closed form leaves out is of order (a/R)^2 and (a/50a)^2.
"""

from dataclasses import dataclass, replace

import numpy as np

from tests.boxes import block
from tests.validation import Subject, row
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.body import Body
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.static_contact.contact.preload import StaticContact

STEEL = Material(207e9, 0.3, 7850.0)
A, RADIUS, SIZE = 1e-3, 0.1, 0.05  # m: half width wanted, radius, extent of both bodies
COMBINED = STEEL.E / (2 * (1 - STEEL.nu**2))  # E*: both bodies alike
LINE = np.pi * COMBINED * A**2 / (4 * RADIUS)  # N/m for a half width A; p0 = 2 LINE / (pi A)
PEAK = 2 * LINE / (np.pi * A)


@dataclass(frozen=True)
class Rung:
    """peak (Pa) and half_width (m) from the nodal forces; x, pressure: the profile."""

    peak: float
    half_width: float
    x: np.ndarray
    pressure: np.ndarray


def spaced(h, fine, growth=1.18):
    """0, h, 2h .. to `fine`, then growing steps to SIZE."""
    x = list(np.arange(round(fine / h) + 1) * h)
    step = h
    while x[-1] + step * growth < SIZE - step:
        step *= growth
        x.append(x[-1] + step)
    return np.array([*x, SIZE])


def half_section(h, top: bool):
    """(Mesh, Body) of the block below z = 0, or of the cylinder above."""
    x, z = spaced(h, 1.6 * A), spaced(h, 0.75 * A)
    mesh = block(x, np.array([0.0, h]), z if top else -z[::-1])
    if top:  # sheared onto the arc, flat at the clamp
        p = mesh.position
        arc = RADIUS - np.sqrt(RADIUS**2 - p[:, 0] ** 2)
        p[:, 2] = arc + p[:, 2] * (1.3 * SIZE - arc) / SIZE
    body = elastic_body(mesh, STEEL, "cylinder" if top else "block", clamp="z1" if top else "z0")
    on_axis = np.isin(body.node[body.dof_node], mesh.groups["x0"])
    keep = np.flatnonzero((body.dof_direction != 1) & ~(on_axis & (body.dof_direction == 0)))
    return mesh, replace(
        body,
        K=body.K[keep][:, keep].tocsr(),
        M=body.M[keep][:, keep].tocsr(),
        M_clamped=None,
        dof_node=body.dof_node[keep],
        dof_direction=body.dof_direction[keep],
    )


def surface(mesh, body: Body, group):
    """Node numbers of the surface where it is fine, in the order of x, then y; and their x."""
    mine = mesh.groups[group]
    p = mesh.position[mesh.index(mine)]
    mine, p = mine[p[:, 0] < 1.59 * A], p[p[:, 0] < 1.59 * A]
    order = np.lexsort((p[:, 1], np.round(p[:, 0], 12)))
    return mine[order], p[order]


def rung(per_width: int) -> Rung:
    """The contact with so many elements over the half width."""
    h = A / per_width
    (up, cylinder), (low, base) = half_section(h, True), half_section(h, False)
    (top, p), (bottom, q) = surface(up, cylinder, "z0"), surface(low, base, "z1")
    model = assemble(*(craig_bampton(b, n, 0).model for b, n in ((cylinder, top), (base, bottom))))
    P, full = len(top), np.full
    # n: from the cylinder into the block
    frame = np.tile([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]], (P, 1, 1))
    pairs = ContactTable(
        side=full(P, "line"),
        station=np.arange(P),
        row=np.zeros(P),
        blade_body=full(P, "block"),
        blade_node=bottom,
        damper_body=full(P, "cylinder"),
        damper_node=top,
        position=q,
        frame=frame,
        gap=np.zeros(P),
        kn=full(P, np.inf),
        kt=np.ones(P),
        mu=np.zeros(P),
        preload=np.zeros(P),
        weight=np.ones(P),
    )
    statics, none = StaticContact(model, pairs), np.zeros(model.size)
    gap = p[:, 2] - q[:, 2]

    def press(depth):
        return statics.solve(none, gap=gap - depth).force

    low_depth, high_depth = 0.0, 10 * A**2 / RADIUS
    for _ in range(60):  # the approach that gives the wanted line load
        middle = (low_depth + high_depth) / 2
        low_depth, high_depth = (
            (middle, high_depth) if 2 * press(middle).sum() / h < LINE else (low_depth, middle)
        )
    force = press(low_depth).reshape(-1, 2).sum(axis=1)
    x = p[::2, 0]
    width = np.where(x > 0, h, h / 2) * h
    pressure = force / width
    inside = (pressure > 0) & (x < 0.95 * A)
    slope, level = np.polyfit(x[inside] ** 2, pressure[inside] ** 2, 1)  # p^2 = p0^2 (1 - x^2/a^2)
    return Rung(np.sqrt(level), np.sqrt(-level / slope), x, pressure)


def rows():
    for n in (4, 8, 16, 32):
        found = rung(n)
        against = "Hertz, 16 elements and more" if n >= 16 else "Hertz, coarser"
        yield row(f"{n} elements over the half width, peak pressure, Pa", found.peak, PEAK, against)
        yield row(f"{n} elements over the half width, half width, m", found.half_width, A, against)


SUBJECT = Subject(
    "Hertz: a cylinder on a block",
    "Hard contact of two elastic bodies in plane strain, 8-node hexahedra. Peak pressure p0 and "
    "half width a are those of the straight line p^2 = p0^2 (1 - x^2 / a^2), fitted over x^2 to "
    "the nodal forces over their share of the surface, where these press and x < 0.95 a.",
    rows,
    {"Hertz, 16": 5e-3},
)
