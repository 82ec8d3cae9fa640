"""Repeated calls give the same bits, wherever their arrays lie."""

import os
import subprocess
import sys

APART = """
{first}
import numpy as np
values = np.random.default_rng(0).normal(size=(200, 12)).view(complex)
memory = np.zeros(64, complex)
far, near = memory[40:43], memory[6:9]
for row in values:
    memory[:6] = row
    np.multiply(memory[:3], memory[3:6], out=far)
    np.multiply(memory[:3], memory[3:6], out=near)
    assert far.tobytes() == near.tobytes()
"""


def test_products_of_complex_numbers_do_not_depend_on_where_they_lie() -> None:
    """Numpy 1.24 on a processor with AVX-512 gives two results without `import tipdamp`."""
    environment = dict(os.environ)
    environment.pop("NPY_DISABLE_CPU_FEATURES", None)  # set by what loaded the tests
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", APART.format(first="import tipdamp")],
        capture_output=True,
        text=True,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
