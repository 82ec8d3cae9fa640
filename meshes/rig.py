"""The two-blade rig as numbers: its lengths, the contact lines, and how many cells a mesh has.

x runs across the two blades, y along the damper axis from 0 to `length`, z up; the blade root is at
z = 0, the fixture below it. The paper publishes no geometry: the lengths were fitted to its five
frequencies (see meshes/README.md)."""

import tomllib
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from tipdamp.hbm.errors import InputError, nearest

STATIONS = 31  # contact stations along the axis (paper, section 8)
SIDES = ("left", "right")
DAMPERS = {  # shape of the left and of the right side (paper, figure 1b)
    "asymmetric": ("round", "flat"),
    "cylindrical": ("round", "round"),
    "wedge": ("flat", "flat"),
}
RIGS = ("asymmetric", "twin")  # lengths of rig_<name>.toml
DEFAULTS = Path(__file__).with_name("rig_asymmetric.toml")
_DEFAULT = tomllib.loads(DEFAULTS.read_text())


@dataclass(frozen=True)
class Rig:
    """Lengths in m, angle in degrees, area in m2; the defaults are the fitted values of
    rig_asymmetric.toml."""

    height: float = _DEFAULT["height"]  # blade, root to tip
    root_thickness: float = _DEFAULT["root_thickness"]
    tip_thickness: float = _DEFAULT["tip_thickness"]
    # thickness at half height over the linear taper's
    mid_thickness_factor: float = _DEFAULT["mid_thickness_factor"]
    pitch: float = _DEFAULT["pitch"]  # between the blades' mid-planes
    length: float = _DEFAULT["length"]  # of everything along y
    fixture_height: float = _DEFAULT["fixture_height"]
    fixture_overhang: float = _DEFAULT["fixture_overhang"]  # beyond the outer side of the roots
    # the fixture's bottom is clamped for |x| >= free_span / 2
    free_span: float = _DEFAULT["free_span"]
    damper_radius: float = _DEFAULT["damper_radius"]
    flat_width: float = _DEFAULT["flat_width"]
    contact_angle: float = _DEFAULT["contact_angle"]  # of the contact normals to the x axis
    cover_margin_below: float = _DEFAULT["cover_margin_below"]  # cover below the flat's lower edge
    cover_margin_above: float = _DEFAULT["cover_margin_above"]  # cover above the flat's upper edge
    patch_area: float = _DEFAULT["patch_area"]  # of the accelerometer (paper, section 8)

    @classmethod
    def named(cls, name: str) -> "Rig":
        """The lengths of meshes/rig_<name>.toml; `RIGS` lists the names."""
        return cls(**tomllib.loads(DEFAULTS.with_name(f"rig_{name}.toml").read_text()))

    def __post_init__(self) -> None:
        for f in fields(self):
            value = vars(self)[f.name]
            if not (isinstance(value, int | float) and np.isfinite(value) and value > 0):
                raise InputError(f"{f.name} = {value}: a positive number is needed")
        inner = self.pitch - self.root_thickness
        outer = self.pitch + self.root_thickness
        steepest = np.radians(min(self.contact_angle, 90.0 - self.contact_angle))
        widest = 2 * self.damper_radius * np.sin(steepest)
        for name, low, high, why in (
            ("root_thickness", 0.0, self.pitch, "pitch: the roots stand apart"),
            ("free_span", inner, outer, "the clamp edge lies under the roots"),
            ("contact_angle", 0.0, 90.0, "degrees"),
            ("flat_width", 0.0, widest, "by damper_radius and contact_angle"),
            ("height", self.cover_height + self.patch_height, np.inf, "cover and patch need it"),
        ):
            value = vars(self)[name]
            if not low < value < high:
                raise InputError(
                    f"{name} = {value:.6g}: must lie between {low:.6g} and {high:.6g} ({why})"
                )

    def thickness(self, z: np.ndarray | float) -> np.ndarray:
        """Blade thickness at height z (m), cubic in z."""
        q = np.asarray(z) / self.height
        taper = self.root_thickness + (self.tip_thickness - self.root_thickness) * q
        return taper * (1 + (self.mid_thickness_factor - 1) * 4 * q * (1 - q))

    @property
    def flat_distance(self) -> float:
        """From the damper's centre to a flat: its edges lie on the circle."""
        return np.sqrt(self.damper_radius**2 - self.flat_width**2 / 4)

    @property
    def cover_height(self) -> float:
        """Measured with the flat's edges for all three dampers, so that the covers keep their
        height."""
        beta = np.radians(self.contact_angle)
        return self.flat_width * np.cos(beta) + self.cover_margin_below + self.cover_margin_above

    @property
    def patch_half_length(self) -> float:
        """The patch reaches two contact stations to each side of the mid-length."""
        return 2 * self.length / (STATIONS - 1)

    @property
    def patch_height(self) -> float:
        """Along z; the blade's side is steep enough that the patch's area is right to 0.5 %."""
        return self.patch_area / (2 * self.patch_half_length)


@dataclass(frozen=True)
class Contact:
    """Cross-section of the contact between a damper and the covers, (x, z) in m; sides are 'left'
    and 'right'."""

    centre: np.ndarray  # (2,) damper axis
    shape: dict  # side -> 'round' or 'flat'
    normal: dict  # side -> (2,) unit normal from the damper into the blade
    distance: dict  # side -> centre to contact plane
    rows: dict  # side -> (R, 2) contact points, row 0 lowest
    turn: dict  # side -> z at which the cover's face turns vertical

    def face_x(self, side: str, z: np.ndarray | float) -> np.ndarray:
        """x of the cover's contact face at height z: in the contact plane, vertical above
        `turn`."""
        n, z = self.normal[side], np.minimum(z, self.turn[side])
        return self.centre[0] + (self.distance[side] - n[1] * (z - self.centre[1])) / n[0]


def contact(rig: Rig, damper: str, rows: int = 2) -> Contact:
    """Where the named damper touches the covers; `rows` lines of pairs on a flat side, one on a
    round side."""
    if damper not in DAMPERS:
        raise InputError(f"damper '{damper}' is unknown; {nearest(damper, DAMPERS)}")
    if not (isinstance(rows, int) and 2 <= rows <= 9):
        raise InputError(f"rows = {rows}: a whole number from 2 to 9 is needed")
    beta = np.radians(rig.contact_angle)
    shape = dict(zip(SIDES, DAMPERS[damper], strict=True))
    distance = {s: rig.damper_radius if shape[s] == "round" else rig.flat_distance for s in SIDES}
    # above the centre
    upper_edge = rig.flat_distance * np.sin(beta) + rig.flat_width / 2 * np.cos(beta)
    aside = (distance["left"] - distance["right"]) / (2 * np.cos(beta))
    centre = np.array([aside, rig.height - rig.cover_margin_above - upper_edge])
    normal, lines, turn = {}, {}, {}
    for side, sign in zip(SIDES, (-1.0, 1.0), strict=True):
        n = normal[side] = np.array([sign * np.cos(beta), np.sin(beta)])
        along = np.array([-sign * np.sin(beta), np.cos(beta)])  # up the face
        flat = shape[side] == "flat"
        offsets = np.linspace(-0.5, 0.5, rows) * rig.flat_width if flat else np.zeros(1)
        lines[side] = centre + distance[side] * n + offsets[:, None] * along
        top = lines[side][-1, 1]
        turn[side] = top if flat else (top + rig.height) / 2
    found = Contact(centre, shape, normal, distance, lines, turn)
    _check_covers(rig, found)
    return found


def _check_covers(rig: Rig, found: Contact) -> None:
    gap = found.face_x("right", rig.height) - found.face_x("left", rig.height)
    if not gap > 0:
        raise InputError(
            f"the covers touch in the mid-plane (gap {gap:.3g} m): lower cover_margin_above or "
            "raise damper_radius"
        )
    bottom = rig.height - rig.cover_height
    room = (rig.pitch - rig.thickness(bottom)) / 2 - max(
        abs(found.face_x(s, bottom)) for s in SIDES
    )
    if not room > 0:
        raise InputError(
            f"pitch = {rig.pitch:.6g}: no room for the covers between the blades, raise it by "
            f"more than {-2 * room:.3g}"
        )


@dataclass(frozen=True)
class Cells:
    """Numbers of quadratic cells in each direction of the mesh."""

    axial: int = 15  # along y; a multiple of 15 puts a node at each of the 31 stations
    height: int = 8  # blade, root to patch
    patch: int = 2
    thickness: int = 1  # blade, to each side of the line that ends in the clamp edge
    cover: int = 2  # from blade to contact face
    face: int = 1  # cover, on each piece beside the contact lines (twice below a round side's line)
    flat: int = 2  # across a flat (at least rows - 1)
    fixture: int = 2  # fixture's height
    span: int = 2  # fixture between the roots
    overhang: int = 2  # fixture beyond the roots
    ring: int = 1  # damper, from its core to its surface
    gap: int = 2  # damper, circumference between the two sides

    @classmethod
    def of_size(cls, size: float) -> "Cells":
        """`size` is a density along each edge: 1 the default mesh, 0.25 the coarsest, 2 half the
        cell length."""
        if not (isinstance(size, int | float) and 0.25 <= size <= 2.0):
            raise InputError(f"size = {size}: must lie between 0.25 and 2")
        scaled = {name: max(1, round(number * size)) for name, number in asdict(cls()).items()}
        return cls(**scaled | {"axial": 15 * max(1, round(size))})
