"""What the stages up to the tuning found: bodies, reduction, preload, kept stations."""

from typing import Annotated, ClassVar, Generic, TypeVar

from pydantic import BeforeValidator

from tipdamp.engine.store import plain
from tipdamp.results.record import Number, Numbers, Record, Result, Texts
from tipdamp.static_contact.tuning.area_detachment import AreaStep
from tipdamp.static_contact.tuning.station_detachment import GradedStation

T = TypeVar("T")


# ---- inspect -------------------------------------------------------------------------------------


class InspectedBody(Record):
    """A body as read. Given matrices have `dofs` alone; masses and rigid modes are known once the
    matrices are, or are told by the mesh. mass_kg - of the whole mesh; moving_mass_kg - of a unit
    translation along x, y, z of all but the fixed nodes; pieces - that share no node; first_hz -
    bounds of the first natural frequency of a solid of this size (blades)."""

    dofs: int | None = None
    file: str | None = None
    format: str | None = None
    nodes: int | None = None
    pieces: int | None = None
    cells: dict[str, int] = {}
    free_dofs: int | None = None
    mass_kg: Number = None
    moving_mass_kg: Numbers | None = None
    box_m: Annotated[tuple[Numbers, ...], BeforeValidator(plain)] = ()
    rigid_modes: int | None = None
    groups: dict[str, int] = {}
    groups_are: dict[str, str] = {}
    cell_groups: dict[str, int] = {}
    not_read: Texts = ()
    first_hz: tuple[float, float] | None = None


class SideCheck(Record):
    """Geometry of the pairs of one side; length_m, across_m - extent along t1 and t2;
    force_per_pull - N on the side for 1 N of pull without friction, None with the reason in
    `trouble`; area_m2 of contact between surfaces, of the faces_m2 that the damper has there, None
    where nodes match; kn_N_per_m - the sum over its pairs, where the user's own table gives it."""

    pairs: int
    stations: int
    rows: int
    length_m: float
    across_m: float
    mean_normal: Numbers
    normals_within_deg: float
    off_surface_deg: Number
    apart_along_n_m: Numbers
    apart_across_m: float
    force_per_pull: Number
    trouble: str | None
    area_m2: float | None = None
    faces_m2: float | None = None
    kn_N_per_m: float | None = None


class InspectResult(Result):
    """inspect.json. pairs {side: number}; columns {body: master dofs and contact shapes}; tractions
    {body: cells} as in Reduction; side_moduli {side: E, nu of the blade, E, nu of the damper};
    only_friction - rigid
    motions of the damper that nothing but friction holds."""

    file: ClassVar[str] = "inspect.json"
    bodies: dict[str, InspectedBody]
    pairs: dict[str, int] = {}
    side_moduli: dict[str, tuple[float, float, float, float]] = {}
    columns: dict[str, int] = {}
    tractions: dict[str, int] = {}
    pair_checks: dict[str, SideCheck] = {}
    only_friction: Texts = ()
    pictures: Texts = ()


# ---- reduce --------------------------------------------------------------------------------------


class ReductionFacts(Record):
    """Size of the reduction; modes {body: fixed-interface modes}, load_modes {body: static shapes
    of loads}, contact_shapes {body: static shapes of forces on contact points}, tractions {body:
    cells over which these forces are spread}, empty where they act on every point."""

    dofs: int
    masters: int
    modes: dict[str, int]
    load_modes: dict[str, int] = {}
    contact_shapes: dict[str, int] = {}
    tractions: dict[str, int] = {}

    @property
    def in_words(self) -> str:
        """'105 contact and response dofs and 60 modes', '15 dofs of nodes, 420 contact shapes and
        60 modes', '15 dofs of nodes, 1200 contact shapes of tractions on 400 cells and 60
        modes'."""
        shapes = sum(self.contact_shapes.values())
        modes = f"{sum(self.modes.values())} modes"
        cells = f" of tractions on {sum(self.tractions.values())} cells" if self.tractions else ""
        return (
            f"{self.masters} dofs of nodes, {shapes} contact shapes{cells} and {modes}"
            if shapes
            else f"{self.masters} contact and response dofs and {modes}"
        )


class FreeResponse(Record):
    """Linear response without damper: largest amplitude over each patch per newton, m_per_N {patch:
    values at hz}."""

    hz: Numbers
    m_per_N: dict[str, Numbers]


class ReduceResult(Result):
    """reduce.json. rows {side: rows of the patch}; side_materials {side: E, nu, E, nu} where a
    model needs them; free_hz {'out_of_phase', 'in_phase'}, empty where no mode involves both
    blades."""

    file: ClassVar[str] = "reduce.json"
    reduction: ReductionFacts
    rows: dict[str, int]
    highest_fixed_interface_hz: dict[str, float] = {}
    side_materials: dict[str, tuple[float, float, float, float]] = {}
    pull_positions_m: Numbers = ()
    free_hz: dict[str, float] = {}
    free_modes_hz: Numbers
    free_response: FreeResponse | None = None
    pictures: Texts = ()


# ---- preload -------------------------------------------------------------------------------------


class SideLoad(Record):
    """Contact forces of one side: sum over its closed pairs, the largest, number of open pairs."""

    sum_N: float
    max_N: float
    detached: int


class SideForces(SideLoad):
    """Preload of one side beside the sum that equilibrium asks for; min_N - smallest of its closed
    pairs; balance_error - unbalanced part of the load on the damper."""

    min_N: float
    equilibrium_N: float
    balance_error: Number


class StiffnessWay(Record):
    """kn and kt per node (mean) by one way of giving them; in_use - with which the study
    computes."""

    way: str
    kn_N_per_m: float
    kt_N_per_m: float
    in_use: bool = False


class SideStiffness(Record):
    """Nodal stiffness of one side and what it was made from; None where it does not apply. ways -
    the one in use beside those that lead to it, and the reference of the study."""

    model: str
    ways: tuple[StiffnessWay, ...] = ()
    kn_N_per_m: float
    kt_N_per_m: float
    kt_along_N_per_m: float
    kt_across_N_per_m: float
    nodes: int
    load_N: float
    length_m: float
    kind: str | None
    half_width_m: float | None
    depth_m: tuple[float, float] | None
    h_rms_m: float | None
    gamma: float | None
    scale: float
    shares: str
    E_star_Pa: float | None


class FrictionFacts(Record):
    """State with friction at the end of the history; without_friction_N {side: N} of the
    frictionless equilibrium."""

    slipping_pairs: int
    closed_pairs: int
    largest_T_N: float
    residual: float
    without_friction_N: dict[str, float] = {}


class FreeMotion(Record):
    """Rigid motion of the damper that no contact resists, and the load along it."""

    name: str
    unit: str
    load: float


class LoadCasePreload(Record):
    """Preload of a further load case; reactions {motion: N, rolls N m} taken up in the reference
    state; held {motion: force on what holds it}."""

    file: str
    sides: dict[str, SideLoad]
    residual: float
    balance_error: Number
    reactions: dict[str, float] = {}
    held: dict[str, float] = {}


class PreloadResult(Result):
    """preload.json. kn_kt_N_per_m {side: mean kn, mean kt}; stiffness {side: ...}, empty with a
    user-supplied pair table; friction - None without; reactions {motion: amount} of the constraints
    that stand in for missing contact; held {motion: force on what holds it}; slide_m {round side:
    of the damper along its flank, along t2}; gap_at_rest_m - of each pair at the position reached,
    empty where no side is round."""

    file: ClassVar[str] = "preload.json"
    sides: dict[str, SideForces]
    slide_m: dict[str, float] = {}
    gap_at_rest_m: Numbers = ()
    residual: float
    iterations: int
    method: str
    kn_kt_N_per_m: dict[str, tuple[float, float]]
    stiffness: dict[str, SideStiffness] = {}
    friction: FrictionFacts | None = None
    free_motions: tuple[FreeMotion, ...] = ()
    reactions: dict[str, float] = {}
    held: dict[str, float] = {}
    cases: dict[str, LoadCasePreload] = {}


# ---- preload on the full model -------------------------------------------------------------------


class FullSide(Record):
    """Sums of one side on the full model and condensed, open pairs, and the largest difference of a
    pair."""

    sum_N: float
    condensed_N: float
    open: int
    largest_difference_N: float


class FullResult(Result):
    """full.json. of - fingerprint of the preload.csv that it was compared with; difference -
    largest of a pair, of the largest force; residual - of the load; reactions as in
    PreloadResult."""

    file: ClassVar[str] = "full.json"
    of: str
    ranks: int
    dofs: int
    iterations: int
    residual: float
    difference: float
    sides: dict[str, FullSide]
    reactions: dict[str, float] = {}


# ---- tune ----------------------------------------------------------------------------------------


class OfSets(Record, Generic[T]):
    """A value for each set of stuck pairs: the whole patch, the whole line, the kept stations."""

    full_area: T
    full_line: T
    tuned: T


class Stations(Record):
    """Stations kept at each end; front counts those with the smaller coordinate."""

    front: int
    back: int


class TuneStep(Stations):
    """One set of stations that was tried; mac - energy-weighted MAC of the tracked mode with the
    free one."""

    hz: float
    mac: float


class PlacedWorth(Record):
    """The worth of a station as in StationWorth; position_m along the axis."""

    station: int
    kept: bool
    hz: float
    position_m: float


class KeptSide(Record):
    """What is kept of the closed part of a side, in mm2, or in mm where the side is a line; cells -
    those of the closed part, and of them those that are kept at least in part."""

    unit: str
    closed: float
    kept: float
    cells: int
    kept_cells: int


class KeptMirror(Record):
    """A plane about which contact and preload map are symmetric, so that mirrored parts leave
    together; noise - of the map: sum of the differences of mirrored places over the sum of the
    forces."""

    normal: Numbers
    noise: float


class KeptArea(Record):
    """Tuning by area or by cell: the share kept on every side; hz_per_percent - what a percent of
    it is worth."""

    share: float
    hz_per_percent: float
    sides: dict[str, KeptSide]
    history: tuple[AreaStep, ...]
    mirrors: tuple[KeptMirror, ...] = ()


class TrackedMode(Record):
    """A stuck mode, found by a free one; mac - their energy-weighted MAC."""

    hz: float
    mac: float


class FullModelCheck(Record):
    """Stuck frequencies of the reduced and of the full model; error_bound - relative, from the
    reduction alone."""

    reduced_hz: Numbers
    full_hz: Numbers
    largest_error: float
    error_bound: Annotated[tuple[float | None, ...], BeforeValidator(plain)] = ()


class KeptCase(Record):
    """Contact forces of a load case on the kept pairs, or why there is no equilibrium
    (`refused`)."""

    sides: dict[str, SideLoad] = {}
    reactions: dict[str, float] = {}
    residual: float | None = None
    refused: str | None = None


class RedistributionFacts(Record):
    """How the preload came onto the kept stations. Scaled: factor of each side and the moment left
    about the axis of the damper, and about x, y, z; moment_share - of the load times the length of
    the contact, that which no hold takes; where it is more than 1 % `resolved` - the same pairs
    with their static contact solved again. Solved again: constraint reactions and residual, with
    friction its figures."""

    scale: dict[str, float] = {}
    moment_Nm: float | None = None
    moments_Nm: Numbers | None = None
    moment_share: float | None = None
    resolved: KeptCase | None = None
    reactions: dict[str, float] = {}
    residual: float | None = None
    friction: FrictionFacts | None = None


class TuneResult(Result):
    """tune.json. full_model_check {set: ...}, empty where matrices were given; target_hz - None for
    given stations; table - the user's own table of kept pairs, if that is what is kept.
    closed_pairs, open_pairs - of each set, those that stick and those that are open at rest, which
    do not; equivalent - sets within the scatter of the target; passed_over - sets nearer to the
    target that leave too large a moment."""

    file: ClassVar[str] = "tune.json"
    target_hz: float | None
    scatter_hz: float = 0.0
    table: str | None = None
    tuned_pairs: Stations
    kept_stations: tuple[int, ...] = ()
    graded: GradedStation | None = None
    equivalent: tuple[TuneStep, ...] = ()
    passed_over: tuple[TuneStep, ...] = ()
    station_worth: tuple[PlacedWorth, ...] = ()
    area: KeptArea | None = None
    closed_pairs: OfSets[int]
    open_pairs: OfSets[int]
    history: tuple[TuneStep, ...]
    stuck_hz: OfSets[float]
    mac: OfSets[float]
    other_modes: dict[str, TrackedMode] = {}
    stuck_modes_hz: OfSets[Numbers]
    full_model_check: dict[str, FullModelCheck] = {}
    preload_kept: dict[str, SideForces]
    redistribution: RedistributionFacts
    roll_stiffness_Nm_per_rad: float
    cases: dict[str, KeptCase] = {}

    @property
    def kept_pairs(self) -> int:
        """Number of those that carry after tuning, open at rest or not."""
        return self.closed_pairs.tuned + self.open_pairs.tuned

    @property
    def line_is_whole(self) -> bool:
        """Whether the line model keeps all rows of the patch, so that there is no word to say of
        it."""
        closed, opened = self.closed_pairs, self.open_pairs
        return closed.full_area + opened.full_area == closed.full_line + opened.full_line

    @property
    def kept_name(self) -> str:
        """'kept area' or 'kept stations'."""
        return "kept area" if self.area is not None else "kept stations"

    @property
    def kept_in_words(self) -> str:
        """'5 + 4 stations (station 4 with 20.0% of its area)', '62 % of the closed area (103 of 166
        mm2 on 'left')'."""
        if self.area is not None:
            sides = ", ".join(
                f"{side.kept:.4g} of {side.closed:.4g} {side.unit} on '{name}'"
                for name, side in self.area.sides.items()
            )
            return f"{100 * self.area.share:.3g} % of the closed area ({sides})"
        part = (
            f" (station {self.graded.station} with {self.graded.part:.1%} of its area)"
            if self.graded
            else ""
        )
        return f"{self.tuned_pairs.front} + {self.tuned_pairs.back} stations{part}"
