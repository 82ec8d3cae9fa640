"""One run at a time in a results folder."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.store import Store

HOLD = """
import sys
from pathlib import Path
from tipdamp.store import Store
with Store(Path(sys.argv[1])).lock():
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_run_names_the_first(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    store = Store(tmp_path / "results" / "corner")
    holder = subprocess.Popen([sys.executable, "-c", HOLD, str(store.folder)], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[3])
    assert holder.stdout.readline() == "held\n"
    assert main(["reduce", str(path), "--quiet"]) == 4
    said = capsys.readouterr().err
    assert f"in use by process {holder.pid} on host" in said and said.count("\n") == 1
    holder.communicate()
    assert main(["reduce", str(path), "--quiet"]) == 0


def test_the_lock_is_released_after_a_failure(tmp_path):
    store = Store(tmp_path)
    with pytest.raises(ValueError, match="failed"), store.lock():
        raise ValueError("failed")
    with store.lock(), pytest.raises(BlockingIOError, match="in use by process"), store.lock():
        pass
