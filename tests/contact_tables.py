"""A contact table from the columns that a test is about; the others by default."""

import numpy as np

from tipdamp.hbm.contact import ContactTable


def contact_table(frame, **columns) -> ContactTable:
    """P pairs with the frames (P, 3, 3) between nodes 1 to P of 'damper' and the ground, one row on
    one side, at the origin: kn = kt = 1e6 N/m, no friction, gap or preload. A single value stands
    for all pairs."""
    P = len(frame)
    default = {
        "side": "side",
        "station": np.arange(P),
        "row": 0,
        "blade_body": "ground",
        "damper_body": "damper",
        "blade_node": np.arange(P),
        "damper_node": np.arange(1, P + 1),
        "position": np.zeros(3),
        "gap": 0.0,
        "kn": 1e6,
        "kt": 1e6,
        "mu": 0.0,
        "preload": 0.0,
        "weight": 1.0,
    } | columns
    shape = {"position": (P, 3)}
    return ContactTable(
        frame=frame,
        **{name: np.broadcast_to(value, shape.get(name, P)) for name, value in default.items()},
    )


def frames(normals, t1=(0.0, 1.0, 0.0)) -> np.ndarray:
    """(P, 3, 3) right-handed frames of unit normals (P, 3) across t1."""
    n = np.asarray(normals, dtype=float)
    along = np.broadcast_to(t1, n.shape)
    return np.stack([along, np.cross(n, along), n], axis=1)
