"""Imported once by the process that all workers are forked from: loads the engines and solves once.

A worker so starts in milliseconds, warm, and shares the memory of what is loaded here with the others.
"""

from __future__ import annotations

import gc

from duocell.service.requests import reading  # noqa: F401  # what reads requests is forked from here too
from duocell.service.schemas import uploads  # noqa: F401  # what reads task files too: their parsers, and the answer
from duocell.service.workers import worker

worker.self_test()
# What is loaded stays: a collector that looks through it again and again takes a third of the time of reading a large
# request, and writes to memory that the workers share.
gc.collect()
gc.freeze()
