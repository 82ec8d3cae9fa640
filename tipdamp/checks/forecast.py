"""What the stages will cost, before anything heavy: estimated from the sizes that `inspect` found
and from the speed of this machine, measured on a small body in the same run. Right to a factor of
about three; refused is memory alone."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from tipdamp.bodies.interface import is_reduced
from tipdamp.engine.progress import duration
from tipdamp.hbm.balance.factors import flops
from tipdamp.hbm.memory import available_bytes, curve_bytes
from tipdamp.modal.memory import predicted_bytes
from tipdamp.results.static_results import InspectResult
from tipdamp.study.schema import Respond, named_orders
from tipdamp.study.view import Study


@dataclass(frozen=True)
class Machine:
    """factor, solve - s for the factor of a solid of `dofs` dofs and for one right-hand side; flops
    - dense, per s."""

    factor: float
    solve: float
    flops: float
    dofs: int = 10125


@dataclass(frozen=True)
class ForecastSettings:
    """How costs grow, and what a curve is taken to be."""

    # of the factor's time with the dofs, hexahedra and tetrahedra [benchmarks/growth]
    factor_growth: float = 1.65
    # of a right-hand side's, as its entries: nested dissection in three dimensions
    solve_growth: float = 4 / 3
    factors: int = 3  # of a body: for its masters, for its modes, and their count
    solves_a_mode: int = 4  # of the Lanczos process
    dense: int = 6  # products of dofs x masters with masters in a reduction
    eigen: float = 25.0  # flops of the modes of r dofs over r^3
    # of a curve, one way, and more for each pair that slips [18 of the two-blade rig: 50 points,
    # 64 of a wedge under platforms: 350, 62 of unlike tetrahedra: 90]
    points: int = 30
    points_a_pair: int = 3
    steps: int = 4  # of Newton's method a point
    contact: float = 8e-6  # s a pair and step for its force of one harmonic
    # of a law by its step alone: s an instant, and s an instant and pair more [Dahl, creeping]
    instant: float = 1e-4
    instant_and_pair: float = 3e-6
    instants: int = 256  # of a period, where the study does not say
    # of the stress at the peak of one level: s a dof for the largest range between two instants of
    # a period [rig of 70 mm, 54 498 dofs, H = 3: 5.5]
    stress: float = 1e-4
    slipping: float = 0.25  # of the pairs; all of them is the upper bound
    kept: float = 0.3  # of the pairs, where they are detached to a frequency: 9 of 31 [Zucca 2016]
    tried: tuple[int, ...] = (3, 8, 11)  # H of harmonics = "auto" [the two-blade rig]
    short: float = 60.0  # s below which nothing is measured and nothing said
    slow: float = 600.0  # s above which a stage is warned of
    many: int = 900  # masters and contact shapes of which fewer are advised
    # of the factors of both bodies: a preload on them [460 points 10 s, 2718: 70 s]
    unreduced: int = 2
    # of the factor of both together: their stuck modes, which `tune` compares [twin rig: 3.3]
    checked: int = 3


SETTINGS = ForecastSettings()
# one core of an office machine with a tuned BLAS
COMMON = Machine(factor=0.25, solve=2.5e-3, flops=1e10)


@dataclass(frozen=True)
class Size:
    """bodies {name: (dofs, columns, modes)}, columns - master dofs and contact shapes; pairs;
    curves - H of each, each way counted; followed - pairs that a reduced interface follows, which
    most often hold those that slip, 0 where it is none; jobs - curves that are made side by side;
    kept - share of pairs that stay
    instants - of a period at which a law by its step alone is evaluated, 0 of compiled ones
    acting - pairs that slip or lift at each level, empty where that is not known
    unreduced - whether the preload is solved on all dofs; sets - of stations of which `tune` seeks
    the frequency fewer - what makes of many columns fewer
    stressed - levels at whose peak the stress is sought"""

    bodies: dict[str, tuple[int, int, int]]
    pairs: int
    curves: tuple[int, ...]
    followed: int = 0
    kept: float = 1.0
    unreduced: bool = False
    sets: int = 0
    fewer: str = "coarsen the meshes"
    jobs: int = 1
    instants: int = 0
    acting: tuple[int, ...] = ()
    stressed: int = 0

    @property
    def dofs(self) -> int:
        """Of the whole bodies."""
        return sum(dofs for dofs, _, _ in self.bodies.values())

    @property
    def reduced(self) -> int:
        """Dofs of the reduced model."""
        return sum(columns + modes for _, columns, modes in self.bodies.values())


@dataclass(frozen=True)
class Cost:
    """seconds, bytes - estimated; at_most, bytes_at_most - where every pair slips."""

    seconds: float
    bytes: float
    at_most: float = 0.0
    bytes_at_most: float = 0.0

    @property
    def text(self) -> str:
        """In a few words."""
        bound = []
        if self.at_most > 2 * self.seconds:
            bound.append(duration(self.at_most))
        if self.bytes_at_most > 2 * max(self.bytes, 5e7):
            bound.append(f"{self.bytes_at_most / 1e9:.1f} GB")
        slip = f" (should all pairs slip: {', '.join(bound)})" if bound else ""
        return f"about {duration(self.seconds)}, {self.bytes / 1e9:.1f} GB{slip}"


def size_of(study: Study, found: InspectResult, jobs: int = 1, kept: int | None = None) -> Size:
    """From what `inspect` found; jobs - curves side by side; kept - pairs, None before `tune`."""
    modes = {} if "model" in study else {"blades": study.blades.modes, "damper": study.damper.modes}
    bodies = {
        name: (b.free_dofs or b.dofs or 0, found.columns.get(name, 0), modes.get(name, b.dofs or 0))
        for name, b in found.bodies.items()
    }
    curves = () if "respond" not in study else _orders(study.respond)
    pairs = sum(found.pairs.values())
    detached = "tune" in study and bool(study.tune.target_hz or study.tune.target_from)
    share = kept / pairs if kept is not None and pairs else SETTINGS.kept if detached else 1.0
    return Size(
        bodies,
        pairs,
        curves,
        study.respond.followed if curves and is_reduced(study, pairs) else 0,
        share,
        study.preload.bodies == "full" or bool(found.tractions),
        _sets(study, found) if detached else 0,
        _fewer(study, found, pairs),
        jobs,
        _instants(study.respond) if curves else 0,
        stressed=len(study.respond.levels) if curves and study.respond.stress else 0,
    )


def _instants(settings: Respond) -> int:
    return (settings.samples or SETTINGS.instants) if settings.law.file else 0


def _orders(settings: Respond) -> tuple[int, ...]:
    """H of every curve; with harmonics = 'auto' as is usual."""
    return (named_orders(settings.harmonics) or SETTINGS.tried) * len(settings.levels)


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


def forecast(size: Size, machine: Machine) -> dict[str, Cost]:
    """{stage: its cost}."""
    seconds = memory = 0.0
    for dofs, columns, modes in size.bodies.values():
        seconds += SETTINGS.factors * _factor(dofs, machine)
        seconds += (
            (columns + SETTINGS.solves_a_mode * modes)
            * machine.solve
            * (dofs / machine.dofs) ** SETTINGS.solve_growth
        )
        seconds += SETTINGS.dense * 2 * dofs * columns**2 / machine.flops
        memory += predicted_bytes(dofs // 3, columns // 3)
    r, pairs = size.reduced, size.pairs
    dense = 8.0 * r**2
    modes_of_all = SETTINGS.eigen * r**3 / machine.flops
    statics = (2 * r**2 * 3 * pairs + 20 * pairs**3) / machine.flops
    a_set = 2 / 3 * min(r, 3 * pairs) ** 3 / machine.flops
    costs = {
        "preload": Cost(statics, 4 * dense),
        "tune": Cost(3 * modes_of_all + size.sets * a_set, 6 * dense),
    }
    if any(columns for _, columns, _ in size.bodies.values()):  # not so of given matrices
        costs = {"reduce": Cost(seconds, memory), **_of_meshes(size, costs, machine)}
    if size.curves:
        costs["respond"] = _of_curves(size, Cost(modes_of_all, 4 * dense), machine)
    if size.stressed:
        costs["stress"] = _of_stress(size, machine)
    return costs


def _of_stress(size: Size, machine: Machine) -> Cost:
    """One factor of each body, which are held together, and the stress at the levels."""
    seconds = sum(_factor(dofs, machine) for dofs, _, _ in size.bodies.values())
    return Cost(
        seconds + SETTINGS.stress * size.stressed * size.dofs, predicted_bytes(size.dofs // 3)
    )


def _factor(dofs: int, machine: Machine) -> float:
    """s for the factor of a body."""
    return machine.factor * (dofs / machine.dofs) ** SETTINGS.factor_growth


def _of_curves(size: Size, model: Cost, machine: Machine) -> Cost:
    """The cost of the response beside that of the model alone. An interface reduction makes the
    model small, not the contact: every kept pair is in it and can slip."""
    kept = max(int(size.kept * size.pairs), 1)
    guessed = max(int(SETTINGS.slipping * min(size.followed or kept, kept)), 1)
    together = sorted(size.curves)[-size.jobs :]

    def cost(levels: tuple[int, ...]) -> tuple[float, float]:
        """s and bytes where so many pairs slip at each level, whose curves follow one another."""
        slip = np.repeat(levels, len(size.curves) // len(levels))
        curves = zip(size.curves, slip, strict=True)
        seconds = sum(_curve(kept, H, n, size.instants, machine) for H, n in curves)
        need = sum(curve_bytes(max(levels), kept, 3, H) for H in together)
        return model.seconds + seconds, model.bytes + need

    some, few = cost(size.acting or (guessed,))
    worst, all_of_them = cost((kept,))
    return Cost(some, few, worst, all_of_them)


def _of_meshes(size: Size, costs: dict[str, Cost], machine: Machine) -> dict[str, Cost]:
    """The costs of preload and tune with what they do on all dofs."""
    factors = sum(_factor(dofs, machine) for dofs, _, _ in size.bodies.values())
    together, held = _factor(size.dofs, machine), predicted_bytes(size.dofs // 3)
    preload = costs["preload"]
    tune = costs["tune"]
    found = {
        "preload": preload,
        "tune": Cost(tune.seconds + SETTINGS.checked * together, tune.bytes + held),
    }
    if size.unreduced:
        contact = 2 * size.pairs**3 / machine.flops
        found["preload"] = Cost(
            contact + SETTINGS.unreduced * factors, 3 * 8.0 * size.pairs**2 + held
        )
    return found


def _curve(pairs: int, H: int, slip: int, instants: int, machine: Machine) -> float:
    """s of one curve, one way, on which so many of the pairs slip: solutions with their Jacobian,
    by factors or by iterations on matrices for each order, and the forces."""
    forces = (
        instants * (SETTINGS.instant + SETTINGS.instant_and_pair * pairs)
        if instants
        else SETTINGS.contact * pairs * (2 * H + 1)
    )
    points = SETTINGS.points + SETTINGS.points_a_pair * slip
    return points * SETTINGS.steps * (min(flops(3 * slip, H + 1)) / machine.flops + forces)


def advice(size: Size, costs: dict[str, Cost]) -> Iterator[str]:
    """What will be slow or too large, and what helps."""
    more = {
        "tune": f'; [tune] by = "area" tries some dozen shares in place of {size.sets} sets'
        * (size.sets > 0),
        "respond": '; [respond] interface = "reduced" follows the pairs nearest to slip'
        * (not size.followed),
    }
    for stage, cost in costs.items():
        if cost.bytes > available_bytes():
            yield (
                f"{stage} is estimated to need {cost.bytes / 1e9:.1f} GB, "
                f"{available_bytes() / 1e9:.1f} GB are available: {size.fewer}"
            )
        elif max(cost.seconds, cost.at_most if stage == "respond" else 0.0) > SETTINGS.slow:
            yield f"{stage} is estimated to take {cost.text}: {size.fewer}{more.get(stage, '')}"
        if cost.bytes <= available_bytes() < cost.bytes_at_most:
            yield (
                f"{stage} may need {cost.bytes_at_most / 1e9:.1f} GB should all kept pairs slip, "
                f"{available_bytes() / 1e9:.1f} GB are available: fewer [respond] harmonics or "
                "kept pairs"
                + f", or --jobs below {size.jobs}"
                * (min(size.jobs, len(size.curves)) > 1)
            )


def estimate(
    study: Study, found: InspectResult, jobs: int = 1, kept: int | None = None
) -> tuple[Size, dict[str, Cost]]:
    """Sizes and costs."""
    size = size_of(study, found, jobs, kept)
    return size, costs_of(size)


def costs_of(size: Size) -> dict[str, Cost]:
    """As `forecast`; the machine is measured where the common one would take longer than a
    minute."""
    costs = forecast(size, COMMON)
    if sum(max(cost.seconds, cost.at_most) for cost in costs.values()) < SETTINGS.short:
        return costs
    return forecast(size, measured())


@cache
def measured() -> Machine:
    """The yardstick: a block of 14 x 14 x 14 hexahedra is factorised and solved, a dense matrix
    factorised."""
    import scipy.linalg as sl
    import scipy.sparse as sp

    from tipdamp.modal.eigen import Factor
    from tipdamp.modal.elements.isoparametric import stiffness_and_mass

    n = 14
    at = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)
    # fmt: off
    corners = [
        (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
        (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1),
    ]
    # fmt: on
    cells = np.stack([at[a : n + a, b : n + b, c : n + c].ravel() for a, b, c in corners], axis=1)
    place = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    K = stiffness_and_mass(place, "hexahedron", cells, 1.0, 1.0, 1.0)[0]
    K = (K + sp.identity(K.shape[0])).tocsr()
    began = time.process_time()
    factor = Factor(K)
    factored = time.process_time()
    factor.solve(np.ones((K.shape[0], 32)))
    solved = time.process_time()
    dense = np.eye(700) + 1e-3 * place[:700, :1] @ place[:700, :1].T
    sl.lu_factor(dense)
    done = time.process_time()
    return Machine(
        factored - began,
        (solved - factored) / 32,
        2 / 3 * 700**3 / max(done - solved, 1e-4),
        K.shape[0],
    )
