"""Parts of a proposed study: groups, vectors, and what only a person knows."""

import json
import shlex
from collections.abc import Iterable, Sequence

import numpy as np

from tipdamp.hbm.errors import shown
from tipdamp.modal.mesh import offered
from tipdamp.proposal.propose import Proposal

ASK = '"?"'


def made_of(found: Proposal) -> str:
    """What a trial was computed with, for people."""
    return "the given materials" if found.materials else "steel"


def group_comment(found: Proposal, body: str, meaning: str, wanted: bool) -> str:
    """The comment on a group: what it is for, and which there are where one is wanted."""
    groups = ", ".join(map(shown, offered(found.meshes[body].groups))) or "none in the file"
    return f"     # {meaning}" + (f"; groups: {groups}" if wanted else "")


def group_names(groups: Sequence[str]) -> str:
    """A group, a list of several, or the mark where there is none."""
    if not groups:
        return ASK
    if len(groups) == 1:
        return quoted(groups[0])
    return f"[{', '.join(map(quoted, groups))}]"


def command_again(files: Iterable[str], pull: float | None) -> str:
    """The command line of a proposal with the load points named."""
    words = " ".join(shown(shlex.quote(file), 1000) for file in dict.fromkeys(files))
    return f"tipdamp inspect {words}" + _pull(pull) + " --load-points NAME"


def _pull(pull: float | None) -> str:
    return "" if pull is None else f" --pull {pull:.12g}"


def quoted(group: str) -> str:
    """As a string of TOML."""
    return json.dumps(group, ensure_ascii=False).replace("\x7f", "\\u007f")


def vector(values: Sequence[float] | np.ndarray) -> str:
    """As an array of TOML."""
    return "[" + ", ".join(f"{v:.6g}" for v in np.asarray(values) + 0.0) + "]"
