"""Results that older versions have stored: words and versions stay, and what they did not tell is null."""

from __future__ import annotations

import copy
import json
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from duocell.service.common.database_url import FILE, sqlite_url
from duocell.service.jobs.job import Job, JobStatus
from duocell.service.jobs.job_store import JobFilter
from duocell.service.jobs.resources import layout_text, summary
from duocell.service.results.older_results import completed
from duocell.service.schemas.result import LayoutResult
from duocell.service.store.sql import SqlJobStore

Document = dict[str, Any]
OLD = Path(__file__).parents[2] / "data" / "store" / "revision_0001.sqlite3"

ARM: Document = {
    "name": "main",
    "base": {
        "position": [0.1, 0.2, 0.0],
        "yaw": 0.5,
        "pose": {"position": [0.1, 0.2, 0.0], "orientation": {"quaternion": [0.0, 0.0, 0.25, 0.97]}},
    },
    "posture": None,
    "objective": 1.5,
    "joints": [[0.0] * 6] * 2,
    "minimum_margin": 1.0,
    "joint_margins": [1.0, 2.0, 3.0, 4.0, 5.0, None],
    "minimum_conditioning": 0.1,
    "characteristic_length": 0.3,
    "singularity_distances": {},
    "geometry": "cited",
}
NOTHING = {"arm_arm": None, "arm_part": None, "arm_obstacle": None, "part_obstacle": None, "self": None}
PROOF: Document = {"lower_bound": 1.49, "gap": 0.007, "proved": True, "boxes": 7, "wall_time": 0.1}
RESULT: Document = {
    "outcome": "optimal",
    "objective": 1.5,
    "jobs": [{"name": "", "first_pose": 0, "poses": 2, "weight": 1.0, "objective": 1.5}],
    "arms": [ARM],
    "reasons": [],
    "proved": False,
    "search": {"candidates": 1024, "starts": 1, "basins": 1, "wall_time": 0.05},
    "certificate": {**PROOF, "arms": [{"arm": "main", **PROOF, "note": ""}]},
    "baselines": [],
    "clearances": NOTHING,
    "alternatives": [
        {"objective": 2.0, "arms": [ARM], "clearances": NOTHING, "note": 'the "first_feasible_time": field'}
    ],
    "tolerance": None,
    "explanation": None,
    "verification": None,
    "version": "0.1.0",
    "request_hash": "0" * 64,
}
"""As it was stored when every search that ended was called optimal."""


def test_what_an_older_result_did_not_tell_is_null_and_its_word_stays() -> None:
    found = json.loads(completed(json.dumps(RESULT)))
    read = LayoutResult.model_validate(found)
    assert (read.outcome, read.proved, read.version) == ("optimal", False, "0.1.0")
    assert (read.search.ended, read.search.first_feasible_time) == (None, None)
    assert read.arms[0].singularities is read.alternatives[0].arms[0].singularities is None
    assert read.certificate is not None
    assert read.certificate.ended is None
    assert {name: value for name, value in found.items() if RESULT.get(name) == value}.keys() >= {"jobs", "reasons"}


def test_an_older_result_without_proof_or_alternatives_gets_neither() -> None:
    plain = {key: value for key, value in RESULT.items() if key != "alternatives"} | {"certificate": None}
    found = json.loads(completed(json.dumps(plain)))
    assert found["certificate"] is None
    assert "alternatives" not in found
    assert found["warnings"] == []
    assert found["arms"][0] == ARM | {"singularities": None}


def test_what_an_older_result_did_tell_is_kept() -> None:
    told = copy.deepcopy(RESULT)
    told["search"]["first_feasible_time"] = 0.02
    told["certificate"]["ended"] = True
    told["arms"][0]["singularities"] = "avoid"
    found = json.loads(completed(json.dumps(told)))
    assert found["search"] == told["search"] | {"ended": None}
    assert found["certificate"]["ended"] is True
    assert found["arms"][0]["singularities"] == "avoid"


def test_a_result_of_this_version_is_left_as_it_is() -> None:
    newest = copy.deepcopy(RESULT)
    newest["search"] |= {"ended": True, "first_feasible_time": 0.01}
    newest["warnings"] = []
    text = json.dumps(newest, indent=3)
    assert completed(text) is text


def test_an_older_result_is_served_with_its_version_beside_its_word(tmp_path: Path) -> None:
    shutil.copy(OLD, tmp_path / FILE)
    store = SqlJobStore(sqlite_url(tmp_path))
    store.open()
    (head,) = [job for job in store.page(10, None, JobFilter()) if job.status is JobStatus.SUCCEEDED]
    listed = summary(head)
    assert (listed.outcome, listed.version) == ("optimal", "0.1.0")
    whole = store.get(head.id)
    store.close()
    assert whole is not None
    served = json.loads(layout_text(whole))["result"]
    assert (served["outcome"], served["version"]) == ("optimal", "0.1.0")
    assert served["search"]["ended"] is None


def test_a_job_without_a_result_has_none() -> None:
    job = Job("0" * 32, "", "", JobStatus.QUEUED, datetime.now(UTC), "{}", "0" * 64)
    assert json.loads(layout_text(job))["result"] is None
