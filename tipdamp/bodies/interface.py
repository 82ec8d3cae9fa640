"""The interface reduction of a study: whether the response is in few shapes of many pairs, and how
good these are."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.interface import (
    Excitation,
    InterfaceReduction,
    InterfaceSettings,
    reduce_interface,
)
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.response_results import CurveResult, InterfaceFacts
from tipdamp.study.schema import named_orders
from tipdamp.study.view import Study


@dataclass(frozen=True)
class Choice:
    """When the reduction is made and trusted without a word."""

    whole: int = 200  # pairs up to which all dofs are kept, unless the study says otherwise
    error: float = 0.01  # stated error above which it is warned of
    orders: int = 15  # that the shapes are made for, of harmonics = 'auto' which may take more
    least_damping: float = 1e-3  # by which pairs are ranked: an undamped resonance has no amplitude


CHOICE = Choice()
FILES = ("interface_model.npz", "interface_shapes.npz")
NOT_MADE = InterfaceFacts(
    pairs=0, followed=0, dofs=0, shapes=0, response_error=0.0, frequency_error=0.0
)


def is_reduced(study: Study, pairs: int) -> bool:
    """Whether the study wants the response of so many pairs in few shapes."""
    settings = study.respond
    return settings.interface == "reduced" or settings.interface == "auto" and pairs > CHOICE.whole


def shapes_of(
    study: Study,
    model: ReducedModel,
    kept: ContactTable,
    forces: Sequence[np.ndarray],
    held: Sequence[HeldMotion] = (),
) -> InterfaceReduction | None:
    """The response's own shapes where the study wants them and they are fewer; forces (r,) N at
    their largest."""
    settings = study.respond
    if not is_reduced(study, len(kept)):
        return None
    chosen = InterfaceSettings(
        followed=settings.followed, ratio=max(*settings.damping_ratio, CHOICE.least_damping)
    )
    excitation = Excitation(
        forces, settings.band, max(named_orders(settings.harmonics), default=CHOICE.orders)
    )
    return reduce_interface(model, kept, settings.law.make(), excitation, held, chosen)


def keep_shapes(store: Store, found: InterfaceReduction | None) -> list[str]:
    """Write the shapes for the stages behind; the names of the files."""
    if found is None:
        return []
    with store.writing(FILES[0]) as model, store.writing(FILES[1]) as shapes:
        found.save(model, shapes)
    return list(FILES)


def kept_shapes(store: Store, held: Sequence[HeldMotion]) -> InterfaceReduction | None:
    """What `keep_shapes` wrote."""
    model, shapes = map(store.path, FILES)
    return InterfaceReduction.load(model, shapes, held) if shapes.is_file() else None


def facts_of(
    study: Study,
    found: InterfaceReduction | None,
    curves: Sequence[CurveResult],
    names: Sequence[str],
) -> InterfaceFacts | None:
    """Size and errors, and the pairs (P names) that slip on a curve and are not followed; None of
    all dofs, with followed = 0 against the study's wish."""
    if found is None:
        return NOT_MADE if study.respond.interface == "reduced" else None
    known = {name for name, mine in zip(names, found.followed, strict=True) if mine}
    slipping = dict.fromkeys(name for curve in curves for name in curve.slipping_pairs)
    return InterfaceFacts(
        pairs=len(found.followed),
        followed=int(found.followed.sum()),
        dofs=len(found.basis),
        shapes=found.basis.shape[1],
        response_error=found.response_error,
        frequency_error=found.frequency_error,
        not_followed=tuple(name for name in slipping if name not in known),
    )


def doubts(facts: InterfaceFacts | None) -> Iterator[str]:
    """What may be wrong with the response in these shapes, or with the study's wish for them."""
    if facts is None:
        return
    if not facts.followed:
        yield (
            "[respond] interface = 'reduced' makes nothing smaller here, and all dofs are kept: "
            "lower followed, or leave it out"
        )
    if facts.not_followed:
        yield (
            f"interface reduction: {len(facts.not_followed)} pairs slip or lift off that are not "
            f"followed (first: {facts.not_followed[0]}): raise [respond] followed above "
            f"{facts.followed}, or set interface = 'whole'"
        )
    if max(facts.response_error, facts.frequency_error) > CHOICE.error:
        yield (
            f"interface reduction: the response is known to {facts.response_error:.1e} and the "
            f"stuck frequencies to {facts.frequency_error:.1e} only: raise [respond] followed, or "
            "set interface = 'whole'"
        )


def in_words(facts: InterfaceFacts | None) -> str:
    """For the summary; empty without reduction."""
    if facts is None or not facts.followed:
        return ""
    error = max(facts.response_error, facts.frequency_error)
    return (
        f"; {facts.pairs} pairs in {facts.shapes} shapes for {facts.dofs} dofs, error {error:.0e}"
    )
