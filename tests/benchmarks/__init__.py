"""Benchmarks run on one thread: that is set here, before numpy loads its BLAS (`record.one_thread`
makes sure)."""

import os
import sys

if "numpy" not in sys.modules:
    os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
