"""Stage tune: stations detached until the stuck frequency meets its target; the preload of the kept
pairs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tipdamp.bodies import CHECK_BELOW_HZ
from tipdamp.bodies.check import full_model_check
from tipdamp.bodies.free_modes import tracking_warnings
from tipdamp.bodies.read import BODY_FILES, BODY_READS
from tipdamp.checks.pairs import one_row_warnings
from tipdamp.checks.pairs import warnings as pair_warnings
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.fields.visualization import keep_stuck
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.contact_doubts import closure_doubts, tangential_doubts, uneven_doubts
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.truncation import Truncation
from tipdamp.results import static_results as results
from tipdamp.stages.kept_preload import (
    KeptContact,
    KeptPreload,
    WholeAtRest,
    kept_case,
    kept_preload,
)
from tipdamp.stages.kept_search import KeptSearch, detachment, target
from tipdamp.stages.preload import side_forces
from tipdamp.stages.stage import Stage
from tipdamp.static_contact.full.stuck_modes import StuckSet
from tipdamp.static_contact.tuning.redistribution import MOMENT, carried
from tipdamp.static_contact.tuning.roll_springs import spring_rows
from tipdamp.static_contact.tuning.station_detachment import (
    Step,
)
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly, StuckModes
from tipdamp.statics import friction_history
from tipdamp.statics import model_inputs as inputs
from tipdamp.statics.modes import Stuck, free_shapes
from tipdamp.study.view import Study

SHOWN_BELOW_HZ = 2 * CHECK_BELOW_HZ
ABOVE = 1.5  # times the tracked frequency, up to which modes are shown and checked at least
LISTED = 6  # stuck modes in the line of the stage
UNBALANCED = 0.01  # of the pull, by a table's preload: more is told


def tune(study: Study, store: Store, tick: Tick) -> list[str]:
    """Detach stations until the stuck frequency meets the target; the kept pairs carry the pull."""
    model = ReducedModel.load(store.path("model.npz"))
    whole = WholeAtRest.load(study, store, model)
    line = inputs.line_of(study, whole.pairs)
    assembly = StuckAssembly(model)
    shapes = free_shapes(study, model)
    goal = target(study, store)
    follow = shapes.pop(study.tune.follow)
    options = detachment(study, whole, line, goal)
    search = KeptSearch(study, assembly, line, goal, options)
    pairs, tuned = search.kept(follow, shapes, tick)
    contact = KeptContact(study, model, results.ReduceResult.load(store).reduction, pairs)
    kept = kept_preload(study, _without_detached(study, whole, line, pairs), contact)
    closed = {
        "full_area": (whole.pairs, whole.pairs.preload > 0),
        "full_line": (line, carried(whole.pairs, line) > 0),
        "tuned": (kept.pairs, kept.pairs.preload > 0),
    }
    sets = {
        name: Stuck.of(study, assembly, follow, *one, above_hz=SHOWN_BELOW_HZ)
        for name, one in closed.items()
    }
    checked = _full_model_check(study, store, model, sets, tick)
    files = _write_kept(store, kept)
    found = results.TuneResult(
        other_modes=_other_modes(assembly, sets["tuned"], shapes),
        target_hz=goal.hz if goal else None,
        scatter_hz=options.scatter_hz,
        **tuned,
        **stuck_figures(sets),
        table=study.tune.kept or None,
        full_model_check=checked,
        **_preload_figures(kept),
        roll_stiffness_Nm_per_rad=sum(s.k for s in sets["tuned"].springs),
        cases={name: kept_case(contact, name) for name in study.loads},
        warnings=tuple(_passed_over(tuned.get("passed_over", ()))),
    )
    found.save(store)
    shown = {
        f"{found.kept_name} stuck": sets["tuned"].modes,
        "whole area stuck": sets["full_area"].modes,
    }
    return [*files, *keep_stuck(store, model, shown)]


def _preload_figures(kept: KeptPreload) -> dict:
    """Fields of TuneResult on the preload of the kept pairs."""
    pairs = kept.pairs.select(kept.pairs.carrying)
    return {
        "redistribution": kept.facts,
        "preload_kept": side_forces(pairs, kept.forces, kept.balance),
    }


def tracked_modes(study: Study, store: Store) -> dict[str, StuckModes]:
    """{free mode: stuck modes of the whole area, of which one is tracked by it}, of the reduced
    model alone."""
    model = ReducedModel.load(store.path("model.npz"))
    whole = ContactTable.load(store.path("preload.csv"))
    assembly = StuckAssembly(model)
    closed = whole.preload > 0
    return {
        name: Stuck.of(study, assembly, shape, whole, closed, above_hz=SHOWN_BELOW_HZ).modes
        for name, shape in free_shapes(study, model).items()
    }


def _passed_over(sets: Sequence[Step]) -> Iterator[str]:
    """A sentence on sets that fit the target better than the one that is kept."""
    if sets:
        first = sets[0]
        yield (
            f"{len(sets)} sets of stations nearer to the target were passed over, since the "
            f"preload that they carry leaves a moment above {MOMENT.refused:.0%}: the nearest is "
            f"{first.front} + {first.back} at {first.hz:.1f} Hz"
        )


def _other_modes(
    assembly: StuckAssembly, stuck: Stuck, shapes: Mapping[str, np.ndarray]
) -> dict[str, results.TrackedMode]:
    """{free mode: the stuck mode that it tracks}"""
    extra = spring_rows(assembly.model, stuck.pairs, stuck.springs)
    found = {
        name: assembly.modes(stuck.pairs, shape, extra=extra) for name, shape in shapes.items()
    }
    return {
        name: results.TrackedMode(hz=modes.tracked_hz, mac=modes.mac)
        for name, modes in found.items()
    }


def _without_detached(
    study: Study, whole: WholeAtRest, line: ContactTable, kept: ContactTable
) -> WholeAtRest:
    """The map without what tuning by area took off, whose force is not moved to its neighbours; the
    rows for which a line stands are still there."""
    if study.tune.by == "station":
        return whole
    weight = np.where(line.carrying & ~kept.carrying, 0.0, whole.pairs.weight)
    return replace(whole, pairs=whole.pairs.replace(weight=weight))


def _full_model_check(
    study: Study, store: Store, model: ReducedModel, sets: Mapping[str, Stuck], tick: Tick
) -> dict[str, results.FullModelCheck]:
    """Nothing where matrices were given."""
    if "model" in study:
        return {}
    tick(0.8, "full model")
    exact = not results.ReduceResult.load(store).reduction.tractions
    truncation = Truncation.load(store.path("truncation.npz")) if exact else None
    reduction = store.record("reduce")
    assert reduction is not None  # the model was loaded
    return full_model_check(
        study,
        model,
        reduction.key,
        truncation,
        {name: _lowest(model, one) for name, one in sets.items()},
        tick,
    )


def _lowest(model: ReducedModel, one: Stuck) -> StuckSet:
    hz = _below(CHECK_BELOW_HZ, one.modes)
    motion = relative_motion(model, one.pairs) @ one.modes.shapes[:, : len(hz)]
    return StuckSet(one.pairs, one.springs, hz, motion)


def _below(limit: float, modes: StuckModes) -> np.ndarray:
    """Hz of the modes up to a limit, and in any case of those around the tracked one."""
    return modes.hz[modes.hz < max(limit, ABOVE * modes.tracked_hz)]


def stuck_figures(sets: Mapping[str, Stuck]) -> dict:
    """Fields of TuneResult on the stuck modes of each set of pairs."""
    return {
        "stuck_hz": results.OfSets[float](**{n: one.modes.tracked_hz for n, one in sets.items()}),
        "mac": results.OfSets[float](**{n: one.modes.mac for n, one in sets.items()}),
        "stuck_modes_hz": {n: _below(SHOWN_BELOW_HZ, one.modes) for n, one in sets.items()},
        "closed_pairs": results.OfSets[int](
            **{n: int(one.pairs.carrying.sum()) for n, one in sets.items()}
        ),
        "open_pairs": results.OfSets[int](**{n: one.open for n, one in sets.items()}),
    }


def _write_kept(store: Store, kept: KeptPreload) -> list[str]:
    """kept.csv, and with friction kept_friction.csv; the names of what is not always written."""
    with store.writing("kept.csv") as path:
        kept.pairs.save(path)
    if kept.tangential is None:
        return []
    with store.writing("kept_friction.csv") as path:
        none = np.zeros_like(kept.tangential)
        friction_history.save(path, kept.pairs, kept.tangential, none, none[:, 0])
    return ["kept_friction.csv"]


def line(store: Store) -> str:
    """Stuck frequencies, what is kept, and the lowest modes, for the band."""
    found = results.TuneResult.load(store)
    stuck = found.stuck_hz
    opened = {
        name: f" ({n} pair{'s' * (n > 1)} open at rest)" if n else ""
        for name, n in found.open_pairs
    }
    of_line = "" if found.line_is_whole else f", line {stuck.full_line:.0f} Hz{opened['full_line']}"
    every = found.stuck_modes_hz.tuned
    modes = ", ".join(f"{hz:.1f}" for hz in every[:LISTED]) + ", ..." * (len(every) > LISTED)
    return (
        f"stuck: area {stuck.full_area:.0f} Hz{opened['full_area']}{of_line}, "
        f"{found.kept_in_words} {stuck.tuned:.0f} Hz{opened['tuned']}, among modes at {modes} Hz"
    )


def warnings(study: Study, store: Store) -> list[str]:
    """Of the tracked mode, of a closed part that follows the mesh, and of a table of the user's
    own."""
    found = results.TuneResult.load(store)
    meets = study.tune.by == "area" and found.target_hz is not None
    rows = one_row_warnings(ContactTable.load(store.path("preload.csv")), meets)
    return [
        *found.warnings,
        *tracking_warnings(study, found),
        *rows,
        *_table_warnings(study, store, found),
    ]


def _table_warnings(study: Study, store: Store, found: results.TuneResult) -> Iterator[str]:
    """Friction beyond that of metals; preload that is balanced by friction alone, which the
    response does not know."""
    if not study.tune.kept:
        return
    kept = ContactTable.load(store.path("kept.csv"))
    yield from pair_warnings(kept)
    yield from closure_doubts(kept)
    yield from tangential_doubts(kept)
    yield from uneven_doubts(kept)
    left = max(side.balance_error or 0.0 for side in found.preload_kept.values())
    if study.tune.preload == "table" and left > UNBALANCED:
        yield (
            f"[tune] kept = '{study.tune.kept}': {left:.0%} of the pull is not balanced by the "
            "normal forces of the table's preload, and friction would have to hold it; [tune] "
            "preload = 'scaled' balances it"
        )


def _reads_more(study: Study) -> tuple[str, ...]:
    return friction_history.READS if study.preload.friction else ()


def _needs_more(study: Study) -> tuple[str, ...]:
    return ("measured",) if study.tune.target_from else ()


STAGE = Stage(
    tune,
    line,
    warnings=warnings,
    reads_more=_reads_more,
    outputs=("kept.csv", "tune.json"),
    may_write=("kept_friction.csv", "stuck_modes.npz", "stuck_modes.vtu"),
    needs=("reduce", "preload"),
    needs_more=_needs_more,
    requires=("tune", "respond"),
    reads_files=(*BODY_FILES, "tune"),
    reads=(
        "tune",
        "sides",
        "driver",
        "preload",
        "loads",
        "contact.normal",
        "contact.stiffness",
        *BODY_READS,
    ),
)
