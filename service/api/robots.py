"""/v1/robots: the catalogue, and robots that users bring."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse

from duocell.models.base.errors import UnknownRobot
from duocell.service.api.bodies import FormBody
from duocell.service.api.ownership import Client, OwnLibrary
from duocell.service.api.state import StateOf
from duocell.service.common.problems import Problem
from duocell.service.http.described import answer, form_body_of, problems
from duocell.service.http.prefer import AsyncPreference, prefers_async
from duocell.service.library.robots import robot_document, robot_list
from duocell.service.schemas.robots import RobotDetail, RobotImport, RobotPage
from duocell.service.schemas.uploads import RobotUpload
from duocell.service.uploads.uploads import begin_robot, drop_robot, take_robot

router = APIRouter(prefix="/v1/robots", tags=["robots"])

RETRY_AFTER = "1"
RobotName = Annotated[str, Path(description="Its name in the list of robots.", examples=["puma560"])]


@router.get(
    "",
    operation_id="list_robots",
    summary="List robots",
    responses={200: answer("All robots."), **problems(500)},
)
def list_robots(library: OwnLibrary) -> RobotPage:
    """Every robot that a request may name."""
    return RobotPage.model_validate({"items": robot_list(library), "next_cursor": None})


@router.post(
    "",
    operation_id="create_robot",
    summary="Bring a robot",
    status_code=201,
    response_model=RobotDetail,
    responses={
        201: answer("Kept; requests may name it.", "Location"),
        202: answer(
            "It is being read, as `Prefer: respond-async` asked. See Location.",
            *("Location", "Retry-After", "Preference-Applied"),
            model=RobotImport,
        ),
        **problems(400, 408, 409, 413, 415, 422, 429, 500, 503),
    },
    openapi_extra=form_body_of(RobotUpload),
)
async def create_robot(
    prefer: AsyncPreference, upload: FormBody, library: OwnLibrary, client: Client, state: StateOf, response: Response
) -> RobotDetail | Response:
    """Send a URDF file, the meshes of its collision geometry in a zip; requests then name the robot like any other.

    The chain runs from `base_link` to `tip`; without them it is the arm of the file: fingers, cameras and `world` are
    not part of it, and `chain` in the answer tells what was chosen and what else could be meant. Meshes are taken
    apart into convex pieces, which takes about a second for each that has dents and was not sent before; with
    `Prefer: respond-async` the answer comes before that and tells where to follow it. Xacro is not expanded.
    """
    if prefers_async(prefer):
        begun = await begin_robot(upload, library, state.import_worker, state.settings, state.imports, client)
        headers = {"Location": begun.href, "Preference-Applied": "respond-async", "Retry-After": RETRY_AFTER}
        return JSONResponse(RobotImport.model_validate(begun).model_dump(mode="json"), 202, headers)
    name = await take_robot(upload, library, state.import_worker, state.settings)
    response.headers["Location"] = f"/v1/robots/{name}"
    return RobotDetail.model_validate(await run_in_threadpool(robot_document, name, library))


@router.get(
    "/{name}",
    operation_id="get_robot",
    summary="See a robot",
    responses={200: answer("The robot."), **problems(404, 500)},
)
def get_robot(name: RobotName, library: OwnLibrary) -> RobotDetail:
    """Joints, limits, frames, reach, where the data come from."""
    try:
        return RobotDetail.model_validate(robot_document(name, library))
    except UnknownRobot as error:
        raise Problem("robot-not-found", error.detail) from error


@router.delete(
    "/{name}",
    operation_id="delete_robot",
    summary="Delete a robot",
    status_code=204,
    responses={204: answer("Gone."), **problems(403, 404, 409, 500, 503)},
)
async def delete_robot(name: RobotName, library: OwnLibrary, state: StateOf) -> None:
    """Its name is free again; layouts that were accepted before are carried out all the same."""
    await run_in_threadpool(drop_robot, name, library, state.settings)
