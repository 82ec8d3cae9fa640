"""Sections of a study file, one frozen model each: every key with its type, kind, unit, default,
range and meaning.

docs/study_files.md and the JSON schema for editors are made from them (study/documentation.py).
Values are in SI units."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from tipdamp.static_contact.surfaces.pick import FacePick
from tipdamp.study.faces import FACES
from tipdamp.study.hold import HOLD, HoldChoice
from tipdamp.study.law import DEFAULT, LAW, LawChoice
from tipdamp.study.swept import AXES, INTERVALS, SampledKey, SweptKey
from tipdamp.study.values import (
    BAND,
    CHOICE,
    COLUMNS,
    COUNT,
    COUNT_OR_AUTO,
    COUNTS,
    COUNTS_OR_AUTO,
    FLAG,
    GROUP_VALUES,
    GROUP_VECTORS,
    NUMBER,
    NUMBERS,
    ONE_OR_MORE,
    PHASE,
    RATIOS,
    ROLL,
    STATIONS,
    TABLE,
    TEXT,
    TEXTS,
    TRIPLE,
    VECTOR,
    Key,
)

UNITS = {
    "length": {"m": 1.0, "mm": 1e-3},
    "force": {"N": 1.0, "kN": 1e3},
    "stress": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    "density": {"kg/m3": 1.0, "t/mm3": 1e12, "g/cm3": 1e3},
}
# measured or published values that the report sets beside ours
REFERENCE = (
    "out_of_phase_hz",
    "in_phase_hz",
    "full_line_hz",
    "tuned_hz",
    "full_area_hz",
    "front",
    "back",
    "in_phase_rank",
    "out_of_phase_rank",
)

Numbers = tuple[float, ...]
Texts = tuple[str, ...]
Vector = tuple[float, float, float]
OnGroup = tuple[str, str, float]
VectorOnGroup = tuple[str, str, float, float, float]
Band = tuple[float, float]
NONE = (0.0, 0.0)  # a band that is not given

# keys of several sections
Young = Annotated[
    float, Key(NUMBER, "Young's modulus", "stress", low=0, open_low=True, sizes=(1e-3, 1e18))
]
Poisson = Annotated[float, Key(NUMBER, "Poisson's ratio", low=0, high=0.4999)]
Density = Annotated[
    float, Key(NUMBER, "density", "density", low=0, open_low=True, sizes=(1e-9, 1e9))
]
FatigueLimit = Annotated[
    float | None,
    Key(
        NUMBER,
        "alternating stress that is endured without a mean stress; with tensile_strength, "
        "[respond] stress finds the safety by Goodman",
        "stress",
        low=0,
        open_low=True,
    ),
]
TensileStrength = Annotated[
    float | None, Key(NUMBER, "mean stress at which none is", "stress", low=0, open_low=True)
]
WaveSpeed = Annotated[
    Band,
    Key(
        BAND,
        "range of sqrt(E/density) in m/s that passes without a warning of wrong units",
        low=0,
        open_low=True,
    ),
]
ModesBelow = Annotated[
    float | None,
    Key(
        NUMBER,
        "instead of a number: all fixed-interface modes below this frequency",
        low=0,
        open_low=True,
    ),
]
WantedError = Annotated[
    float | None,
    Key(
        NUMBER,
        "instead of a number: as many modes as it takes for the body to add "
        "at most this relative error to any stuck frequency below 5 kHz",
        low=1e-9,
        high=0.1,
    ),
]
LoadModes = Annotated[
    bool,
    Key(
        FLAG,
        "keep beside the modes the static shape of each load (pull, [loads.NAME]) that "
        "acts off the contact, so that the displacement of the whole body under it is exact",
    ),
]
Modes = Annotated[int, Key(COUNT, "fixed-interface modes kept", low=0, high=2000)]
Cells = Annotated[
    Texts,
    Key(
        ONE_OR_MORE,
        "group of cells, or several groups, that the body consists of; default: the "
        "whole file, or, where one file holds both bodies, what the other one leaves: the damper "
        "is then what is connected to its load points",
    ),
]
Axis = Annotated[Vector, Key(VECTOR, "direction along the damper")]
Pull = Annotated[
    float, Key(NUMBER, "Fc, the total pull on the damper", "force", low=0, open_low=True)
]
PullDirection = Annotated[Vector, Key(VECTOR, "direction of the pull")]
Holds = Annotated[
    tuple[HoldChoice, ...],
    Key(
        HOLD,
        "rigid motion of the damper that no contact resists and that is held, such as its slide "
        "along its own axis: a direction ('y' or [0, 1, 0]), a rotation through its centre of "
        "mass ('about y'), or { motion = \"y\", stiffness = ..., mean = true }; a list of these "
        "holds several. A linear spring whose force is a result; stiffness (of rotations in N "
        "m/rad) by default 1e-5 of what the sticking pairs resist the motion with; mean = true "
        "holds the mean alone, rigidly",
        "force/length",
    ),
]


class StudySection(BaseModel):
    """A section of a study: frozen, read by attribute; a key that it does not have is refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def data_sheets(cls) -> dict[str, Key]:
        """Data sheets of its keys, in the order of the documentation."""
        return {
            name: next(m for m in field.metadata if isinstance(m, Key)).of(field.annotation)
            for name, field in cls.model_fields.items()
        }


class Top(StudySection):
    """Keys at the top of the file."""

    title: Annotated[str, Key(TEXT, "shown on the report")] = ""
    results: Annotated[
        str,
        Key(
            TEXT, "folder of the results, relative to the study file; default: results/<study name>"
        ),
    ] = ""


class MaterialSection(StudySection):
    """[material]: of all cells that no other material names."""

    E: Young
    nu: Poisson
    density: Density
    fatigue_limit: FatigueLimit = None
    tensile_strength: TensileStrength = None
    wave_speed: WaveSpeed = (2000.0, 7000.0)


class OtherMaterial(StudySection):
    """[material.NAME]: of a group of cells."""

    group: Annotated[
        str, Key(TEXT, "cells that are made of it: a group of cells of one of the meshes")
    ]
    E: Young
    nu: Poisson
    density: Density
    fatigue_limit: FatigueLimit = None
    tensile_strength: TensileStrength = None
    wave_speed: WaveSpeed = (2000.0, 7000.0)


class Blades(StudySection):
    """[blades]: both blades on their fixture."""

    mesh: Annotated[
        str,
        Key(
            TEXT,
            "mesh of both blades on their fixture: .msh, .inp, .cdb or .bdf; it may hold the "
            "damper too",
        ),
    ]
    cells: Cells = ()
    clamp: Annotated[Texts, Key(ONE_OR_MORE, "group of nodes that are fixed, or several groups")]
    modes: Modes = 40
    modes_below_hz: ModesBelow = None
    error: WantedError = None
    load_modes: LoadModes = False


class Damper(StudySection):
    """[damper]: its mesh, reduction and pull."""

    mesh: Annotated[
        str,
        Key(TEXT, "mesh of the damper: .msh, .inp, .cdb or .bdf; it may be the file of the blades"),
    ]
    cells: Cells = ()
    modes: Modes = 20
    modes_below_hz: ModesBelow = None
    error: WantedError = None
    load_modes: LoadModes = False
    axis: Axis = (0.0, 1.0, 0.0)
    pull: Pull
    pull_direction: PullDirection = (0.0, 0.0, 1.0)
    load_points: Annotated[str, Key(TEXT, "group of nodes that carry the pull")] = "load_points"
    shares: Annotated[
        Numbers,
        Key(
            NUMBERS,
            "part of the pull on each load point, in the order of the axis; default: equal",
            low=0,
            high=1,
        ),
    ] = ()
    positions: Annotated[
        Numbers,
        Key(
            NUMBERS,
            "where the pull acts along the axis (0..1 of the damper's length), carried by the "
            "two mesh nodes beside each on the line through the load points; default: at the "
            "load points",
            low=0,
            high=1,
        ),
    ] = ()
    hold: Holds = ()


class Model(StudySection):
    """[model]: reduced matrices instead of meshes."""

    matrices: Annotated[
        str,
        Key(TEXT, ".npz with M, K, the dof table, groups and the load 'pull', instead of meshes"),
    ]
    axis: Axis = (0.0, 1.0, 0.0)
    pull: Pull
    pull_direction: PullDirection = (0.0, 0.0, 1.0)
    hold: Holds = ()


class ContactSection(StudySection):
    """[contact]: what all sides have in common."""

    pairs: Annotated[
        str,
        Key(
            TEXT,
            "CSV of your own pairs of the whole patch, instead of those matched between the "
            "meshes; mu of every side, and kn and kt of one that has a section, stand in the place "
            "of its values",
        ),
    ] = ""
    mu: Annotated[
        float | None, Key(NUMBER, "friction coefficient; above 2 with a warning", low=0)
    ] = None
    tolerance: Annotated[
        float,
        Key(NUMBER, "largest distance of the two nodes of a pair", "length", low=0, open_low=True),
    ] = 1e-6
    method: Annotated[
        Literal["auto", "nodes", "surfaces"],
        Key(
            CHOICE,
            "of contact: 'nodes' that match one to one, or 'surfaces' of unlike meshes, whose "
            "contact points are the corners of the damper's faces with weighted means of the "
            "motions of both sides; 'auto': surfaces where nodes do not match and the stiffness "
            "is not per node",
        ),
    ] = "auto"
    distance: Annotated[
        Literal["auto", "closed", "gap"],
        Key(
            CHOICE,
            "of the two nodes of a pair, or of two surfaces, along the normal: 'closed': they "
            "count as touching; 'gap': it adds to the initial gap; 'auto': 'closed' for nodes, "
            "'gap' for surfaces",
        ),
    ] = "auto"
    stiffness: Annotated[
        Literal["given", "halfspace", "plane_depth", "rough_series"],
        Key(
            CHOICE,
            "of sides without kn and kt of their own: 'halfspace': smooth bodies in three "
            "dimensions; 'plane_depth': plane strain with depth; 'rough_series': halfspace in "
            "series with a rough interface; 'given': none, every side has its kn and kt. Given "
            "kn and kt replace every model",
        ),
    ] = "given"
    kind: Annotated[
        Literal["tangent", "secant"],
        Key(
            CHOICE,
            "of the stiffness from a model: 'tangent' at the side's force under the pull, or "
            "'secant' from zero force",
        ),
    ] = "tangent"
    scale: Annotated[
        float,
        Key(
            NUMBER,
            "declared factor on all stiffness from a model: real contacts are softer than "
            "smooth half-spaces; given stiffness is taken as it is",
            low=0,
            open_low=True,
        ),
    ] = 1.0
    fit_hz: Annotated[
        float | None,
        Key(
            NUMBER,
            "measured stuck frequency, instead of scale: the factor on all "
            "stiffness from a model is found with which the line model has it, every "
            "station stuck, or those of [tune] stations",
            low=0,
            open_low=True,
        ),
    ] = None
    shares: Annotated[
        Literal["equal", "tributary"],
        Key(
            CHOICE,
            "nodes of a side share its whole stiffness, from a model or given: 'equal', or by "
            "'tributary' area, which gives end nodes half. Of kn and kt per node the whole is "
            "their number times the value",
        ),
    ] = "equal"
    reduction: Annotated[
        Literal["craig_bampton", "contact_points"],
        Key(
            CHOICE,
            "what the nodes of the pairs are in the reduced bodies: 'craig_bampton': masters, "
            "three dofs each; 'contact_points': no dofs, but the static shapes of forces on "
            "them, which are as exact in statics",
        ),
    ] = "craig_bampton"
    tractions: Annotated[
        int | Literal["auto"],
        Key(
            COUNT_OR_AUTO,
            "most cells of the contact points of a body: beyond so many points its contact "
            "shapes are those of tractions that are uniform over a cell, not of forces on every "
            "point; 'auto': 200 cells from 601 points on",
            low=1,
            high=100000,
        ),
    ] = "auto"
    normal: Annotated[
        Literal["springs", "hard"],
        Key(
            CHOICE,
            "statics of the preload: on the 'springs' kn, or 'hard' (the bodies alone are elastic)",
        ),
    ] = "springs"


class SideSection(StudySection):
    """[contact.NAME]: one side of the damper."""

    blade: Annotated[
        str | FacePick,
        Key(
            FACES,
            "group of the blades' mesh: a surface, or nodes; or { ... } with what the faces "
            "fulfil: plane (normal) or cylinder (axis) with point, radius and tolerance, within "
            "(distance of the other body), box (two corners), group",
            "length",
        ),
    ] = ""
    damper: Annotated[
        str | FacePick, Key(FACES, "group of the damper's mesh, or { ... } as for blade", "length")
    ] = ""
    shape: Annotated[
        Literal["cylinder", "flat", "rounded"], Key(CHOICE, "form of the damper's side")
    ]
    kn: Annotated[
        float | None,
        Key(
            NUMBER,
            "normal stiffness per node; with kt it replaces [contact] stiffness",
            "force/length",
            low=0,
            open_low=True,
        ),
    ] = None
    kt: Annotated[
        float | None,
        Key(NUMBER, "tangential stiffness per node", "force/length", low=0, open_low=True),
    ] = None
    kn_per_area: Annotated[
        float | None,
        Key(
            NUMBER,
            "normal stiffness per area instead, each node by its tributary "
            "area: the same for every mesh",
            "force/length3",
            low=0,
            open_low=True,
        ),
    ] = None
    kt_per_area: Annotated[
        float | None,
        Key(NUMBER, "tangential stiffness per area", "force/length3", low=0, open_low=True),
    ] = None
    kn_total: Annotated[
        float | None,
        Key(
            NUMBER,
            "normal stiffness of the whole side instead, shared as [contact] "
            "shares says; on round surfaces by the points that can touch",
            "force/length",
            low=0,
            open_low=True,
        ),
    ] = None
    kt_total: Annotated[
        float | None,
        Key(NUMBER, "tangential stiffness of the whole side", "force/length", low=0, open_low=True),
    ] = None
    reference_kn: Annotated[
        float | None,
        Key(
            NUMBER,
            "published or measured normal stiffness per node, set beside the "
            "one in use in the report",
            "force/length",
            low=0,
            open_low=True,
        ),
    ] = None
    reference_kt: Annotated[
        float | None,
        Key(NUMBER, "its tangential stiffness per node", "force/length", low=0, open_low=True),
    ] = None
    radius: Annotated[
        float | None,
        Key(
            NUMBER,
            "radius of a cylindrical side, or of the edges of a rounded one; a "
            "stiffness from a model needs it",
            "length",
            low=0,
            open_low=True,
        ),
    ] = None
    width: Annotated[
        float | None,
        Key(
            NUMBER,
            "width of a flat side, or of the flat part of a rounded one; a "
            "stiffness from a model and the roll of an edge line need it",
            "length",
            low=0,
            open_low=True,
        ),
    ] = None
    depth: Annotated[
        Numbers,
        Key(
            NUMBERS,
            "[blade, damper]: depths below the contact against which stiffness = "
            "'plane_depth' counts the displacement",
            "length",
            low=0,
            open_low=True,
        ),
    ] = ()
    h_rms: Annotated[
        float | None,
        Key(
            NUMBER,
            "rms height of both surfaces combined, needed by stiffness = 'rough_series'",
            "length",
            low=0,
            open_low=True,
        ),
    ] = None
    gamma: Annotated[
        float | None,
        Key(
            NUMBER,
            "of K_rough = N / (gamma h_rms), about 0.5, by the roughness spectrum; "
            "needed by stiffness = 'rough_series'",
            low=0,
            open_low=True,
        ),
    ] = None
    rows: Annotated[
        Literal["edge", "all"],
        Key(CHOICE, "rows kept in the line model: 'edge' (row 0, the lower edge line) or 'all'"),
    ] = "all"
    roll_stiffness: Annotated[
        float | Literal["from_flat"],
        Key(
            ROLL,
            "resistance to roll that the kept edge line lacks: 'from_flat' (sum kn w^2/12), a "
            "number (N m/rad) or 0",
            low=0,
        ),
    ] = "from_flat"
    gap: Annotated[
        tuple[Band, ...],
        Key(
            TABLE,
            "initial gap g0 along the axis: [[coordinate, gap], ...], from end to "
            "end of the side, at most a tenth of the damper's size",
            "length",
        ),
    ] = ()

    @property
    def per_node(self) -> bool:
        """Whether the side brings a stiffness per node, which only matching nodes can have."""
        return self.kn is not None

    @property
    def given(self) -> bool:
        """Whether the side brings its own stiffness, which replaces every model."""
        return any(value is not None for value in (self.kn, self.kn_per_area, self.kn_total))


class RotationSection(StudySection):
    """[rotation]: axis and speed of the blades."""

    axis: Annotated[Vector, Key(VECTOR, "axis of rotation")] = (1.0, 0.0, 0.0)
    point: Annotated[Vector, Key(TRIPLE, "a point on the axis", "length")] = (0.0, 0.0, 0.0)
    speed: Annotated[
        float,
        Key(
            NUMBER,
            "rad/s at which the blades vibrate: stress stiffening and spin softening (no "
            "Coriolis forces); 0: at rest",
            low=0,
        ),
    ] = 0.0


class LoadCase(StudySection):
    """[loads.NAME]: a further load case of the preload."""

    pull: Annotated[
        float | None, Key(NUMBER, "pull on the damper in this case; default: Fc", "force", low=0)
    ] = None
    speed: Annotated[
        float,
        Key(
            NUMBER,
            "rad/s about the axis of [rotation]: centrifugal load on blades and damper, "
            "beside the pull",
            low=0,
        ),
    ] = 0.0
    gravity: Annotated[Vector, Key(TRIPLE, "acceleration [x, y, z] in m/s2")] = (0.0, 0.0, 0.0)
    forces: Annotated[
        tuple[VectorOnGroup, ...],
        Key(
            GROUP_VECTORS,
            "[[body, group, Fx, Fy, Fz], ...]: a total force in equal parts on the nodes of a "
            "group",
            "force",
        ),
    ] = ()
    pressure: Annotated[
        tuple[OnGroup, ...],
        Key(
            GROUP_VALUES,
            "[[body, group, p], ...]: on the faces of a surface group, positive presses",
            "stress",
        ),
    ] = ()
    traction: Annotated[
        tuple[VectorOnGroup, ...],
        Key(
            GROUP_VECTORS,
            "[[body, group, tx, ty, tz], ...]: force per area on the faces of a surface group",
            "stress",
        ),
    ] = ()


class PreloadSection(StudySection):
    """[preload]: bodies, load history and friction of the static contact."""

    bodies: Annotated[
        Literal["auto", "reduced", "full"],
        Key(
            CHOICE,
            "on which the static contact is solved: 'reduced': the reduced model, exact where "
            "every pair has dofs or contact shapes of its own; 'full': the unreduced bodies, for "
            "thousands of pairs; 'auto': 'full' where contact shapes are of tractions ([contact] "
            "tractions)",
        ),
    ] = "auto"
    friction: Annotated[
        bool,
        Key(
            FLAG,
            "the preload with Coulomb friction (mu and kt of the pairs): it then depends "
            "on how the load was reached, and the response starts from the friction forces at "
            "the end",
        ),
    ] = False
    history: Annotated[
        Texts,
        Key(
            TEXTS,
            "load cases ([loads.NAME]) that are passed in this order before the pull (or "
            "`case`); default: straight from no load to it",
        ),
    ] = ()
    case: Annotated[
        str,
        Key(
            TEXT,
            "load case ([loads.NAME]) whose preload is that of the stages tune and respond, "
            "instead of the pull alone: a damper pressed by rotation, say",
        ),
    ] = ""
    steps: Annotated[
        int, Key(COUNT, "increments from each load of the history to the next", low=1, high=10000)
    ] = 20
    stress: Annotated[
        bool,
        Key(
            FLAG,
            "write displacement and von Mises stress of blades and damper at rest, "
            "stress_*.vtu; both are assembled and factorised for it",
        ),
    ] = False


class Tune(StudySection):
    """[tune]: which stations, or which part of the closed area, are kept."""

    target_hz: Annotated[
        float | None,
        Key(
            NUMBER,
            "measured stuck frequency that the kept stations must meet",
            low=0,
            open_low=True,
        ),
    ] = None
    target_from: Annotated[
        str,
        Key(
            TEXT,
            "measured curve ([measured.NAME]) whose peak is the target instead: the mean "
            "of the repeats, with two standard deviations as its scatter",
        ),
    ] = ""
    scatter_hz: Annotated[
        float | None,
        Key(
            NUMBER,
            "measured scatter of the target: sets of stations whose frequency "
            "is as near to it fit equally well, and are listed; default: 0, or that "
            "of the measured curve",
            low=0,
        ),
    ] = None
    by: Annotated[
        Literal["station", "area", "cell"],
        Key(
            CHOICE,
            "what is detached: 'station': all pairs at one place of the axis; 'area': the closed "
            "part of every side shrinks by the same share, the contact at its edge keeps a part "
            "of its own area, so that the target is met exactly; 'cell': cells of the closed "
            "part, whole",
        ),
    ] = "station"
    cell_size: Annotated[
        float | None,
        Key(
            NUMBER,
            "edge of the cells of by = 'area' or 'cell', along the axis and "
            "across it; default: every contact point, which stands for the faces "
            "around it",
            "length",
            low=0,
            open_low=True,
        ),
    ] = None
    kept_share: Annotated[
        float | None,
        Key(
            NUMBER,
            "with by = 'area' or 'cell', instead of a target: part of the "
            "closed area that is kept on every side",
            low=0,
            open_low=True,
            high=1,
        ),
    ] = None
    order: Annotated[
        Literal["from_middle", "least_loaded", "from_edge"],
        Key(
            CHOICE,
            "in which stations, area or cells are detached. 'from_middle': from the middle of "
            "the axis (of stations, every number at the front and at the back is tried); "
            "'least_loaded': by the preload map, the least loaded station or the least pressure "
            "first; 'from_edge', the default with 'area' and 'cell': from the edge of the closed "
            "part inwards, at the edge the least pressure first",
        ),
    ] = "from_middle"
    graded: Annotated[
        bool,
        Key(
            FLAG,
            "the last station or cell keeps a part of its area, a factor on its kn and kt, "
            "so that the target is met exactly",
        ),
    ] = False
    stations: Annotated[
        tuple[int, ...] | Literal["all"],
        Key(
            STATIONS,
            "[front, back]: stations kept at each end, or 'all', instead of a target",
            low=0,
            high=9999,
        ),
    ] = ()
    kept: Annotated[
        str,
        Key(
            TEXT,
            "your own table of kept pairs: a copy of kept.csv, edited by hand. Its weight, kn, "
            "kt, mu and preload replace all that is found; pairs without a row are detached",
        ),
    ] = ""
    stiffness: Annotated[
        Literal["kept", "conserved"],
        Key(
            CHOICE,
            "'kept': a node keeps its share of the full patch; 'conserved': the nodes that stay "
            "take over the stiffness of their whole side",
        ),
    ] = "kept"
    follow: Annotated[
        Literal["out_of_phase", "in_phase"], Key(CHOICE, "free mode that is tracked")
    ] = "out_of_phase"
    preload: Annotated[
        Literal["scaled", "resolved", "table"],
        Key(
            CHOICE,
            "'scaled': the whole map's part on the kept stations carries the whole pull; "
            "'resolved': the static problem is solved again on them; 'table': that of the table "
            "`kept`, with which it is the default",
        ),
    ] = "scaled"

    @model_validator(mode="before")
    @classmethod
    def _of_others(cls, given: dict) -> dict:
        given = {"order": "from_edge", **given} if given.get("by") in ("area", "cell") else given
        return {"preload": "table", **given} if "kept" in given else given


class Free(StudySection):
    """[free]: response without damper."""

    band: Annotated[
        Band | None,
        Key(
            BAND,
            "first and last frequency of the response without damper, Hz; default: "
            "around the blades' own out-of-phase and in-phase modes",
            low=0,
            open_low=True,
        ),
    ] = None
    damping_ratio: Annotated[
        Numbers,
        Key(
            RATIOS,
            "zeta of the modes without damper: one value, or one per mode from the lowest",
            low=0,
            high=0.9999,
        ),
    ] = (0.005,)


Orders: TypeAlias = tuple[int, ...] | Literal["auto"]


def named_orders(harmonics: Orders) -> tuple[int, ...]:
    """Values of H that a study names; none with 'auto'."""
    return () if harmonics == "auto" else harmonics


class Respond(StudySection):
    """[respond]: excitation, outputs and settings of the forced response."""

    excitation: Annotated[
        Texts,
        Key(
            ONE_OR_MORE,
            "group of one node where the force acts, or several groups, such as one on each blade; "
            "'node 4711' is a group of that node, here and wherever a group of nodes is named",
        ),
    ] = ("excitation",)
    share_force: Annotated[
        bool,
        Key(
            FLAG,
            "a group of several nodes shares its force equally; otherwise such a group is refused",
        ),
    ] = False
    amplitudes: Annotated[
        Numbers,
        Key(
            NUMBERS,
            "force on each group for Fe = 1, in the order of `excitation`; default: 1 each",
            low=0,
        ),
    ] = ()
    phase: Annotated[
        Numbers | Literal["in_phase", "out_of_phase"],
        Key(
            PHASE,
            "of the force on the second group against the first, 'in_phase' (0) or "
            "'out_of_phase' (180 degrees), or the angles in degrees by which the force on each "
            "further group leads the first",
            low=-360,
            high=360,
        ),
    ] = "in_phase"
    engine_order: Annotated[
        int | None,
        Key(
            COUNT,
            "instead of a phase: order of the excitation that the two blades "
            "pass; the second leads by 360 engine_order / blade_count degrees",
            low=0,
            high=1000,
        ),
    ] = None
    blade_count: Annotated[
        int | None, Key(COUNT, "blades of the whole wheel, with engine_order", low=2, high=1000)
    ] = None
    direction: Annotated[Vector, Key(VECTOR, "direction of the excitation and of the response")] = (
        1.0,
        0.0,
        0.0,
    )
    patches: Annotated[
        Texts,
        Key(
            TEXTS,
            "groups of response nodes, blade 1 first; the peaks of the largest and of the "
            "smallest node of each are solved",
        ),
    ] = ("patch_1", "patch_2")
    levels: Annotated[
        Numbers,
        Key(
            NUMBERS,
            "Fe, amplitudes of the excitation; with band and damping_ratio what the curves need: "
            "without the three [respond] says to reduce and tune where the blades move",
            "force",
            low=0,
            open_low=True,
        ),
    ] = ()
    harmonics: Annotated[
        Orders,
        Key(
            COUNTS_OR_AUTO,
            "H, highest order kept; several give several curves; 'auto': of each level as many as "
            "it needs, up to 45, for the estimated error of 99 % of the points to be within "
            "the tolerance, relative to the vibration of each point",
            low=1,
            high=99,
        ),
    ] = "auto"
    tolerance: Annotated[
        float,
        Key(
            NUMBER,
            "error by the harmonics above H that is accepted, relative to the vibration: harmonics "
            "= 'auto' meets it, with a number of harmonics a peak that misses it is warned of",
            low=0,
            open_low=True,
            high=0.1,  # a larger one is none that an estimate knows
        ),
    ] = 1e-3
    band: Annotated[Band, Key(BAND, "first and last frequency in Hz", low=0, open_low=True)] = NONE
    samples: Annotated[
        int | None,
        Key(
            COUNT,
            "instants of a period at which the contact law is evaluated; default: "
            "those of the law. The laws of this program do not depend on it, laws of your "
            "own that are sampled are as accurate as that",
            low=8,
            high=65536,
        ),
    ] = None
    damping_ratio: Annotated[
        Numbers,
        Key(
            RATIOS,
            "zeta of the modes with every kept pair stuck, also one that the preload leaves open: "
            "one value, or one per mode from the lowest (the last one holds for all above)",
            low=0,
            high=0.9999,
        ),
    ] = ()
    interface: Annotated[
        Literal["auto", "whole", "reduced"],
        Key(
            CHOICE,
            "dofs of the response: 'whole': all of the reduced model; 'reduced': the shapes that "
            "the forces excite with every pair stuck, and the static shapes of the pairs that "
            "are followed; 'auto': 'reduced' from 201 pairs on",
        ),
    ] = "auto"
    followed: Annotated[
        int,
        Key(
            COUNT,
            "pairs that are followed with interface = 'reduced', those nearest to slip: "
            "what slips or lifts off should be among them",
            low=1,
            high=5000,
        ),
    ] = 64
    stability: Annotated[
        Literal["none", "peaks", "all"],
        Key(
            CHOICE,
            "points of which is found whether a disturbance dies out or grows (Floquet "
            "multipliers); with 'all' the report dashes unstable parts of a curve and marks where "
            "it folds or stability changes, summary.json names these and where pairs begin to slip "
            "or lift off, and a curve of many pairs takes a few times as long",
        ),
    ] = "peaks"
    derivatives: Annotated[
        bool,
        Key(
            FLAG,
            "find how the peak on the first patch changes with kn, kt, mu and preload of each "
            "pair, with the damping and the level; the report draws it for the curves of the "
            "largest H; it takes about as long as the curve",
        ),
    ] = False
    both_ways: Annotated[
        bool,
        Key(
            FLAG,
            "follow a curve from the other end too, and compare the peaks, where its solution "
            "there is not found again by itself or the curve is not one whole branch",
        ),
    ] = True
    search: Annotated[
        float,
        Key(
            NUMBER,
            "effort to look for solutions that no curve holds, such as detached resonances, as a "
            "share of that of all curves, and 2000 evaluations of small models in any case; at up "
            "to 12 frequencies one branch over the level of the force serves those of the largest "
            "H of all levels, and what is left goes to random starts; what is found is followed on "
            "top of it; 0 does not look",
            low=0,
            high=1e4,
        ),
    ] = 0.3
    compare: Annotated[
        bool,
        Key(
            FLAG,
            "compare the highest point of each curve of the largest H with time integration from "
            "there: how far it is off, and whether it is stable; it takes from seconds to minutes "
            "a level",
        ),
    ] = False
    animate: Annotated[
        bool,
        Key(
            FLAG,
            "write the period at the peak of blade 1, for the curves of the largest H, as a series "
            "for ParaView: motion_*.pvd, with stick, slip and gap of the contacts as 'state'",
        ),
    ] = False
    stress: Annotated[
        bool,
        Key(
            FLAG,
            "write mean and alternating stress of blades and damper at the peak of blade 1, "
            "for the curves of the largest H: vibration_*.vtu and a table of the largest places; "
            "both are assembled again for it, and `reduce` keeps their modes (inner_modes.npz)",
        ),
    ] = False
    law: Annotated[
        LawChoice,
        Key(
            LAW,
            'contact law by name, or { name = "...", parameter = value } with parameters '
            "in SI units; kn, kt, mu and preload come from the pairs. Of your own: "
            '"dahl.py:Dahl", the file beside the study, which runs with --allow-code only',
        ),
        Field(json_schema_extra={"default": DEFAULT}),
    ] = LawChoice()


class Measured(StudySection):
    """[measured.NAME]: a measured response curve, set beside the computed ones."""

    files: Annotated[
        Texts,
        Key(
            ONE_OR_MORE,
            "measured file, or one for each repeat: universal (.unv, .uff, dataset "
            "58), text (.csv, .txt, .dat) or MATLAB (.mat)",
        ),
    ]
    columns: Annotated[
        Texts,
        Key(
            COLUMNS,
            "what the columns of a text file or the variables of a MATLAB file hold, each as "
            "'meaning' (by position) or 'meaning:name' (column of that name in the header, or "
            "variable): frequency_hz or frequency_rad_s; amplitude, with phase_deg or phase_rad "
            "where known, or real and imaginary, or complex (MATLAB); force where it was "
            "measured; '-' for a column that is not used",
        ),
    ] = ()
    quantity: Annotated[
        Literal["from_file", "receptance", "mobility", "accelerance"],
        Key(
            CHOICE,
            "displacement, velocity or acceleration per force; universal files say it themselves",
        ),
    ] = "from_file"
    unit: Annotated[
        str,
        Key(
            TEXT,
            "of the measured motion: m, mm, um, m/s, mm/s, m/s2, mm/s2 or g, with /N where it "
            "is per newton; universal files: default SI, or the units of their dataset 164",
        ),
    ] = ""
    records: Annotated[
        tuple[int, ...],
        Key(
            COUNTS,
            "which datasets 58 of a universal file, counted from 1; default: all, as repeats",
            low=1,
            high=100000,
        ),
    ] = ()
    level: Annotated[
        float | None,
        Key(
            NUMBER,
            "amplitude of the force, N, needed where no column holds it; the curve "
            "is set beside the computed one of this level",
            low=0,
            open_low=True,
        ),
    ] = None
    response: Annotated[
        str,
        Key(
            TEXT,
            "where it was measured: a group of [respond] patches, of which the largest "
            "amplitude counts, or one node of it as 'group:node'; default: the first group",
        ),
    ] = ""
    amplitude: Annotated[
        Literal["fundamental", "half_peak_to_peak"],
        Key(
            CHOICE,
            "of the computed motion that is compared: its part at the frequency of excitation, "
            "or half of peak-to-peak",
        ),
    ] = "fundamental"
    scatter: Annotated[
        float,
        Key(
            NUMBER,
            "half width of the measured band relative to the mean, at least; two "
            "standard deviations of the repeats where these are wider",
            low=0,
            high=1,
        ),
    ] = 0.05


class Fit(StudySection):
    """[fit]: damping, and on demand friction and stiffness, fitted to the measured curves with the
    contacts in the model."""

    curves: Annotated[
        Texts, Key(ONE_OR_MORE, "names of [measured.NAME] that count; default: all")
    ] = ()
    modes: Annotated[
        tuple[int, ...],
        Key(
            COUNTS,
            "modes of the stuck system, 1 the lowest, whose damping ratios are unknown; default: "
            "the values of [respond] damping_ratio, from which all start",
            low=1,
            high=100000,
        ),
    ] = ()
    mu: Annotated[bool, Key(FLAG, "whether a factor on mu of all pairs is unknown, too")] = False
    stiffness: Annotated[
        bool, Key(FLAG, "whether a factor on kn and kt of all pairs is unknown, too")
    ] = False
    scatter: Annotated[
        bool,
        Key(
            FLAG,
            "whether each measured curve has a factor of its own on its amplitudes and, where the "
            "stiffness is known, on its frequencies, as from one mounting to the next",
        ),
    ] = True
    band: Annotated[
        Band | None,
        Key(
            BAND,
            "of the measured points that count, in Hz; default: [respond] band",
            low=0,
            open_low=True,
        ),
    ] = None


class BackboneSection(StudySection):
    """[backbone]: a nonlinear mode of the kept pairs over its amplitude, beside forced peaks."""

    mode: Annotated[
        int | None,
        Key(
            COUNT,
            "number of the mode with every kept pair stuck, 1 the lowest; default: the tracked one "
            "of [tune]",
            low=1,
            high=100000,
        ),
    ] = None
    near_hz: Annotated[
        float | None,
        Key(
            NUMBER,
            "instead of a number: the mode whose frequency with every kept pair stuck is nearest "
            "to this one",
            low=0,
            open_low=True,
        ),
    ] = None
    amplitudes: Annotated[
        Numbers,
        Key(
            NUMBERS,
            "first and last amplitude, and any between them that are to be solved, of the node of "
            "`response` that moves most in the stuck mode, in its part at the frequency of the "
            "mode; default: from a tenth of the smallest peak of the curves, or lower where there "
            "is no free motion, to 1.1 times the largest",
            "length",
            low=0,
            open_low=True,
        ),
    ] = ()
    response: Annotated[
        str,
        Key(TEXT, "group of [respond] patches whose motion is shown; default: the first group"),
    ] = ""
    harmonics: Annotated[
        int | None,
        Key(
            COUNT,
            "H, highest order kept; default: the largest that [respond] names, 5 where it names "
            "none",
            low=1,
            high=99,
        ),
    ] = None


class Sweep(StudySection):
    """[sweep]: the cases of `tipdamp sweep`, the product of all lists with the rows of a table or
    the samples."""

    over: Annotated[
        tuple[SweptKey, ...],
        Key(
            AXES,
            "keys of this study by their dotted names and the values that each takes, in the units "
            "of the file: a list, or { start = ..., stop = ..., count = ... } with spacing = "
            '"lin" or "log"; in a key that takes a list, a single value is a list of one',
        ),
        Field(json_schema_extra={"default": {}}),
    ] = ()
    cases: Annotated[
        str,
        Key(
            TEXT,
            "CSV of cases: dotted keys in the first line, one case a line, values as in a study "
            "(texts without quotes); an empty cell leaves the key as it is",
        ),
    ] = ""
    sample: Annotated[
        tuple[SampledKey, ...],
        Key(
            INTERVALS,
            "keys that are sampled by a Latin hypercube: { start = ..., stop = ... } each, with "
            'spacing = "lin" or "log"',
        ),
        Field(json_schema_extra={"default": {}}),
    ] = ()
    samples: Annotated[int, Key(COUNT, "number of samples", low=0, high=1_000_000)] = 0
    seed: Annotated[int, Key(COUNT, "of the samples: the same gives the same", low=0)] = 0


class CompareSection(StudySection):
    """[compare]: what `tipdamp compare` sets beside this study."""

    studies: Annotated[
        Texts, Key(ONE_OR_MORE, "study files, relative to this one, that are set beside it")
    ]
    out: Annotated[
        str,
        Key(
            TEXT,
            "folder of the page, relative to the study; default: results/comparison, of one study "
            "alone results/comparison_NAME",
        ),
    ] = ""


SECTIONS: dict[str, type[StudySection]] = {
    "material": MaterialSection,
    "blades": Blades,
    "damper": Damper,
    "model": Model,
    "contact": ContactSection,
    "rotation": RotationSection,
    "preload": PreloadSection,
    "tune": Tune,
    "free": Free,
    "respond": Respond,
    "fit": Fit,
    "backbone": BackboneSection,
    "sweep": Sweep,
    "compare": CompareSection,
}

# sections of tables with names of their own: what each table holds
NAMED: dict[str, type[StudySection]] = {
    "material": OtherMaterial,
    "contact": SideSection,
    "loads": LoadCase,
    "measured": Measured,
}
