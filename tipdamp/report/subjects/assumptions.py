"""Table: what the study declares or the method fixes; not computed, and worth knowing."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.hold.rigid_motion import parse_motion
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import amount, force_along, listing, micro, moment, number
from tipdamp.results.static_results import PreloadResult, SideStiffness, TuneResult
from tipdamp.study.schema import SideSection, named_orders
from tipdamp.study.view import Study

MANY = 12  # load points beyond which a table names their ends alone
PER_MM3 = 1e9  # N/m3 in a N/mm3
LINE = {
    "edge": "represented by the lower edge line in the line model",
    "all": "all in the line model",
}
THEORY = {
    "halfspace_3d": "smooth half-spaces",
    "plane_depth": "plane strain",
    "rough_series": "half-spaces in series with a rough interface",
}
ORIGIN = {"preloaded": "the preloaded state", "unloaded": "the unloaded state"}
START = {
    "zero_slider": "unstrained in the preloaded state",
    "zero_force": "without force at the first instant",
}


def assumptions(results: Results) -> Iterator[Table]:
    """One table of names and values."""
    rows = [*_load(results)]
    if results.preload is not None and results.reduce is not None and results.whole is not None:
        rows += _contact(results.study, results.preload, results.reduce.rows, results.whole)
    if results.tune is not None:
        rows += _kept(results, results.tune)
    if "respond" in results.study:
        rows += _response(results)
    yield Table(
        "Declared in the study, or fixed by the method.",
        [{"": name, "value": value} for name, value in rows],
        left=(0, 1),
    )


def _load(results: Results) -> Iterator[tuple[str, str]]:
    study, drive = results.study, results.study.driver
    yield "pull Fc", f"{drive.pull:g} N along ({', '.join(f'{v:g}' for v in drive.pull_direction)})"
    places = results.reduce.pull_positions_m if results.reduce is not None else ()
    if places:
        given = study.damper.shares
        shares = ", ".join(f"{s:g}" for s in given) if given else "in equal parts"
        yield (
            "pull acts at",
            f"{load_points(1e3 * np.array(places), given)} mm along the axis, {shares}",
        )
    for hold in drive.hold:
        name, unit, _ = parse_motion(hold.motion)
        spring = "1e-5 of what sticking pairs resist it with"
        if hold.stiffness is not None:
            spring = f"{hold.stiffness:g} {unit}/{'m' if unit == 'N' else 'rad'}"
        yield (
            f"held: {name} of the damper",
            (
                "its mean, rigidly; the vibration along it is free"
                if hold.mean
                else f"by a spring of {spring}"
            ),
        )
    if "material" in study:
        m = study.material
        yield "material", f"E = {m.E / 1e9:g} GPa, nu = {m.nu:g}, density {m.density:g} kg/m³"


def load_points(along: np.ndarray, shares: Sequence[float] | None) -> str:
    """Coordinates of load points: each where they are few or have shares, else their number and
    span."""
    texts = [f"{v:.1f}" for v in np.round(along, 1) + 0.0]
    if shares:
        return listing(texts)
    texts = list(dict.fromkeys(texts))
    if len(texts) > MANY:
        return f"{len(along)} load points from {min(texts, key=float)} to {max(texts, key=float)}"
    return (
        listing(texts)
        if len(texts) == len(along)
        else f"{len(along)} load points at {listing(texts)}"
    )


def _contact(
    study: Study, preload: PreloadResult, rows_of: dict[str, int], whole: ContactTable
) -> Iterator[tuple[str, str]]:
    mu = np.unique(whole.mu)
    yield "friction coefficient mu", f"{mu[0]:g}" if len(mu) == 1 else f"{mu[0]:g} to {mu[-1]:g}"
    lines = any(side.rows == "edge" for side in study.sides.values())
    for name, (kn, kt) in preload.kn_kt_N_per_m.items():
        side, rows = study.sides.get(name), rows_of[name]
        made = preload.stiffness.get(name)
        where = _stiffness(made) if made else f"from {study.contact.pairs}"
        mine = whole.select(whole.side == name)
        yield (
            f"side '{name}'",
            f"{side.shape if side else 'given pairs'}; {_amounts(side, mine, kn, kt)}, {where}; "
            + _places(mine, rows)
            + (f", {LINE[side.rows]}" if rows > 1 and side and lines else "")
            + ("; initial gap given along the axis" if side and side.gap else ""),
        )


def _amounts(side: SideSection | None, mine: ContactTable, kn: float, kt: float) -> str:
    """kn and kt as the side has them: per area on surfaces and where it is given so, else per
    node."""
    if mine.on_surface.all():
        kn, kt = mine.kn.sum() / mine.area.sum(), mine.kt.sum() / mine.area.sum()
    elif side is not None and side.kn_per_area and side.kt_per_area:
        kn, kt = side.kn_per_area, side.kt_per_area
    else:
        return f"kn = {kn / 1e6:.3g}, kt = {kt / 1e6:.3g} N/µm per node"
    return f"kn = {kn / PER_MM3:.4g}, kt = {kt / PER_MM3:.4g} N/mm³ per area"


def _places(mine: ContactTable, rows: int) -> str:
    if mine.on_surface.all():
        return (
            f"surfaces of unlike meshes, {len(mine)} contact points on "
            f"{number(1e6 * mine.area.sum())} mm² in {rows} row{'s' * (rows > 1)}"
        )
    return f"{rows} row{'s' * (rows > 1)} in the patch"


def _stiffness(made: SideStiffness) -> str:
    """Given, or the model with what it was made from."""
    if made.model == "given":
        return "given" + (", shared by tributary area (mean)" if made.shares == "tributary" else "")
    parts = [
        f"{THEORY[made.model]} ({made.model})",
        f"{made.kind} at {number(made.load_N)} N on {1e3 * made.length_m:g} mm",
        f"half-width of contact {micro(made.half_width_m)} µm",
        f"E* = {number(made.E_star_Pa, scale=1e-9)} GPa",
        f"kt along {made.kt_along_N_per_m / 1e6:.3g}, across {made.kt_across_N_per_m / 1e6:.3g} "
        "N/µm",
    ]
    if made.depth_m:
        parts.append(f"depths {listing(f'{1e3 * d:g}' for d in made.depth_m)} mm")
    if made.h_rms_m:
        parts.append(f"h_rms {micro(made.h_rms_m)} µm, gamma {made.gamma:g}")
    if made.scale != 1:
        parts.append(f"times {made.scale:g}")
    if made.shares == "tributary":
        parts.append("shared by tributary area (mean)")
    return ", ".join(parts)


def _what_moves_it(tune: TuneResult) -> str:
    if tune.area:
        return "a part of the area is detached"
    if tune.line_is_whole:
        return "stations are detached"
    return "the force of each station is moved to its kept row"


def _kept(results: Results, tune: TuneResult) -> Iterator[tuple[str, str]]:
    if tune.roll_stiffness_Nm_per_rad or not tune.line_is_whole:
        yield (
            "roll stiffness of the kept edge lines",
            f"{amount(tune.roll_stiffness_Nm_per_rad, 'N m/rad')}, for the rows that the line "
            "model leaves out",
        )
    for mirror in tune.area.mirrors if tune.area else ():
        normal = ", ".join(f"{v + 0.0:.3g}" for v in mirror.normal)
        yield (
            "parts that mirror each other are detached together",
            f"about the plane across ({normal}): preloads of "
            f"mirrored places differ by {number(100 * mirror.noise, 2)} % of the whole",
        )
    done = tune.redistribution
    if done.scale:
        scale = ", ".join(f"{k:.3f} on side '{s}'" for s, k in done.scale.items())
        yield "preload of what is kept", f"scaled to the whole load: {scale}"
        yield (
            "moment balanced by a constraint in the static solution",
            f"{moment(done, results.axis)}: {_what_moves_it(tune)}",
        )
    else:
        yield (
            "preload of what is kept",
            f"as {tune.table} states it"
            if results.study.tune.preload == "table"
            else "static contact solved again on them",
        )
    for motion, load in done.reactions.items():
        yield "load balanced by a constraint in the static solution", force_along(motion, load)


def _response(results: Results) -> Iterator[tuple[str, str]]:
    settings, free = results.study.respond, results.study.free
    zetas = settings.damping_ratio
    yield (
        "damping ratio of the stuck modes",
        listing(f"{z:g}" for z in zetas)
        + (" (one value for all)" if len(zetas) == 1 else " (from the lowest mode)"),
    )
    yield "damping ratio without damper", listing(f"{z:g}" for z in free.damping_ratio)
    if results.cases:
        first = results.cases[0].facts
        yield "displacements measured from", ORIGIN[first.origin]
        yield "initial slider positions", START.get(first.start, first.start)
    named = named_orders(settings.harmonics)
    yield (
        "harmonics",
        f"orders 0 to H, H = {listing(named)}; the estimated error of the peaks is held against "
        f"{settings.tolerance:g} of them"
        if named
        else "orders 0 to H, H as large as 99 % of the points of a curve need for an estimated "
        f"error of {settings.tolerance:g} of their vibration",
    )
    if results.respond is not None:
        law = results.respond.law
        own = listing(f"{name} = {value:g}" for name, value in law.parameters.items())
        yield "contact law", f"{law}: {law.meaning}" + (f" Here {own}." if own else "")
