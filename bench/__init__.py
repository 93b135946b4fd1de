"""Benchmarks of duocell: ``python -m bench``."""

import os
import sys
from pathlib import Path

# Before numpy is loaded: one thread for everybody, since the clock counts the CPU time of all threads.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# What is measured are the sources beside this folder, in other processes too, whatever is installed.
_sources = str(Path(__file__).resolve().parents[1] / "src")
sys.path.insert(0, _sources)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [_sources, os.environ.get("PYTHONPATH")]))
