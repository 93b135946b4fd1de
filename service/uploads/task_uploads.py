"""Task files that users send: taken in like other uploads, read in a process of their own, kept nowhere."""

from __future__ import annotations

from math import isfinite

from duocell.models.task_files.found import ARC_TOLERANCE, Options
from duocell.models.task_files.reading import Resampling
from duocell.service.common.issues import InvalidRequest, Issue, IssueCollector, shortened
from duocell.service.schemas.uploads import TaskUpload
from duocell.service.settings import Limits, Settings
from duocell.service.uploads.arrival import Parts, Upload, arrived
from duocell.service.uploads.task_import import ANGLE_TOLERANCE, task_text
from duocell.service.validation.count_limits import CODE
from duocell.service.workers.import_worker import ImportWorker

TASK_FORM = Parts(
    texts=tuple(name for name in TaskUpload.model_fields if name != "file"), files=("file",), required=("file",)
)


async def take_task(upload: Upload, worker: ImportWorker, settings: Settings) -> str:
    """JSON of the task in the form of an upload, and of what it was taken for.

    Raises:
        Problem: the body is no form or too large.
        InvalidRequest: the file cannot be understood.
    """
    async with arrived(upload, TASK_FORM) as form:
        file = form.files["file"]
        options, resampling = options_of(form.texts)
        if len(file.data) > settings.max_body:
            detail = f"The file has more than {settings.max_body} bytes (DUOCELL_MAX_BODY). Split it."
            raise InvalidRequest([Issue("/file", detail, CODE)])
        limits = Limits(**settings.model_dump())
        return await worker.run(task_text, file.data, file.name, options, resampling, limits)


def options_of(texts: dict[str, str]) -> tuple[Options, Resampling | None]:
    """What the sender of a form says about its file.

    Raises:
        InvalidRequest: a tolerance is no positive number.
    """
    issues = IssueCollector()
    tolerance = _tolerance(texts, "tolerance", issues)
    angle = _tolerance(texts, "angle_tolerance", issues)
    if angle is not None and tolerance is None and not issues.found:
        issues.add("/tolerance", "'tolerance' is missing beside angle_tolerance; it is needed with it. Add it.")
    issues.raise_any()
    columns = texts.get("columns")
    options = Options(
        format=texts.get("format"),
        units=texts.get("units"),
        rotation=texts.get("rotation"),
        columns=None if columns is None else tuple(name.strip() for name in columns.split(",")),
        arc_tolerance=ARC_TOLERANCE if tolerance is None else tolerance,
    )
    return options, None if tolerance is None else Resampling(tolerance, ANGLE_TOLERANCE if angle is None else angle)


def _tolerance(texts: dict[str, str], name: str, issues: IssueCollector) -> float | None:
    """A positive number of a form."""
    text = texts.get(name)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not isfinite(value) or value <= 0.0:
        issues.add(f"/{name}", f"'{name}' is {shortened(text)}; a number greater than 0 is needed. Correct it.")
        return None
    return value
