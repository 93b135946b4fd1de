"""Benchmarks of duocell: ``python -m bench``."""

import os

# Before numpy is loaded: one thread for everybody, since the clock counts the CPU time of all threads.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
