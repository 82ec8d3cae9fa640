"""[tune] and [respond] of a proposed study, with what each value was taken from."""

from collections.abc import Sequence

import numpy as np

from tipdamp.bodies import BLADES
from tipdamp.proposal.propose import Proposal
from tipdamp.proposal.trial import DAMPING, LEVELS, MULTIPLES, Trial, levels_of
from tipdamp.proposal.words import ASK, group_comment, group_names, made_of, vector

FRICTION = "# all stuck, the first slip at the peak, slip, about the best damping"


def response_text(found: Proposal, tried: Trial | None, pull: float | None) -> list[str]:
    """Lines of both sections, behind marks as long as something is missing that a study needs."""
    lines = [
        "[tune]",
        *_all_kept(found),
        *_followed(tried),
        "",
        "[respond]",
        *_groups(found, tried),
        *_levels(pull, tried),
        *_band(found, tried),
        f"damping_ratio = {DAMPING:g}       # guessed: 0.005 without damper, 0.022 with it on the "
        "rig of [Zucca 2016]",
        'harmonics = "auto"          # as many as the tolerance needs; 3 for a first look',
        "tolerance = 1e-3            # of the vibration, error by the harmonics left out",
    ]
    if tried and pull is not None:
        return lines
    return [
        "# for the forced response complete these and take the marks off",
        *(f"# {line}" if line else "#" for line in lines),
    ]


def _all_kept(found: Proposal) -> list[str]:
    """Stations, where nodes match on every side; points of unlike meshes lie in none."""
    if all(side.matching for side in found.sides):
        return ['stations = "all"            # or target_hz, a measured stuck frequency']
    return [
        'by = "area"',
        "kept_share = 1              # of the closed area; or target_hz, a measured stuck "
        "frequency",
    ]


def _followed(tried: Trial | None) -> list[str]:
    """What is tracked, where no stuck mode resembles the one that is by default."""
    if tried is None or not tried.follow:
        return []
    return [
        "# all contacts stuck, no mode resembles the out-of-phase one; with fewer one may: a",
        "# target_hz well above the free modes is of that one, without this line",
        f'follow = "{tried.follow}"',
    ]


def _groups(found: Proposal, tried: Trial | None) -> list[str]:
    excitation, patches = found.groups["excitation"][:1], found.groups["patches"][:2]
    direction = (
        f"direction = {vector(np.cross(found.axis, found.pull))}     # of force and response: "
        "across both"
    )
    if tried is None or not tried.moved:
        return [
            f"excitation = {group_names(excitation)}"
            + group_comment(found, BLADES, "the node that is excited", not excitation),
            *_shared(found, excitation),
            direction,
            f"patches = {group_names(patches)}"
            + group_comment(
                found, BLADES, "two groups of response nodes, blade 1 first", len(patches) < 2
            ),
        ]
    return [
        "# no groups have such names: of each blade the node that moves most along the direction "
        "in the two",
        f"# lowest modes, at {tried.moved}",
        f"excitation = {group_names(tried.excitation)}",
        *_shared(found, excitation),
        direction,
        f"patches = {group_names(tried.patches)}",
    ]


def _shared(found: Proposal, excitation: Sequence[str]) -> list[str]:
    """Of a set of several nodes, which a study refuses otherwise."""
    count = sum(len(found.meshes[BLADES].groups[name]) for name in excitation)
    if count < 2:
        return []
    return [f"share_force = true          # equally, among the {count} nodes of that set"]


def _levels(pull: float | None, tried: Trial | None) -> list[str]:
    shares = LEVELS if tried is None else tried.levels
    lifted = _lifted(tried.lift_before_slip if tried else None, pull)
    ratios = ", ".join(f"{1 / share:.3g}" for share in shares)
    lines = [
        f"# the pull times {', '.join(f'{share:g}' for share in shares)}, Fc/Fe = {ratios}:",
        *(_of_figure() if tried is None or tried.slip is None else _of_slip(tried.slip, lifted)),
    ]
    levels = ASK if pull is None else vector(levels_of(pull, shares))
    return [*lines, f"levels = {levels}     # N, amplitudes of the excitation"]


def _of_figure() -> list[str]:
    return [
        "# the range of [Zucca 2016, figure 3], whose tip dampers slip from the second on; where "
        "all pairs",
        "# slip at the lowest level begin lower",
    ]


def _of_slip(slip: float, lifted: list[str]) -> list[str]:
    factors = [f"{factor:g}" for factor in MULTIPLES]
    return [
        f"# {', '.join(factors[:-1])} and {factors[-1]} times the level from which on half of the "
        "closed contacts slip",
        f"# or lift off (Fc/Fe = {1 / slip:.3g}: stuck response on smooth half-spaces, "
        f"damping ratio {DAMPING:g}):",
        *(lifted or [FRICTION]),
    ]


def _lifted(lift: float | None, pull: float | None) -> list[str]:
    """That levels by slip say little; nothing without contacts that open first."""
    if lift is None:
        return []
    place = f"{lift:.2g} of the pull" if pull is None else f"{lift * pull:.2g} N"
    return [
        f"# contacts open from {place} on, before most of them slip: friction alone does not limit",
        "# the response, and whether it damps at these levels only their curves tell",
    ]


def _band(found: Proposal, tried: Trial | None) -> list[str]:
    if tried is None:
        return [
            "# from below the lowest free mode, which `tipdamp reduce` prints, to above the stuck "
            "one, which",
            "# `tipdamp tune` prints: 0.9 and 1.1 times that",
            f"band = {ASK}                  # Hz, such as [700, 900]",
        ]
    free, soft, stuck = (_hz(hz) for hz in (tried.free_hz, tried.soft_hz, tried.stuck_hz))
    return [
        f"# computed with {made_of(found)}"
        + "; sqrt(E/density) of titanium and nickel alloys differs by 3 %" * (not found.materials)
        + ":",
        f"# without damper {free}; all contacts stuck {stuck} on smooth half-spaces,",
        f"# {soft} on contacts thirteen times softer: a tenth below and above all of them",
        *_unlike(tried),
        f"band = {vector(tried.band)}          # Hz",
    ]


def _unlike(tried: Trial) -> list[str]:
    """Modes that the band leaves out."""
    return [
        f"# stuck on half-spaces no mode resembles the free {free.replace('_', '-')} one; the "
        f"nearest, {mode.hz:.0f} Hz,\n# has a MAC of {mode.mac:.2f} with it and is left out"
        for free, mode in tried.unlike.items()
    ]


def _hz(values: tuple[float, ...]) -> str:
    return " and ".join(f"{hz:.0f}" for hz in values) + " Hz"
