"""The store of curves: one file each, with a record of all that it follows from; what a running
curve has is kept too.

responses/Fe_5N_H3.npz, Fe_5N_H3_back.npz    the finished curves
responses/Fe_5N_H3_more.json                 harmonics that a tolerance needs, where it misses it
responses/Fe_5N_H3_beside.json, ...          further curves (`tipdamp.engine.further`)
.stages/Fe_5N_H3.json                        key and fingerprints of the files
.stages/Fe_5N_H3.<key>.<n>.npz               the journal of one that runs, or was interrupted
"""

import logging
import re
import time
import warnings
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, cached_property
from itertools import count
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import scipy.sparse as sp

from tipdamp import hbm
from tipdamp.engine.store import Store, fingerprint
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.curve.journal import Journal, JournalBlock, StaleJournal
from tipdamp.hbm.curve.options import PointsOfInterest
from tipdamp.hbm.curve.probes import more_harmonics
from tipdamp.hbm.errors import Doubt
from tipdamp.hbm.io.array_files import open_npz, save_npz
from tipdamp.hbm.laws import ContactLaw, Contacts
from tipdamp.hbm.modes.derivatives import with_derivatives
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.result import ForcedResponse

# an npz file, cut or altered
DAMAGED = (OSError, ValueError, KeyError, EOFError, RuntimeError, BadZipFile)


@cache
def _tell_damaged(path: Path, _key: str) -> None:
    """Once a process for a curve and its key, however often it is asked for."""
    logging.getLogger("tipdamp").warning("%s is damaged, changed or gone; it is made anew", path)


@dataclass(frozen=True)
class CurveCase:
    """One curve: force level in N, harmonics, and the band in Hz as it is followed; search : key of
    the search for what may lie beside it, empty for none; tolerance : of the truncation, for which
    a curve that misses it tells how many harmonics are enough, 0 for none."""

    Fe_N: float
    H: int
    band: tuple[float, float]
    search: str = ""
    tolerance: float = 0.0

    @property
    def name(self) -> str:
        """Of its files; levels that differ have different names."""
        level = f"{self.Fe_N:g}" if float(f"{self.Fe_N:g}") == self.Fe_N else repr(self.Fe_N)
        return f"Fe_{level}N_H{self.H}" + "_back" * (self.band[0] > self.band[1])

    @property
    def file(self) -> str:
        """In the results folder."""
        return f"responses/{self.name}.npz"

    @property
    def beside(self) -> str:
        """Of the files of what was looked for beside it."""
        return f"{self.name}_beside"

    @property
    def more(self) -> str:
        """Of the file that says how many harmonics the tolerance needs."""
        return f"{self.name}_more"

    @property
    def title(self) -> str:
        """For the progress."""
        return f"Fe = {self.Fe_N:g} N, H = {self.H}" + ", downwards" * (self.band[0] > self.band[1])


@dataclass(frozen=True)
class Curves:
    """What the curves of a study have in common, and where they are kept.

    force (r,) N for a level of 1 N; rows {name: (r,)} of the outputs; start : of the sliders, and
    samples of a cycle,
    None for the default; peaks, stability : as in `tipdamp.hbm.curve.options.CurveOptions`;
    derivatives : whether to keep those of the highest peak of the first group of peaks
    """

    problem: ContactProblem
    force: np.ndarray
    rows: dict[str, np.ndarray]
    start: np.ndarray | None
    store: Store
    samples: int | None = None
    peaks: Sequence[Sequence[str]] | None = None
    stability: PointsOfInterest = "none"
    derivatives: bool = False

    def finished(self, case: CurveCase) -> bool:
        """Whether the store has this curve, made from the same, and unaltered."""
        return (
            self.kept(case.name, self.key(case))
            and not (case.tolerance and not self.kept(case.more, self._more_key(case)))
            and not (case.search and not self.kept(case.beside, self.search_key(case)))
        )

    def kept(self, name: str, key: str) -> bool:
        """Whether the store has what a name and its key stand for, unaltered."""
        record = self.store.record(name)
        if record is None or record.key != key or not record.outputs:
            return False
        if record.outputs != files_of(name, record.outputs):
            return False
        for file, mark in record.outputs.items():
            path = self.store.path(file)
            if not path.is_file() or fingerprint(path) != mark:
                _tell_damaged(path, record.key)
                return False
        return True

    def load(self, case: CurveCase) -> ForcedResponse:
        """A finished curve, with what was looked for beside it."""
        curve = ForcedResponse.load(self.store.path(case.file))
        if not case.search:
            return curve
        return replace(curve, **self.store.read_json(f"responses/{case.beside}.json"))

    def more_harmonics(self, case: CurveCase) -> int | None:
        """How many a finished curve needs for its tolerance; None where it meets it, or no more are
        tried."""
        return self.store.read_json(f"responses/{case.more}.json")["harmonics"]

    def beside(self, case: CurveCase) -> dict[str, ForcedResponse]:
        """{file: curve} that were found beside a finished one."""
        return {
            file: ForcedResponse.load(self.store.path(file))
            for file in self.files(case)
            if file != case.file and file.endswith(".npz")
        }

    def files(self, case: CurveCase) -> list[str]:
        """Of a finished curve and of what was looked for beside it."""
        return [
            case.file,
            *(self.store.outputs(case.beside) if case.search else ()),
            *(self.store.outputs(case.more) if case.tolerance else ()),
        ]

    def key(self, case: CurveCase) -> str:
        """Fingerprint of all that the curve follows from: equations, law, excitation, outputs,
        program."""
        return fingerprint(self._equations, case.Fe_N, case.H, case.band)

    def search_key(self, case: CurveCase) -> str:
        """Fingerprint of all that the search beside a curve follows from."""
        return fingerprint(self.key(case), case.search)

    def _more_key(self, case: CurveCase) -> str:
        return fingerprint(self.key(case), case.tolerance)

    @cached_property
    def _equations(self) -> str:
        return fingerprint(
            _program(),
            *_leaves((self.problem, self.force, self.rows, self.start, self.samples, self.peaks)),
            self.stability,
            self.derivatives,
        )

    def make(self, case: CurveCase, progress: Callable) -> None:
        """Compute what is missing of a curve, but for the search beside it, and put it into the
        store; one that was interrupted goes on where it was."""
        if not self.kept(case.name, self.key(case)):
            self._make_curve(case, progress)
        if case.tolerance and not self.kept(case.more, self._more_key(case)):
            self._more(case, progress)

    def _make_curve(self, case: CurveCase, progress: Callable) -> None:
        try:
            curve = self._followed(case, progress, Journal(self._keep(case), self._journal(case)))
        except StaleJournal:
            self._remove_journal(case)
            curve = self._followed(case, progress, Journal(self._keep(case)))
        with self.store.writing(case.file) as path:
            curve.save(path)
        self.store.finish(case.name, self.key(case), [case.file], curve.seconds)
        self._remove_journal(case)

    def _more(self, case: CurveCase, progress: Callable) -> None:
        """How many harmonics the tolerance needs, by points of the curve."""
        began, curve = time.perf_counter(), ForcedResponse.load(self.store.path(case.file))
        harmonics = more_harmonics(
            self.problem,
            case.Fe_N * self.force,
            curve,
            tolerance=case.tolerance,
            outputs=self.rows,
            start=self.start,
            samples=self.samples,
            progress=lambda _, step, calls: progress(case.band[1], step, calls),
        )
        file = f"responses/{case.more}.json"
        self.store.write_json(file, {"harmonics": harmonics})
        seconds = time.perf_counter() - began
        self.store.finish(case.more, self._more_key(case), [file], seconds)

    def _followed(self, case: CurveCase, progress: Callable, journal: Journal) -> ForcedResponse:
        try:
            curve = follow_band(
                self.problem,
                case.Fe_N * self.force,
                case.band,
                harmonics=case.H,
                outputs=self.rows,
                start=self.start,
                samples=self.samples,
                peaks=self.peaks,
                stability=self.stability,
                progress=progress,
                journal=journal,
            )
        except BaseException:
            journal.flush()
            raise
        return self._with_derivatives(curve) if self.derivatives else curve

    def _with_derivatives(self, curve: ForcedResponse) -> ForcedResponse:
        """Of a curve without a peak inside the band there are none."""
        names = curve.output_names.tolist() if self.peaks is None else self.peaks[0]
        tops = {name: curve.at_least(name)[1] for name in names}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Doubt)
            return with_derivatives(curve, self.problem, [max(names, key=lambda one: tops[one])])

    def _blocks(self, case: CurveCase) -> list[Path]:
        """Files of the journal of this very curve, in their order."""
        found = self.store.path(".stages").glob(f"{case.name}.{self.key(case)}.*.npz")
        return sorted(self.store.path(f".stages/{path.name}") for path in found)

    def _journal(self, case: CurveCase) -> Iterator[JournalBlock]:
        for path in self._blocks(case):
            try:
                with open_npz(path) as z:
                    block = JournalBlock(z["numbers"], z["layout"])
            except DAMAGED:
                raise StaleJournal from None
            yield block

    def _keep(self, case: CurveCase) -> Callable:
        name, number = f".stages/{case.name}.{self.key(case)}", count(len(self._blocks(case)))

        def keep(block: JournalBlock) -> None:
            with self.store.writing(f"{name}.{next(number):05d}.npz") as path:
                save_npz(path, **block._asdict())

        return keep

    def _remove_journal(self, case: CurveCase) -> None:
        for path in self._blocks(case):
            path.unlink(missing_ok=True)


def sweep(store: Store, cases: Collection[CurveCase]) -> None:
    """Remove curves, and journals of curves, that belong to no case: those of other versions of the
    study.

    A curve that somebody has changed since is named and stays.
    """
    kept = {case.name for case in cases}
    kept |= {case.beside for case in cases if case.search}
    kept |= {case.more for case in cases if case.tolerance}
    for record in filter(Path.is_file, store.path(".stages").glob("Fe_*.json")):
        if record.stem in kept:
            continue
        files = files_of(record.stem, store.outputs(record.stem))
        store.remove(files)
        for file in {f"responses/{record.stem}.npz": "", **files}:
            if store.path(file).is_file():
                logging.getLogger("tipdamp").warning(
                    "%s is not of this study, and was changed; it stays", store.path(file)
                )
        record.unlink()
    for block in filter(Path.is_file, store.path(".stages").glob("Fe_*.*.npz")):
        block.unlink()


def files_of(name: str, outputs: dict[str, str]) -> dict[str, str]:
    """Those of the {file: fingerprint} that belong to the curve, or to what was found of it, by the
    name of their record, which may be forged."""
    ending = r"(\.json|\d+\.npz)" if name.endswith(("_beside", "_more")) else r"\.npz"
    own = re.compile(rf"responses/{re.escape(name)}{ending}")
    return {file: mark for file, mark in outputs.items() if own.fullmatch(file)}


def forget(store: Store) -> None:
    """Have every curve made anew."""
    for kept in filter(Path.is_file, store.path(".stages").glob("Fe_*")):
        kept.unlink()


@cache
def _program() -> str:
    """Fingerprint of the sources of the equations and their solvers."""
    return fingerprint(*sorted(Path(str(hbm.__file__)).parent.rglob("*.py")))


def _leaves(value: Any) -> Iterator[Any]:
    """Names, arrays and plain values of records inside one another; functions, which only describe,
    are passed over."""
    if is_dataclass(value):
        yield f"{type(value).__module__}.{type(value).__name__}"  # the module of own laws: the file
        value = {f.name: vars(value)[f.name] for f in fields(value)}
    if isinstance(value, dict):
        for key, part in value.items():
            yield str(key)
            yield from _leaves(part)
    elif isinstance(value, tuple | list):
        yield len(value)
        for part in value:
            yield from _leaves(part)
    elif sp.issparse(value):
        yield value.toarray()
    else:
        yield None if callable(value) else value


def compile_kernels(_: Any, law: ContactLaw, __: Any) -> None:
    """Have the kernels of a law compiled and stored, by a short curve of a mass on one contact."""
    nd = len(law.components)
    one, pairs = np.eye(nd), Contacts(*np.array([[1.0], [1.0], [0.5], [1.0]]))
    problem = ContactProblem(one, 0.1 * one, one, one, law, pairs)
    follow_band(problem, np.ones(nd), (0.2, 0.3), harmonics=1, outputs={"x": one[0]})
