"""What the stages will cost in CPU time and memory, before anything heavy: estimated from the sizes
that `inspect` found and from the speed of this machine, measured in the same run. Right to a factor
of about two; refused is memory alone."""

from collections.abc import Iterator
from dataclasses import dataclass

from tipdamp.checks import curve_cost
from tipdamp.checks.machine import COMMON, Machine, measured
from tipdamp.checks.sizes import Size, size_of
from tipdamp.engine.progress import duration
from tipdamp.hbm.memory import available_bytes, curve_bytes
from tipdamp.modal.memory import predicted_bytes
from tipdamp.results.static_results import InspectResult
from tipdamp.study.view import Study


@dataclass(frozen=True)
class ForecastSettings:
    """How costs grow."""

    # of the factor's time with the dofs, hexahedra and tetrahedra [benchmarks/growth]
    factor_growth: float = 1.65
    # of a right-hand side's, as its entries: nested dissection in three dimensions
    solve_growth: float = 4 / 3
    factors: int = 3  # of a body: for its masters, for its modes, and their count
    solves_a_mode: int = 4  # of the Lanczos process
    dense: int = 6  # products of dofs x masters with masters in a reduction
    eigen: float = 25.0  # flops of the modes of r dofs over r^3
    # of the stress at the peak of one level: s a dof for the largest range between two instants of
    # a period [rig of 70 mm, 54 498 dofs, H = 3: 5.5]
    stress: float = 1e-4
    short: float = 60.0  # s below which nothing is measured and nothing said
    slow: float = 600.0  # s above which a stage is warned of
    # of the factors of both bodies: a preload on them [460 points 10 s, 2718: 70 s]
    unreduced: int = 2
    # of the factor of both together: their stuck modes, which `tune` compares [rigs: 1.6 to 2.3]
    checked: int = 2


SETTINGS = ForecastSettings()


@dataclass(frozen=True)
class Cost:
    """seconds, bytes - estimated; at_most, bytes_at_most - where every pair slips; once - part of
    the seconds that a process spends once for all studies with the same bodies and kept pairs."""

    seconds: float
    bytes: float
    at_most: float = 0.0
    bytes_at_most: float = 0.0
    once: float = 0.0

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


def forecast(size: Size, machine: Machine) -> dict[str, Cost]:
    """{stage: its cost}."""
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
        costs = {"reduce": _of_reduction(size, machine), **_of_meshes(size, costs, machine)}
    if size.curves:
        costs["respond"] = _of_curves(size, Cost(modes_of_all, 4 * dense), machine)
    if size.stressed:
        costs["stress"] = _of_stress(size, machine)
    return costs


def _of_reduction(size: Size, machine: Machine) -> Cost:
    """Of both bodies, one after the other."""
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
    return Cost(seconds, memory)


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
    kept = size.kept_pairs
    together = sorted(size.curves)[-size.jobs :]

    def cost(acting: tuple[int, ...]) -> tuple[float, float]:
        """s and bytes where so many pairs slip at each level, whose curves follow one another."""
        need = sum(curve_bytes(max(acting), kept, 3, H) for H in together)
        return model.seconds + curve_cost.seconds(size, acting, machine), model.bytes + need

    some, few = cost(size.slipping)
    worst, all_of_them = cost((kept,))
    return Cost(some, few, worst, all_of_them)


def _of_meshes(size: Size, costs: dict[str, Cost], machine: Machine) -> dict[str, Cost]:
    """The costs of preload and tune with what they do on all dofs."""
    factors = sum(_factor(dofs, machine) for dofs, _, _ in size.bodies.values())
    held = predicted_bytes(size.dofs // 3)
    tune, check = costs["tune"], SETTINGS.checked * _factor(size.dofs, machine)
    found = {
        "preload": costs["preload"],
        "tune": Cost(tune.seconds + check, tune.bytes + held, once=check),
    }
    if size.unreduced:
        contact = 2 * size.pairs**3 / machine.flops
        found["preload"] = Cost(
            contact + SETTINGS.unreduced * factors, 3 * 8.0 * size.pairs**2 + held
        )
    return found


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
        if stage == "respond" and size.cycles and cost.seconds > SETTINGS.short:
            yield (
                f"respond: an evaluation of the law by file takes {max(size.cycles.values()):.2g} "
                "s; one compiled with numba is faster, docs/gallery/own_law_numba.py shows how"
            )
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
