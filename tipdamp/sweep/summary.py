"""How far a sweep is, and what came of it, in words."""

import re
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tipdamp.engine.progress import duration
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import shown
from tipdamp.sweep.cases import in_words
from tipdamp.sweep.index import HOW, CaseState, Index
from tipdamp.sweep.work import at_work

FREQUENCY = re.compile(r"(\d+(?:\.\d+)?(?:e[+-]?\d+)?) Hz")
ERROR = re.compile(r"\d\.\d+e[+-]\d+")  # as warnings write them, and nothing else
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
SERIES = re.compile(r"([^,;:]+)(?:, \1)+")  # such as levels, once their numbers are all one
LONGEST = 2000  # letters of a reason or a warning
SHOWN = 20  # cases that failed, for each reason


def status(folder: Path, how: str = HOW) -> tuple[str, bool]:
    """(text, whether no case failed and no curve is incomplete) of the sweep in a folder, also
    while another process works there; how - the command of the sweep."""
    with Index(folder, how=how) as index:
        cases, facts, incomplete = index.cases(), index.facts(), index.incomplete()
        warnings = index.warnings()
    count = Counter(one.state for one in cases)
    lines = [
        f"sweep       {count['done']} of {len(cases)} cases done, {count['failed']} failed, "
        f"{count['to do']} to do{_left(folder, facts, count['to do'], how)}"
    ]
    lines += _incomplete(incomplete)
    lines += _warnings(warnings)
    lines += _failures([one for one in cases if one.state == "failed"])
    if count["failed"]:
        lines.append(f"to try them again: {how} --retry")
    return "\n".join(lines), not count["failed"] and not incomplete


def _incomplete(reasons: dict[str, int]) -> list[str]:
    """One line for each reason, whatever the frequencies."""
    alike: dict[str, list[str]] = {}
    for why, count in reasons.items():
        alike.setdefault(FREQUENCY.sub("... Hz", why), []).extend([why] * count)
    return [
        f"{len(every)} curve{'s are' if len(every) > 1 else ' is'} incomplete: "
        f"{shown(_with_range(why, every), LONGEST)}"
        for why, every in alike.items()
    ]


def alike(said: Mapping[int, Sequence[str]]) -> list[tuple[str, list[int]]]:
    """Of {case: its warnings} each warning once, whatever its numbers and however many of a kind it
    lists: (text of the case in which the errors that it tells are the largest, the first without
    any; that case, then all others that have it)."""
    found: dict[str, dict[int, str]] = {}
    for number, texts in said.items():
        for text in texts:
            kind = SERIES.sub(r"\1", NUMBER.sub("#", text))
            found.setdefault(kind, {}).setdefault(number, text)
    worst = [(max(every, key=lambda case: _error(every[case])), every) for every in found.values()]
    return [(every[k], [k, *(case for case in every if case != k)]) for k, every in worst]


def _error(text: str) -> float:
    """The largest that a warning tells, 0 where it tells none."""
    return max(map(float, ERROR.findall(text)), default=0.0)


def _warnings(said: dict[int, list[str]]) -> list[str]:
    return [
        f"warning: {shown(text, LONGEST)} (case {cases[0]}{_and_others(len(cases) - 1)})"
        for text, cases in alike(said)
    ]


def _and_others(count: int) -> str:
    return f" and {count} more" * bool(count)


def _with_range(why: str, every: Sequence[str]) -> str:
    """The reason with the first frequency of all of them, from to."""
    hz = [float(found[1]) for one in every if (found := FREQUENCY.search(one))]
    if not hz or min(hz) == max(hz):
        return every[0]
    return why.replace("... Hz", f"{min(hz):g} to {max(hz):g} Hz", 1)


def _left(folder: Path, facts: Mapping[str, Any], to_do: int, how: str) -> str:
    if not to_do:
        return ""
    if not Store(folder).in_use:
        return f"; nothing runs, to go on: {how}"
    left, told = facts.get("left"), facts.get("told")
    if left is None or told is None:
        return "".join(f"; runs: {shown(text, 200)}" for text in at_work(folder))
    ago = time.time() - told
    return f"; about {duration(left)} left as told {duration(max(ago, 0.0))} ago"


def _failures(failed: list[CaseState]) -> list[str]:
    """One line for each reason, with the cases that it ended."""
    lines = []
    for reason in dict.fromkeys(one.reason for one in failed):
        of_it = [one for one in failed if one.reason == reason]
        lines.append(f"failed: {reason}")
        lines += [
            f"    case {one.number}: {shown(in_words(one.case), 200)}" for one in of_it[:SHOWN]
        ]
        if len(of_it) > SHOWN:
            lines.append(f"    and {len(of_it) - SHOWN} more cases")
    return lines
