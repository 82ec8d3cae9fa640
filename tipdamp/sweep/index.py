"""The index of a sweep: one SQLite file, of what its cases are and what came of them. It follows
from the study and the finished steps, and can be made anew from them; one process writes, others
may read meanwhile."""

import errno
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TypeVar

from tipdamp.hbm.errors import InputError
from tipdamp.sweep.cases import Case
from tipdamp.sweep.plan import SweepStep
from tipdamp.sweep.rows import CurveRow, Row, StressRow

FILE = "index.sqlite"
HOW = "tipdamp sweep STUDY.toml"
BUSY = 30.0  # s that a reader waits for the writer
OTHER_TABLES = ("no such table", "no such column", "has no column", " columns but ")


@dataclass(frozen=True)
class CaseState:
    """Of one case, counted from 1: state - 'done', 'failed' or 'to do', with the reason."""

    number: int
    key: str
    case: Case
    state: str
    reason: str


R = TypeVar("R", CurveRow, StressRow)
TABLE_OF: dict[type[Row], str] = {CurveRow: "curves", StressRow: "stresses"}
# a case with what its steps have left in a table
OF_CASES = "cases join chains on cases.key = chains.last join {0} on {0}.key = chains.key"
TABLES = f"""
create table if not exists cases (number integer primary key, key text, case_values text);
create table if not exists steps (
    key text primary key, stage text, state text, reason text, seconds real, bytes integer);
create table if not exists curves ({", ".join(field.name for field in fields(CurveRow))});
create index if not exists curves_of on curves (key);
create table if not exists stresses ({", ".join(field.name for field in fields(StressRow))});
create index if not exists stresses_of on stresses (key);
create table if not exists levels (level text, key text);
create index if not exists levels_of on levels (key);
create table if not exists chains (last text, key text);
create index if not exists chains_of on chains (last);
create table if not exists warnings (key text, text text);
create index if not exists warnings_of on warnings (key);
create table if not exists facts (name text primary key, value text);
"""


class Index:
    """The index in the folder of a sweep. how - the command that makes it."""

    def __init__(self, folder: Path, write: bool = False, how: str = HOW) -> None:
        self.path = folder / FILE
        if not write and not self.path.is_file():
            raise InputError(f"{folder}: no sweep has run here yet; run: {how}")
        with self._told():
            mode = "rwc" if write else "ro"
            self.base = sqlite3.connect(
                f"{self.path.absolute().as_uri()}?mode={mode}", uri=True, timeout=BUSY
            )
            if write:
                # it can be made anew: no case waits for the disk
                self.base.execute("pragma synchronous = off")
                self.base.executescript(TABLES)

    def __enter__(self) -> "Index":
        return self

    def __exit__(self, *_: object) -> None:
        self.base.close()

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Errors of the data base as those of its file."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            if "full" in str(error):
                raise OSError(errno.ENOSPC, "no space left on device", str(self.path)) from None
            if any(words in str(error) for words in OTHER_TABLES):
                raise InputError(
                    f"{self.path} was written by another version of tipdamp ({error}); remove it: "
                    "the sweep makes it anew from the finished steps"
                ) from None
            if isinstance(error, sqlite3.OperationalError):
                raise OSError(errno.EIO, str(error), str(self.path)) from None
            raise InputError(
                f"{self.path} is damaged ({error}); remove it: it is made anew from the finished "
                "steps"
            ) from None

    def _write(self, sql: str, rows: Iterable[tuple]) -> None:
        self.base.executemany(sql, rows)

    def _read(self, sql: str) -> Iterator[tuple]:
        with self._told():
            yield from self.base.execute(sql)

    def begin(
        self,
        cases: Sequence[Case],
        last: Sequence[str],
        chains: Mapping[str, Sequence[str]] | None = None,
    ) -> None:
        """The cases of the sweep that begins, in place of those of an earlier one; chains - see
        `Plan`, by default of the last steps alone."""
        chains = chains or {key: (key,) for key in last}
        links = [(end, key) for end, keys in chains.items() for key in keys]
        rows = zip(range(1, len(cases) + 1), last, (json.dumps(c) for c in cases), strict=True)
        with self._told(), self.base:
            self.base.execute("delete from cases")
            self.base.execute("delete from chains")
            self._write("insert into cases values (?, ?, ?)", rows)
            self._write("insert into chains values (?, ?)", links)

    def say(self, **facts: object) -> None:
        """Facts about the sweep as a whole, for readers."""
        with self._told(), self.base:
            self._write(
                "insert or replace into facts values (?, ?)",
                [(name, json.dumps(value)) for name, value in facts.items()],
            )

    def facts(self) -> dict:
        """What `say` was told."""
        return {n: json.loads(v) for n, v in self._read("select * from facts")}

    def done(
        self,
        steps: Sequence[tuple[SweepStep, float, int]],
        rows: Sequence[Row] = (),
        warnings: Iterable[tuple[str, str]] = (),
    ) -> None:
        """Finished steps with their seconds and bytes, their rows, and (key of a step, warning of
        its stage)."""
        made = [(s.key, s.stage, "done", "", seconds, size) for s, seconds, size in steps]
        with self._told(), self.base:
            for table in (*TABLE_OF.values(), "warnings", "levels"):
                self._write(f"delete from {table} where key = ?", [row[:1] for row in made])
            self._write("insert or replace into steps values (?, ?, ?, ?, ?, ?)", made)
            for kind, table in TABLE_OF.items():
                marks = ", ".join("?" * len(fields(kind)))
                mine = (astuple(row) for row in rows if isinstance(row, kind))
                self._write(f"insert into {table} values ({marks})", mine)
            self._write("insert into warnings values (?, ?)", warnings)
            self._write(
                "insert into levels values (?, ?)",
                [(level, s.key) for s, _, _ in steps for level in s.levels],
            )

    def failed(self, keys: Iterable[tuple[str, str]], reason: str) -> None:
        """(key, stage) of what will not be made, with the reason."""
        with self._told(), self.base:
            self._write(
                "insert or replace into steps values (?, ?, 'failed', ?, null, null)",
                [(key, stage, reason) for key, stage in keys],
            )

    def forget(self, keys: Iterable[str]) -> None:
        """Steps that are to be made, again or for the first time."""
        with self._told(), self.base:
            self._write("delete from steps where key = ?", [(key,) for key in keys])

    def states(self) -> dict[str, str]:
        """{key: 'done' or 'failed'} of steps."""
        return dict(self._read("select key, state from steps"))

    def levels(self) -> dict[str, str]:
        """{key of a level, see `SweepStep`: key of a finished step that has its curves}."""
        sql = "select level, levels.key from levels join steps using (key) where state = 'done'"
        return dict(self._read(sql))

    def seconds(self) -> dict[str, float]:
        """{key: s} of finished steps."""
        return dict(self._read("select key, seconds from steps where state = 'done'"))

    def costs(self) -> dict[str, tuple[int, float, float]]:
        """{stage: (steps made, s, bytes of one)}, means."""
        sql = (
            "select stage, count(*), avg(seconds), avg(bytes) from steps where state = 'done' "
            "group by stage"
        )
        return {stage: (n, s, size) for stage, n, s, size in self._read(sql)}

    def counts(self) -> dict[str, int]:
        """{state: number of cases}"""
        sql = (
            "select coalesce(state, 'to do'), count(*) from cases left join steps "
            "on cases.key = steps.key group by 1"
        )
        return dict(self._read(sql))

    def cases(self) -> list[CaseState]:
        """Every case of the sweep."""
        sql = (
            "select number, cases.key, case_values, coalesce(state, 'to do'), "
            "coalesce(reason, '') from cases left join steps on cases.key = steps.key "
            "order by number"
        )
        return [
            CaseState(n, key, json.loads(values), state, reason)
            for n, key, values, state, reason in self._read(sql)
        ]

    def incomplete(self) -> dict[str, int]:
        """{why: number of curves} of those that stopped before the end of the band."""
        sql = (
            "select ended, count(*) from (select distinct curves.key, Fe_N, H, ended from "
            f"{OF_CASES.format('curves')} where not complete) group by ended order by 2 desc"
        )
        return dict(self._read(sql))

    def warnings(self) -> dict[int, list[str]]:
        """{case: what its stages warned of}, of cases that are finished, in their order."""
        sql = (
            f"select number, text from {OF_CASES.format('warnings')} join steps on steps.key = "
            "cases.key where state = 'done' order by number, chains.rowid, warnings.rowid"
        )
        found: dict[int, list[str]] = {}
        for number, text in self._read(sql):
            found.setdefault(number, []).append(text)
        return found

    def curves(self) -> list[tuple[int, CurveRow]]:
        """(case, curve) of every case whose curves are there, in their order."""
        return self._rows(CurveRow)

    def stresses(self) -> list[tuple[int, StressRow]]:
        """(case, stress at the peak of a curve) of every case whose stress is there, in their
        order."""
        return self._rows(StressRow)

    def _rows(self, kind: type[R]) -> list[tuple[int, R]]:
        table = TABLE_OF[kind]
        columns = ", ".join(f"{table}.{field.name}" for field in fields(kind))
        sql = (
            f"select number, {columns} from {OF_CASES.format(table)} order by number, {table}.rowid"
        )
        return [(n, kind(*row)) for n, *row in self._read(sql)]
