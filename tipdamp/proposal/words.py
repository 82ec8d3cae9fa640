"""Parts of a proposed study: groups, vectors, and what only a person knows."""

import json
from collections.abc import Sequence

import numpy as np

from tipdamp.proposal.propose import Proposal

ASK = '"?"'


def made_of(found: Proposal) -> str:
    """What a trial was computed with, for people."""
    return "the given materials" if found.materials else "steel"


def group_comment(found: Proposal, body: str, meaning: str, wanted: bool) -> str:
    """The comment on a group: what it is for, and which there are where one is wanted."""
    groups = ", ".join(sorted(found.meshes[body].groups)) or "none in the file"
    return f"     # {meaning}" + (f"; groups: {groups}" if wanted else "")


def group_names(groups: Sequence[str]) -> str:
    """A group, a list of several, or the mark where there is none."""
    return (
        ASK
        if not groups
        else quoted(groups[0])
        if len(groups) == 1
        else f"[{', '.join(map(quoted, groups))}]"
    )


def quoted(group: str) -> str:
    """As a string of TOML."""
    return json.dumps(group, ensure_ascii=False)


def vector(values: Sequence[float] | np.ndarray) -> str:
    """As an array of TOML."""
    return "[" + ", ".join(f"{v:.6g}" for v in np.asarray(values) + 0.0) + "]"
