"""The joint values of a layout as a table (CSV, RFC 4180), for spreadsheets and robot programs."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from io import StringIO
from typing import Any

from duocell.service.exports.export import NothingToExport


def joint_table(resource: Mapping[str, Any]) -> bytes:
    """One row per arm and pose: name, number of the pose from 0, joint values [rad; m of a joint that shifts].

    Arms with fewer joints than others leave the last cells empty.

    Args:
        resource: a layout as `GET /v1/layouts/{id}` answers it.

    Raises:
        NothingToExport: no arm is placed.
    """
    arms = resource["result"]["arms"]
    most = max((len(values) for arm in arms for values in arm["joints"]), default=0)
    if most == 0:
        raise NothingToExport("No arm has joint values, because no layout was found.")
    text = StringIO(newline="")
    rows = csv.writer(text)
    rows.writerow(["arm", "pose", *(f"joint_{number}" for number in range(1, most + 1))])
    for arm in arms:
        name = _as_text(arm["name"])
        rows.writerows([name, pose, *values, *[""] * (most - len(values))] for pose, values in enumerate(arm["joints"]))
    return text.getvalue().encode()


def _as_text(name: str) -> str:
    """A name that a spreadsheet takes for text: what begins like a formula would be calculated."""
    return f"'{name}" if name[:1] in ("=", "+", "-", "@") else name
