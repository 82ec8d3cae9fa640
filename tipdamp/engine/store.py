"""The results folder: what each stage left there, what it was made from, and whether it still is up
to date."""

import hashlib
import json
import logging
import os
import socket
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tipdamp.hbm.errors import InputError, shown
from tipdamp.hbm.io.array_files import check_size


class Finished(NamedTuple):
    """Record of a finished stage: key of what it was made from, outputs {file: fingerprint},
    seconds."""

    key: str
    outputs: dict[str, str]
    seconds: float

    @property
    def check(self) -> str:
        """Fingerprint of the record, by which damage to it is noticed."""
        return fingerprint(self.key, self.outputs, float(self.seconds))


@dataclass(frozen=True)
class Store:
    """A folder of plain files, with a small record `.stages/<stage>.json` for each stage that has
    finished.

    The folder may come from somebody else: nothing outside it is read, written or removed.
    """

    folder: Path

    def path(self, name: str) -> Path:
        """The file of that name; InputError where the name, or a symbolic link, leads out of the
        folder."""
        path = self.folder / name
        named_outside = Path(name).is_absolute() or ".." in Path(name).parts
        if named_outside or not path.resolve().is_relative_to(self.folder.resolve()):
            raise InputError(f"results folder {self.folder}: '{shown(name)}' leads out of it")
        return path

    @contextmanager
    def writing(self, name: str) -> Iterator[Path]:
        """A temporary path that takes its final name only when the block ends well: no partial file
        is ever left."""
        final = self.path(name)
        final.parent.mkdir(parents=True, exist_ok=True)
        temporary = final.with_name(f".tmp-{os.getpid()}-{final.name}")
        temporary.unlink(missing_ok=True)  # a link planted under this name would be followed
        try:
            yield temporary
            if temporary.is_file():
                os.replace(temporary, final)
        except OSError as error:
            error.filename = error.filename or str(final)  # a full disk is told without one
            raise
        finally:
            temporary.unlink(missing_ok=True)

    def write_json(self, name: str, content: dict) -> None:
        """Write numbers, arrays and texts as JSON; what is not a finite number becomes null."""
        with self.writing(name) as path:
            path.write_text(
                json.dumps(plain(content), indent=1, allow_nan=False) + "\n", encoding="utf-8"
            )

    @contextmanager
    def lock(self) -> Iterator[None]:
        """One run at a time works in the folder; BlockingIOError names the host and process of the
        other one."""
        from filelock import FileLock, Timeout

        self.path(".stages").mkdir(parents=True, exist_ok=True)
        holder = self.path(".stages/.holder")
        held = FileLock(self.path(".stages/.lock"), timeout=0)
        try:
            held.acquire()
        except Timeout:
            other = (
                holder.read_text(encoding="utf-8")[:200] if holder.is_file() else "another process"
            )
            raise BlockingIOError(
                f"results folder {self.folder} is in use by {shown(other)}; wait for it to end, or "
                "choose another folder with --out"
            ) from None
        try:
            with self.writing(".stages/.holder") as path:
                path.write_text(
                    f"process {os.getpid()} on host {socket.gethostname()}", encoding="utf-8"
                )
            yield
        finally:
            held.release()

    @property
    def in_use(self) -> bool:
        """Whether a run works in the folder now; also where that cannot be looked at."""
        from filelock import FileLock, Timeout

        if not self.path(".stages/.lock").is_file():
            return False
        try:
            with FileLock(self.path(".stages/.lock"), timeout=0):
                return False
        except (Timeout, OSError):
            return True

    def read_json(self, name: str) -> dict:
        """Content of a JSON file; InputError where it is absent or damaged."""
        if not self.path(name).is_file():
            raise InputError(f"{self.path(name)} is not there yet")
        try:
            return _json(self.path(name))
        except (ValueError, RecursionError) as error:
            raise InputError(
                f"{self.path(name)} is damaged: {error}; write it anew with --force"
            ) from None

    def record(self, stage: str) -> Finished | None:
        """What the stage left when it last finished.

        None when it has not, or when the record is damaged, no file, or leads or names files
        outside the folder; the user is told.
        """
        path = self.path(".stages") / f"{stage}.json"
        if not os.path.lexists(path):
            return None
        try:
            if not self.path(f".stages/{stage}.json").is_file():
                raise InputError("it is not a file")
            content = _json(path)
            check, record = content.pop("check"), Finished(**content)
            if check != record.check or not isinstance(record.outputs, dict):
                raise InputError("its contents do not belong together")
            for name in record.outputs:
                self.path(name).is_file()
            return record
        except (ValueError, TypeError, AttributeError, LookupError, RuntimeError, OSError) as error:
            _tell_damaged(path, shown(error, 100))
            return None

    def outputs(self, stage: str) -> dict[str, str]:
        """{file: fingerprint} that the stage left; {} when it has not finished."""
        record = self.record(stage)
        return record.outputs if record else {}

    def is_current(self, stage: str, key: str) -> bool:
        """Finished with this key, and its files are still there."""
        record = self.record(stage)
        return (
            record is not None
            and record.key == key
            and all(self.path(o).is_file() for o in record.outputs)
        )

    def edited(self, stage: str) -> list[str]:
        """Files of a stage that somebody has changed since it wrote them."""
        return [
            o
            for o, mark in self.outputs(stage).items()
            if self.path(o).is_file() and fingerprint(self.path(o)) != mark
        ]

    @contextmanager
    def running(self, stage: str) -> Iterator[dict]:
        """Set the record of a stage aside while it runs, so that an interrupted one is simply run
        again.

        Yields the outputs that it had. When it fails before any of them was touched, the record
        comes back.
        """
        record, aside = (self.path(".stages") / f"{stage}.{state}" for state in ("json", "running"))
        outputs = self.outputs(stage)
        for planted in (record, aside):
            _make_way(planted)
        if record.is_file():
            os.replace(record, aside)
        try:
            yield outputs
        except BaseException:
            untouched = all(
                self.path(o).is_file() and fingerprint(self.path(o)) == m
                for o, m in outputs.items()
            )
            if aside.is_file() and untouched:
                os.replace(aside, record)
            raise
        aside.unlink(missing_ok=True)

    def finish(
        self,
        stage: str,
        key: str,
        outputs: Iterable[str],
        seconds: float,
        before: dict | None = None,
    ) -> None:
        """Record the stage; files of its last run that it did not write again are removed.

        before - as in `remove`
        """
        self.remove({name: mark for name, mark in (before or {}).items() if name not in outputs})
        marks = {o: fingerprint(self.path(o)) for o in outputs}
        record = Finished(key, marks, round(seconds, 3))
        _make_way(self.path(".stages") / f"{stage}.json")
        self.write_json(f".stages/{stage}.json", {**record._asdict(), "check": record.check})

    def remove(self, before: dict[str, str]) -> None:
        """Remove files of an earlier run.

        before - {file: fingerprint} of names that a stage declares: a record may be forged. A file
        that has changed since, or that is reached by a link, is not the program's, and stays
        """
        for stale, mark in before.items():
            path = self.path(stale)
            linked = self.path(stale).resolve() != self.folder.resolve() / stale
            if not linked and path.is_file() and fingerprint(path) == mark:
                path.unlink()


def _json(path: Path) -> dict:
    check_size(path)
    return json.loads(path.read_bytes())


def _make_way(record: Path) -> None:
    """Remove a link from the place of a record, and set a folder aside; the program makes
    neither."""
    if record.is_symlink():
        record.unlink()
    elif record.is_dir():
        record.rename(record.with_name(f"{record.name}.{time.time_ns()}"))


@cache
def _tell_damaged(path: Path, reason: str) -> None:
    """Once a process, however often the record is asked for."""
    logging.getLogger("tipdamp").warning(
        "%s is damaged (%s); what it records counts as not run", path, reason
    )


def fingerprint(*parts: Any) -> str:
    """One hash of files (Path), arrays and plain values."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, Path):
            digest.update(_digest(part))
        elif isinstance(part, np.ndarray):
            digest.update(
                f"{part.dtype.str}{part.shape}".encode() + np.ascontiguousarray(part).tobytes()
            )
        else:
            digest.update(json.dumps(plain(part), sort_keys=True).encode())
        digest.update(b"\0")
    return digest.hexdigest()[:16]


def _digest(path: Path) -> bytes:
    check_size(path)
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").digest()
    except OSError as error:
        error.filename = error.filename or str(path)  # a failing disk is told without one
        raise


def plain(value: Any) -> Any:
    """numpy numbers and arrays, tuples and paths as what JSON knows; what is not a finite number
    becomes null."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value if value is None else str(value)
