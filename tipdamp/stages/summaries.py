"""What each stage says of what it found: one line, and its warnings."""

from tipdamp.free_modes import tracking_warnings
from tipdamp.sanity_checks import expectations


def highlight(stage: str, store) -> str:
    """Figures of a finished stage for the command line."""
    return _LINES[stage](store)


def warnings(stage: str, study, found: dict) -> list[str]:
    """What a reader must know at once, before the next stage is run; found - content of the stage's file."""
    kept = found.get("warnings", [])
    if stage == "inspect":
        return [*kept, *expectations(study, found)]
    return [*kept, *tracking_warnings(study, found)] if stage == "tune" else kept


def _inspect(store):
    found = store.read_json("inspect.json")
    lines = [", ".join(f"{n} pairs on side '{s}'" for s, n in found["pairs"].items())]
    for name, b in found["bodies"].items():
        if "nodes" not in b:
            lines.append(f"{name}: {b['dofs']} dofs")
            continue
        size = " x ".join(f"{1e3 * (high - low):.4g}" for low, high in zip(*b["box_m"], strict=True))
        cells = ", ".join(f"{n} {kind}" for kind, n in b["cells"].items())
        groups = ", ".join(f"{group} ({n})" for group, n in b["groups"].items())
        lines.append(f"{name}: {b['nodes']} nodes, {cells}, {b['free_dofs']} free dofs, {size} mm, moving mass "
                     f"{b['moving_mass_kg'][0]:.4g} kg, {b['rigid_modes']} rigid modes; groups (nodes): {groups}")
    lines += [f"to look at: {store.path(name)}" for name in found.get("pictures", ())]
    return "\n".join([lines[0], *(" " * 21 + line for line in lines[1:])])


def _reduce(store):
    found = store.read_json("reduce.json")
    r, free = found["reduction"], found["free_hz"]
    modes = ", ".join(f"{name.replace('_', ' ')} {hz:.1f} Hz" for name, hz in free.items())
    return (f"{r['dofs']} dofs to {r['masters']} masters + {sum(r['modes'].values())} modes; free: "
            + (modes or f"{found['free_modes_hz'][0]:.1f} Hz"))


def _preload(store):
    return "; ".join(f"{side}: {s['sum_N']:.2f} N, {s['min_N']:.2f}..{s['max_N']:.2f} N, {s['detached']} open"
                     for side, s in store.read_json("preload.json")["sides"].items())


def _tune(store):
    found = store.read_json("tune.json")
    stuck, kept = found["stuck_hz"], found["tuned_pairs"]
    return (f"stuck: area {stuck['full_area']:.0f} Hz, line {stuck['full_line']:.0f} Hz, "
            f"{kept['front']} + {kept['back']} stations {stuck['tuned']:.0f} Hz")


def _respond(store):
    found = store.read_json("respond.json")["responses"]
    failed = sum(r["failed_points"] for r in found)
    return f"{len(found)} curves, {sum(r['points'] for r in found)} points, {failed} failed"


def _report(store):
    return str(store.path("report.html"))


_LINES = {"inspect": _inspect, "reduce": _reduce, "preload": _preload, "tune": _tune, "respond": _respond,
          "report": _report}
