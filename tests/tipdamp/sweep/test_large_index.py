"""An index of 10 000 cases costs as many statements and files as one of ten: one store, one index.
Seconds are those of tests/benchmarks/sweeps.py."""

import os
import sqlite3
import zipfile

import pytest

from tests.tipdamp.sweep import large_index
from tipdamp.sweep.index import Index
from tipdamp.sweep.run import _Running
from tipdamp.sweep.summary import status
from tipdamp.sweep.work import SweepWork

CASES = 10_000
FOLDERS = 256  # of the finished steps, by the first two digits of their keys


class Here:
    """Of one process."""

    jobs, at_once = 1, True


@pytest.fixture
def asked(monkeypatch):
    """[statement] that was sent to an index, and [path] of archives and folders that were read."""
    statements, read = [], []
    connect, listdir, archive = sqlite3.connect, os.listdir, zipfile.ZipFile

    def traced(*arguments, **options):
        base = connect(*arguments, **options)
        base.set_trace_callback(statements.append)
        return base

    monkeypatch.setattr("tipdamp.sweep.index.sqlite3.connect", traced)
    monkeypatch.setattr(os, "listdir", lambda path: read.append(path) or listdir(path))
    monkeypatch.setattr(zipfile, "ZipFile", lambda *a, **k: read.append(a[0]) or archive(*a, **k))
    return statements, read


def operations(folder, whole):
    """What opens the index: the status, what a sweep that goes on takes stock of, and all rows."""
    assert f"{len(whole.cases)} of {len(whole.cases)} cases done" in status(folder)[0]
    with Index(folder, write=True) as index:
        sweep = _Running(SweepWork(folder, {}, folder), whole, index, Here())
        sweep.take_stock(False)
        assert not len(sweep.tasks) and len(sweep.made) == len(whole.cases) + 1
    with Index(folder) as index:
        assert index.counts() == {"done": len(whole.cases)}
        assert len(index.curves()) == 2 * len(whole.cases) and not index.stresses()
        assert index.costs() and not index.levels()


@pytest.mark.slow
def test_statements_and_files_do_not_grow_with_the_cases(tmp_path, asked):
    statements, read = asked
    counted = {}
    for count in (10, CASES):
        (tmp_path / str(count)).mkdir()
        whole = large_index.write(tmp_path / str(count), count)
        del statements[:], read[:]
        operations(tmp_path / str(count), whole)
        counted[count] = len(statements), len(read)
    assert counted[CASES][0] == counted[10][0]
    assert counted[10][1] <= 11 and counted[CASES][1] <= FOLDERS


def test_no_statement_reads_a_table_for_each_row_of_another(tmp_path, asked):
    """Each reads one table from end to end and finds its rows of the others by their keys."""
    whole = large_index.write(tmp_path, 10)
    statements, _ = asked
    del statements[:]
    operations(tmp_path, whole)
    plans = {}
    with Index(tmp_path) as index:
        for one in [text for text in statements if text.startswith("select")]:
            plans[one] = [row[3] for row in index.base.execute(f"explain query plan {one}")]
    assert len(plans) > 8
    for one, steps in plans.items():
        tables = [s for s in steps if s.startswith("SCAN") and "(subquery" not in s]
        assert len(tables) == 1, (one, steps)
