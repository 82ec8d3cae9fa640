"""Checks of a round damper that has slid along its flanks until it rests."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tipdamp.bodies.balance import Balance
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.contact.slide_at_rest import SlideAtRest


@dataclass(frozen=True)
class SlideLimits:
    """What is warned of."""

    off: float = 0.02  # rad: by as much, and more, side forces at 45 degrees are off
    far: float = 0.3  # of the radius: small motions give side forces to a percent up to here


LIMITS = SlideLimits()


def slide_warnings(
    slides: Mapping[str, SlideAtRest], sums: Mapping[str, float], wanted: Mapping[str, float]
) -> Iterator[str]:
    """A sentence for each side whose forces do not act where the damper rests, or that it slides
    far along. sums, wanted {side: N}: of its pairs, and what balances the load there."""
    for name, one in slides.items():
        slid = (
            f"side '{name}': at rest the damper has slid by {1e3 * abs(one.slide):.3g} mm along "
            f"its flank, {abs(one.slide) / one.radius:.0%} of its radius"
        )
        balance = (
            f": they sum to {sums[name]:.4g} N, where {wanted[name]:.4g} N would balance the load"
            if name in sums and name in wanted
            else ""
        )
        if one.off > LIMITS.off:
            yield (
                f"{slid} and {abs(one.slide) / one.spacing:.2g} of the distance of its rows, and "
                f"its forces act {np.degrees(one.off):.2g} degrees off the normal where it "
                f"rests{balance}; more faces of the damper across the side let others carry"
            )
        elif abs(one.slide) > LIMITS.far * one.radius:
            yield (
                f"{slid}: no small motion, as which it is computed; are the load, E and the "
                "stiffness of the contacts in the units of the file?"
            )


def balance_at_rest(
    pairs: ContactTable, slides: Mapping[str, SlideAtRest], balance: Balance
) -> dict[str, float]:
    """{side: N} that balance the load along the normals where the damper rests; {} where they do
    not."""
    try:
        return balance.of_sides(pairs, {name: one.normal for name, one in slides.items()})
    except InputError:
        return {}
