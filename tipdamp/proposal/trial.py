"""A proposal computed before a person completes it, with the materials of its files or the steel
that it may be of: where blades and damper have their modes, how stiff the contacts are, where a
blade moves most."""

import tomllib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tipdamp.bodies import BLADES
from tipdamp.bodies.assemble import assembled_blades
from tipdamp.bodies.free_modes import LOWEST_MAC, NAMES
from tipdamp.bodies.read import read_meshes
from tipdamp.checks.forecast import estimate
from tipdamp.checks.room import acting, lifting
from tipdamp.engine.progress import display, duration
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.ties import first_largest
from tipdamp.modal.body import check_support
from tipdamp.modal.eigen import Factor
from tipdamp.proposal.propose import Proposal
from tipdamp.results.static_results import InspectResult, ReduceResult, TrackedMode
from tipdamp.stages.assembly import assembled
from tipdamp.stages.run import run_stage
from tipdamp.stages.tune import tracked_modes
from tipdamp.study.study import study_of
from tipdamp.study.view import Study

STEEL = {"m": (205e9, 0.3, 7850.0), "mm": (205e3, 0.3, 7.85e-9)}
# of smooth half-spaces: the paper's contacts of machined faces                [Zucca 2016,
# section 7.1]
SOFTEST = 1 / 13
# of the pull, where nothing is computed: all stuck, beginning slip, the best damping, past it
# [Zucca 2016, figure 3]
LEVELS = (0.01, 0.1, 0.25, 0.5)
# of the level at which half of the closed contacts slip in the stuck response: all stuck, first
# slip at the peak, slip, about the best damping, a third of the stuck resonance's amplification up
MULTIPLES = (0.3, 3.0, 10.0, 30.0)
SHARES = (1e-6, 10.0)  # of the pull, between which that level is sought
LIFTED = 0.1  # of the closed contacts, from which on lifting off is worth a word
STEPS = 12  # halvings of their logarithm, down to 0.4 %
DAMPING = 0.005  # without damper                                              [Zucca 2016]
LONGEST = 180.0  # s that a proposal may take
OUT_OF_PHASE, IN_PHASE = NAMES
MODES = 2  # lowest of the blades, in which both take part


@dataclass(frozen=True)
class SmoothSide:
    """Of a side on smooth half-spaces: kn, kt - N/m of all its points; pairs - their number; area -
    m2, 0 for pairs of nodes."""

    kn: float
    kt: float
    pairs: int
    area: float


@dataclass(frozen=True)
class Trial:
    """What was computed. only_friction - motions of the damper that no contact normal faces;
    excitation, patches - groups, or nodes by their number, where no group was found; moved - in
    words where these lie; free_hz, stuck_hz - on smooth half-spaces, soft_hz - on the softest
    contacts, of those stuck modes that resemble a free one; unlike {free mode: the nearest stuck
    one}, which does not resemble it; sides {name: stiffness}; slip - excitation over pull from
    which on half of the closed contacts slip or lift off under the stuck response, lift - from
    which on a tenth of them lift off, None where they never do."""

    only_friction: tuple[str, ...]
    excitation: tuple[str, ...]
    patches: tuple[str, ...]
    moved: str
    free_hz: tuple[float, ...]
    soft_hz: tuple[float, ...]
    stuck_hz: tuple[float, ...]
    sides: dict[str, SmoothSide]
    slip: float | None = None
    lift: float | None = None
    unlike: dict[str, TrackedMode] = field(default_factory=dict)

    @property
    def follow(self) -> str:
        """Free mode whose stuck counterpart is tracked, of those that have one; '' for that of a
        study that does not say it."""
        return IN_PHASE if list(self.unlike) == [OUT_OF_PHASE] else ""

    @property
    def levels(self) -> tuple[float, ...]:
        """Of the excitation, as shares of the pull."""
        if self.slip is None:
            return LEVELS
        return tuple(_digits(factor * self.slip) for factor in MULTIPLES)

    @property
    def lift_before_slip(self) -> float | None:
        """`lift` where contacts lift off before most of them slip: the levels say little then."""
        if self.slip is None or self.lift is None or self.lift > self.slip:
            return None
        return self.lift

    @property
    def band(self) -> tuple[float, float]:
        """Hz: from a tenth below the lowest frequency to a tenth above the highest, rounded."""
        every = (*self.free_hz, *self.soft_hz, *self.stuck_hz)
        return _rounded(0.9 * min(every)), _rounded(1.1 * max(every))


def trial(found: Proposal, text: str, target: Path, quiet: bool = False) -> Trial:
    """Of the study text that would stand at target. Raises InputError with the reason where a group
    is missing, the bodies are too large, or a stage refuses them."""
    content = tomllib.loads(text)
    unknown = {"clamp": content["blades"]["clamp"], "load_points": content["damper"]["load_points"]}
    if missing := [what for what, group in unknown.items() if group == "?"]:
        raise InputError(f"no group of nodes has a name that tells {' and '.join(missing)}")
    if not found.materials:
        E, nu, density = STEEL[found.length]
        content["material"] = {"E": E, "nu": nu, "density": density}
    content["damper"]["pull"] = 1.0
    content["damper"].pop("hold", None)  # what is free is found here
    content["contact"]["mu"] = 0.5
    with TemporaryDirectory() as folder:
        return _tried(found, content, target, Store(Path(folder)), quiet)


def levels_of(pull: float, shares: Sequence[float]) -> tuple[float, ...]:
    """Fe in the unit of the pull, to two digits."""
    return tuple(_digits(share * pull) for share in shares)


def _tried(found: Proposal, content: dict, target: Path, store: Store, quiet: bool) -> Trial:
    _run(("inspect",), study_of(target, content), store, quiet)
    inspected = InspectResult.load(store)
    content["damper"]["hold"] = [
        {"motion": name.removeprefix("slide along ").removeprefix("roll "), "mean": True}
        for name in inspected.only_friction
        if "(" not in name
    ]
    study = study_of(target, content)
    _refuse_long(study, inspected)
    excitation, patches, moved = _looked_at(found, study, quiet)
    content["respond"] = {
        "excitation": excitation,
        "share_force": True,
        "patches": patches,
        "direction": _across(found).tolist(),
    }
    matching = all(side.matching for side in found.sides)
    content["tune"] = {"stations": "all"} if matching else {"by": "area", "kept_share": 1}
    soft, stuck = (
        _stuck(study_of(target, _scaled(content, scale)), store, quiet) for scale in (SOFTEST, 1.0)
    )
    unlike = {name: mode for name, mode in stuck.tracked.items() if mode.mac < LOWEST_MAC}
    reduced = ReduceResult.load(store)
    tried = Trial(
        tuple(inspected.only_friction),
        tuple(excitation),
        tuple(patches),
        moved,
        tuple(reduced.free_hz.values()) or reduced.free_modes_hz[:MODES],
        soft.without(unlike),
        stuck.without(unlike),
        _stiffnesses(ContactTable.load(store.path("preload.csv"))),
        unlike=unlike,
    )
    content["respond"] |= {
        "levels": [1.0],
        "band": list(tried.band),
        "damping_ratio": DAMPING,
        "harmonics": 1,
    }
    study = study_of(target, content)
    _run(("tune",), study, store, quiet)
    slip, lift = _slip_and_lift(study, store)
    return replace(tried, slip=slip, lift=lift)


def _across(found: Proposal) -> np.ndarray:
    """(3,) direction of the motion: across axis and pull."""
    return np.cross(found.axis, found.pull)


def _looked_at(found: Proposal, study: Study, quiet: bool) -> tuple[list[str], list[str], str]:
    """Excitation and patches: groups with such names, or the nodes that move most; in words where
    these lie."""
    excitation, patches = found.groups["excitation"][:1], found.groups["patches"][:2]
    if excitation and len(patches) == 2:
        return excitation, patches, ""
    with display(quiet=quiet).job("modes of the blades", patience=0.0):
        nodes, moved = _moving_most(found, study, _across(found))
    return excitation or nodes[:1], patches if len(patches) == 2 else nodes, moved


def _slip_and_lift(study: Study, store: Store) -> tuple[float | None, float | None]:
    """Levels, at a pull of 1, at which half of the contacts that are closed at rest slip or lift
    off somewhere in the band, and a tenth of them lift off; None where they never do."""
    curves, band = assembled(study, store).curves, study.respond.band
    contacts = curves.problem.contacts
    closed = int((contacts.preload > 0).sum())

    def moving(level: float) -> int:
        return acting(curves, [level], band)[level].contacts

    half = (moving(SHARES[0]) + len(contacts)) / 2  # what is open at rest always acts
    return (
        _level(moving, half),
        _level(lambda level: lifting(curves, level, band), LIFTED * closed),
    )


def _level(number: Callable[[float], int], enough: float) -> float | None:
    """From which on a number of contacts is enough."""
    low, high = SHARES
    if number(high) < enough:
        return None
    for _ in range(STEPS):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if number(middle) >= enough else (middle, high)
    return high


def _run(stages: Sequence[str], study: Study, store: Store, quiet: bool) -> None:
    for name in stages:
        run_stage(name, study, store, quiet=quiet)


def _refuse_long(study: Study, inspected: InspectResult) -> None:
    _, costs = estimate(study, inspected)
    seconds = sum(cost.seconds for cost in costs.values())
    if seconds > LONGEST:
        raise InputError(f"it would take about {duration(seconds)}")


def _scaled(content: dict, scale: float) -> dict:
    return {**content, "contact": {**content["contact"], "scale": scale}}


@dataclass(frozen=True)
class _NearestStuck:
    """tracked {free mode: the stuck one nearest to it}; lowest - Hz."""

    tracked: dict[str, TrackedMode]
    lowest: tuple[float, ...]

    def without(self, names: Collection[str]) -> tuple[float, ...]:
        """Hz of those tracked by other free modes; without such the lowest."""
        others = (mode.hz for name, mode in self.tracked.items() if name not in names)
        return tuple(others) or self.lowest


def _stuck(study: Study, store: Store, quiet: bool) -> _NearestStuck:
    """The modes with all contacts stuck."""
    _run(("inspect", "reduce", "preload"), study, store, quiet)
    found = tracked_modes(study, store)
    return _NearestStuck(
        {name: TrackedMode(hz=one.tracked_hz, mac=one.mac) for name, one in found.items()},
        tuple(map(float, next(iter(found.values())).hz[:MODES])),
    )


def _moving_most(found: Proposal, study: Study, direction: np.ndarray) -> tuple[list[str], str]:
    """['node 12', 'node 731'] on either side of the damper, blade 1 first: the largest
    displacement along the direction in the lowest modes of the blades, of the full model, as the
    nodes are masters of the reduction."""
    blades = assembled_blades(study, read_meshes(study)[BLADES])
    check_support(blades)
    _, shapes = Factor(blades.K).lowest_modes(blades.M, MODES)
    moves = np.zeros((len(blades.node), MODES))
    along = direction[blades.dof_direction]
    np.add.at(moves, blades.dof_node, along[:, None] * shapes)
    size = np.abs(moves).max(axis=1)
    middle = np.mean([side.patch.box.mean(axis=0) for side in found.sides], axis=0)
    factor = 1e-3 if found.length == "mm" else 1.0
    across = (blades.position - factor * middle) @ direction
    names, places = [], []
    for side in (across < 0, across > 0):
        at = np.flatnonzero(side)[first_largest(size[side])]
        names.append(f"node {blades.node[at]}")
        places.append("(" + ", ".join(f"{x:.3g}" for x in 1e3 * blades.position[at]) + ") mm")
    return names, " and ".join(places)


def _stiffnesses(pairs: ContactTable) -> dict[str, SmoothSide]:
    found = {}
    for name in pairs.sides:
        mine = pairs.select(pairs.side == name)
        area = float(mine.area.sum()) if mine.on_surface.all() else 0.0
        found[name] = SmoothSide(float(mine.kn.sum()), float(mine.kt.sum()), len(mine), area)
    return found


def _digits(value: float) -> float:
    """To two digits."""
    return float(f"{value:.2g}")


def _rounded(hz: float) -> float:
    """To two digits, three from a leading 1."""
    step = 10.0 ** (np.floor(np.log10(hz)) - 1)
    return float(round(hz / step) * step)
