"""`import hbm` loads nothing, and each of its public names is there."""

import subprocess
import sys

import pytest

import hbm


@pytest.mark.parametrize("name", hbm.__all__)
def test_public_names_are_there(name):
    assert vars(sys.modules[getattr(hbm, name).__module__])[name] is getattr(hbm, name)


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="module 'hbm' has no attribute 'forced_respons'"):
        hbm.forced_respons       # noqa: B018


def test_nothing_heavy_is_loaded():
    heavy = "print([name for name in ('numpy', 'scipy', 'numba') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", f"import sys, hbm, hbm.laws; {heavy}"], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr
