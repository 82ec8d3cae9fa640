"""The sizes that costs follow from, of a study and of what `inspect` found."""

from dataclasses import dataclass, field, replace

from tipdamp.bodies import BLADES
from tipdamp.bodies.interface import is_reduced
from tipdamp.checks import law_cost
from tipdamp.results.static_results import InspectResult
from tipdamp.study.schema import named_orders
from tipdamp.study.view import Study


@dataclass(frozen=True)
class SizeSettings:
    """What is taken where a study does not say."""

    kept: float = 0.3  # of the pairs, where they are detached to a frequency: 9 of 31 [Zucca 2016]
    # of the kept pairs, or of those that are followed: levels are chosen for them to slip
    slipping: float = 0.8
    # H of harmonics = "auto" [the two-blade rig: 3, and 7 to 19]
    tried: tuple[int, ...] = (3, 15)
    many: int = 900  # masters and contact shapes of which fewer are advised


SETTINGS = SizeSettings()


@dataclass(frozen=True)
class Size:
    """bodies {name: (dofs, columns, modes)}, columns - master dofs and contact shapes; pairs;
    curves - H of each, level by level; auto - whether these are tried until a tolerance is met;
    followed - pairs that a reduced interface follows, which most often hold those that slip, 0
    where it is none; jobs - curves that are made side by side; kept - share of pairs that stay;
    cycles {H: s} - of an evaluation of a law by file at the pairs that stay, none of shipped ones;
    acting - pairs that slip or lift at each level, empty where that is not known; outputs - nodes
    of the patches; search, stability - as in [respond]; unreduced - whether the preload is solved
    on all dofs; sets - of stations of which `tune` seeks the frequency; fewer - what makes of many
    columns fewer; stressed - levels at whose peak the stress is sought."""

    bodies: dict[str, tuple[int, int, int]]
    pairs: int
    curves: tuple[int, ...]
    followed: int = 0
    kept: float = 1.0
    unreduced: bool = False
    sets: int = 0
    fewer: str = "coarsen the meshes"
    jobs: int = 1
    cycles: dict[int, float] = field(default_factory=dict)
    acting: tuple[int, ...] = ()
    auto: bool = False
    outputs: int = 2
    search: float = 0.0
    stability: str = "peaks"
    stressed: int = 0

    @property
    def dofs(self) -> int:
        """Of the whole bodies."""
        return sum(dofs for dofs, _, _ in self.bodies.values())

    @property
    def reduced(self) -> int:
        """Dofs of the reduced model."""
        return sum(columns + modes for _, columns, modes in self.bodies.values())

    @property
    def kept_pairs(self) -> int:
        """Of all, at least one."""
        return max(round(self.kept * self.pairs), 1)

    @property
    def slipping(self) -> tuple[int, ...]:
        """Pairs that slip or lift at each level, one number where that is not known."""
        likely = SETTINGS.slipping * min(self.followed or self.kept_pairs, self.kept_pairs)
        return self.acting or (max(round(likely), 1),)


def size_of(study: Study, found: InspectResult, jobs: int = 1, kept: int | None = None) -> Size:
    """From what `inspect` found; jobs - curves side by side; kept - pairs, None before `tune`."""
    modes = {} if "model" in study else {"blades": study.blades.modes, "damper": study.damper.modes}
    bodies = {
        name: (b.free_dofs or b.dofs or 0, found.columns.get(name, 0), modes.get(name, b.dofs or 0))
        for name, b in found.bodies.items()
    }
    pairs = sum(found.pairs.values())
    size = Size(
        bodies,
        pairs,
        (),
        kept=_kept(study, found) if kept is None or not pairs else kept / pairs,
        unreduced=study.preload.bodies == "full" or bool(found.tractions),
        sets=_sets(study, found) if _detached(study) else 0,
        fewer=_fewer(study, found, pairs),
        jobs=jobs,
    )
    return _with_curves(size, study, found) if "respond" in study else size


def _with_curves(size: Size, study: Study, found: InspectResult) -> Size:
    settings = study.respond
    named = named_orders(settings.harmonics)
    groups = found.bodies[BLADES].groups if BLADES in found.bodies else {}
    return replace(
        size,
        curves=(named or SETTINGS.tried) * len(settings.levels),
        auto=not named,
        followed=settings.followed if settings.levels and is_reduced(study, size.pairs) else 0,
        cycles=law_cost.cycles(settings, size.kept_pairs, named or SETTINGS.tried),
        outputs=sum(groups.get(patch, 1) for patch in settings.patches),
        search=settings.search,
        stability=settings.stability,
        stressed=len(settings.levels) if settings.stress else 0,
    )


def _detached(study: Study) -> bool:
    return "tune" in study and bool(study.tune.target_hz or study.tune.target_from)


def _kept(study: Study, found: InspectResult) -> float:
    """Share of the pairs that stays: of the rows of each side, and of its stations or its area."""
    stay = 0.0
    for name, pairs in found.pairs.items():
        check = found.pair_checks.get(name)
        one_row = name in study.sides and study.sides[name].rows == "edge"
        rows = check.rows if check and one_row else 1
        stay += pairs / rows * _along(study, check.stations if check else 0)
    return stay / max(sum(found.pairs.values()), 1)


def _along(study: Study, stations: int) -> float:
    """Share of the stations of a side that stays, or of its area."""
    if _detached(study):
        return SETTINGS.kept
    if "tune" not in study:
        return 1.0
    if study.tune.kept_share:
        return study.tune.kept_share
    named = study.tune.stations
    return min(sum(named) / stations, 1.0) if stations and named and named != "all" else 1.0


def _sets(study: Study, found: InspectResult) -> int:
    """Numbers of stations at the front and at the back that are tried for a target."""
    every = study.tune.by == "station" and study.tune.order == "from_middle"
    return (
        max((check.stations for check in found.pair_checks.values()), default=0) ** 2 // 2
        if every
        else 0
    )


def _fewer(study: Study, found: InspectResult, pairs: int) -> str:
    """What makes of many master dofs and contact shapes fewer."""
    columns = sum(found.columns.values())
    if columns <= SETTINGS.many:
        return "coarsen the meshes"
    if found.tractions:
        cells = max(found.tractions.values())
        return f"lower [contact] tractions, {cells} cells a body now, or coarsen the meshes"
    nodes = (
        study.contact.reduction == "craig_bampton"
        and columns > 3 * pairs
        and any(check.area_m2 is None for check in found.pair_checks.values())
    )
    points = 'reduction = "contact_points" and ' * nodes
    return (
        f"{pairs} pairs make {columns} masters and contact shapes: [contact] {points}tractions = "
        "200 makes them shapes of so many cells a body, or coarsen the contact"
    )
