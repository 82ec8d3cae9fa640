"""The proposed study beside the meshes, and what the command line says of it."""

from collections.abc import Iterator
from pathlib import Path

from tipdamp.bodies import DAMPER
from tipdamp.checks import only_friction
from tipdamp.hbm.errors import InputError, shown
from tipdamp.modal.cell_shape import sliver_warning
from tipdamp.modal.mesh import offered
from tipdamp.proposal.propose import Proposal, propose
from tipdamp.proposal.study_text import study_text
from tipdamp.proposal.trial import Trial, trial
from tipdamp.proposal.words import command_again, made_of


def write_proposal(
    paths: list[Path], pull: float | None = None, load_points: str = "", quiet: bool = False
) -> str:
    """Write <first mesh>.toml beside the first mesh; what was found, line by line. Never overwrites
    a file. pull - N, where it is known; load_points - the group that shares it, '' to tell it by
    its name."""
    if toml := next((p for p in paths if p.suffix.lower() == ".toml"), None):
        raise InputError(f"{toml}: one study at a time, or mesh files alone")
    target = paths[0].with_suffix(".toml")
    if target.exists():
        raise InputError(
            f"{target} is there already and stays as it is; move it away for a new proposal"
        )
    found = propose(paths, load_points)
    names = {
        body: path.name if path.parent == target.parent else str(path.resolve())
        for body, path in sorted(found.files.items(), key=lambda item: paths.index(item[1]))
    }
    tried, said = None, []
    try:
        tried = trial(found, study_text(found, names), target, quiet)
        said = list(_computed(found, tried))
    except InputError as error:
        said = [f"band and nodes are not computed: {error}"]
        if not found.groups["load_points"] and found.meshes[DAMPER].groups:
            said.append(_named(found, paths, target, pull))
    target.write_text(study_text(found, names, tried, pull), encoding="utf-8")
    return "\n".join([*_lines(found), *said, f"study to be completed: {target}"])


def _named(found: Proposal, paths: list[Path], target: Path, pull: float | None) -> str:
    """What to do where no group is known as the load points."""
    groups = ", ".join(map(shown, offered(found.meshes[DAMPER].groups)))
    return (
        f"with the load points they are: move {target} away, then "
        f"{command_again(map(str, paths), pull)}, which is one of {groups}"
    )


def _computed(found: Proposal, tried: Trial) -> Iterator[str]:
    free, soft, stuck = (
        ", ".join(f"{hz:.0f}" for hz in values)
        for values in (tried.free_hz, tried.soft_hz, tried.stuck_hz)
    )
    yield (
        f"of {made_of(found)}: free {free} Hz, all contacts stuck {soft} (soft) to {stuck} Hz "
        "(half-spaces)"
    )
    if tried.only_friction:
        yield only_friction.said(tried.only_friction)
    if tried.moved:
        yield f"the blades move most at {tried.moved}: {', '.join(tried.patches)}"


def _lines(found: Proposal) -> Iterator[str]:
    for body, mesh in found.meshes.items():
        cells = ", ".join(f"{len(c)} {kind}" for kind, c in mesh.cells.items())
        yield f"{body}: {found.files[body].name}, {len(mesh.node)} nodes, {cells}"
        if said := sliver_warning(mesh, 1.0, found.length):  # read in the unit of the file
            yield f"warning: {found.files[body].name}: {said}"
    for side in found.sides:
        yield (
            f"side '{side.name}': {len(side.patch.damper)} faces of the damper"
            + f" ({shown(side.damper)})" * bool(side.damper)
            + f" meet {len(side.patch.blades)} of the blades"
            + f" ({shown(side.blade)})" * bool(side.blade)
            + f", {side.patch.area:.4g} {found.length}2, nodes "
            + ("match" if side.matching else "do not match")
        )
    for what, names in found.groups.items():
        yield f"{what}: {', '.join(map(shown, names)) or 'no group has such a name'}"
    if not all(mesh.groups for mesh in found.meshes.values()):
        yield (
            "clamp, load_points, excitation and patches are groups of nodes, and there are none: "
            "make them in the pre-processor (physical groups of gmsh, *NSET of Abaqus, "
            "components of Ansys), then inspect anew"
        )
