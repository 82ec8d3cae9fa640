"""The results folder: what each stage left there, what it was made from, and whether it still is up to date."""

import hashlib
import json
import os
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hbm.errors import InputError


@dataclass(frozen=True)
class Store:
    """A folder of plain files, with a small record `.stages/<stage>.json` for each stage that has finished."""

    folder: Path

    def path(self, name: str) -> Path:
        return self.folder / name

    @contextmanager
    def writing(self, name: str):
        """A temporary path that takes its final name only when the block ends well: no partial file is ever left."""
        final = self.path(name)
        final.parent.mkdir(parents=True, exist_ok=True)
        temporary = final.with_name(f".tmp-{os.getpid()}-{final.name}")
        try:
            yield temporary
            if temporary.is_file():
                os.replace(temporary, final)
        finally:
            temporary.unlink(missing_ok=True)

    def write_json(self, name: str, content: dict) -> None:
        with self.writing(name) as path:
            path.write_text(json.dumps(plain(content), indent=1, allow_nan=False) + "\n", encoding="utf-8")

    def read_json(self, name: str) -> dict:
        if not self.path(name).is_file():
            raise InputError(f"{self.path(name)} is not there yet")
        return json.loads(self.path(name).read_text(encoding="utf-8"))

    def record(self, stage: str) -> dict | None:
        """What the stage left when it last finished: {key, outputs, seconds}; None when it has not."""
        path = self.path(f".stages/{stage}.json")
        try:
            return json.loads(path.read_text(encoding="utf-8"))
        except (FileNotFoundError, json.JSONDecodeError):
            return None

    def is_current(self, stage: str, key: str) -> bool:
        """Finished with this key, and its files are still there."""
        record = self.record(stage)
        return bool(record) and record["key"] == key and all(self.path(o).is_file() for o in record["outputs"])

    def edited(self, stage: str) -> list[str]:
        """Files of a stage that somebody has changed since it wrote them."""
        outputs = (self.record(stage) or {"outputs": {}})["outputs"]
        return [o for o, mark in outputs.items() if self.path(o).is_file() and fingerprint(self.path(o)) != mark]

    @contextmanager
    def running(self, stage: str):
        """Set the record of a stage aside while it runs, so that an interrupted one is simply run again.

        Yields the outputs that it had. When it fails before any of them was touched, the record comes back.
        """
        record, aside = self.path(f".stages/{stage}.json"), self.path(f".stages/{stage}.running")
        outputs = (self.record(stage) or {"outputs": {}})["outputs"]
        if record.is_file():
            os.replace(record, aside)
        try:
            yield outputs
        except BaseException:
            untouched = all(self.path(o).is_file() and fingerprint(self.path(o)) == m for o, m in outputs.items())
            if aside.is_file() and untouched:
                os.replace(aside, record)
            raise
        aside.unlink(missing_ok=True)

    def finish(self, stage: str, key: str, outputs, seconds: float, before=()) -> None:
        """Record the stage; files of its last run (`before`) that it did not write again are removed."""
        for stale in set(before) - set(outputs):
            self.path(stale).unlink(missing_ok=True)
        marks = {o: fingerprint(self.path(o)) for o in outputs}
        self.write_json(f".stages/{stage}.json", {"key": key, "outputs": marks, "seconds": round(seconds, 3)})


def fingerprint(*parts) -> str:
    """One hash of files (Path) and plain values."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, Path):
            digest.update(hashlib.sha256(part.read_bytes()).digest())
        else:
            digest.update(json.dumps(plain(part), sort_keys=True).encode())
        digest.update(b"\0")
    return digest.hexdigest()[:16]


def plain(value):
    """numpy numbers and arrays, tuples and paths as what JSON knows; what is not a finite number becomes null."""
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
