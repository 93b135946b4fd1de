"""/v1/robots: the catalogue, and robots that users bring."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse, Response

from duocell.models.base.errors import UnknownRobot
from duocell.service.api.ownership import client_of, library_of
from duocell.service.api.state import StateOf
from duocell.service.common.problems import Problem
from duocell.service.http.prefer import prefers_async
from duocell.service.library.robots import robot_document, robot_list
from duocell.service.schemas.resources import ProblemDocument
from duocell.service.schemas.robots import RobotDetail, RobotImport, RobotPage
from duocell.service.uploads.uploads import begin_robot, drop_robot, take_robot

router = APIRouter(prefix="/v1/robots", tags=["robots"])

RETRY_AFTER = "1"
PROBLEM = {"model": ProblemDocument}
RobotName = Annotated[str, Path(description="Its name in the list of robots.", examples=["puma560"])]


@router.get(
    "",
    operation_id="list_robots",
    summary="List robots",
    response_model=None,
    responses={200: {"model": RobotPage, "description": "All robots."}, 500: PROBLEM},
)
def list_robots(request: Request, state: StateOf) -> Response:
    """Every robot that a request may name."""
    return JSONResponse({"items": robot_list(library_of(request, state)), "next_cursor": None})


@router.post(
    "",
    operation_id="create_robot",
    summary="Bring a robot",
    status_code=201,
    response_model=None,
    responses={
        201: {"model": RobotDetail, "description": "Kept; requests may name it."},
        202: {"model": RobotImport, "description": "It is being read, as `Prefer: respond-async` asked. See Location."},
        **dict.fromkeys((400, 408, 409, 413, 415, 422, 429, 500, 503), PROBLEM),
    },
)
async def create_robot(request: Request, state: StateOf) -> Response:
    """Send a URDF file, the meshes of its collision geometry in a zip; requests then name the robot like any other.

    The chain runs from `base_link` to `tip`; without them it is the arm of the file: fingers, cameras and `world` are
    not part of it, and `chain` in the answer tells what was chosen and what else could be meant. Meshes are taken
    apart into convex pieces, which takes about a second for each that has dents and was not sent before; with
    `Prefer: respond-async` the answer comes before that and tells where to follow it. Xacro is not expanded.
    """
    library = library_of(request, state)
    if prefers_async(request.headers.getlist("prefer")):
        begun = await begin_robot(
            request, library, state.import_worker, state.places, state.settings, state.imports, client_of(request)
        )
        headers = {"Location": begun.address, "Preference-Applied": "respond-async", "Retry-After": RETRY_AFTER}
        return JSONResponse(begun.document(), 202, headers)
    name = await take_robot(request, library, state.import_worker, state.places, state.settings)
    document = await run_in_threadpool(robot_document, name, library)
    return JSONResponse(document, 201, {"Location": f"/v1/robots/{name}"})


@router.get(
    "/{name}",
    operation_id="get_robot",
    summary="See a robot",
    response_model=None,
    responses={200: {"model": RobotDetail, "description": "The robot."}, 404: PROBLEM, 500: PROBLEM},
)
def get_robot(name: RobotName, request: Request, state: StateOf) -> Response:
    """Joints, limits, frames, reach, where the data come from."""
    try:
        return JSONResponse(robot_document(name, library_of(request, state)))
    except UnknownRobot as error:
        raise Problem("robot-not-found", error.detail) from error


@router.delete(
    "/{name}",
    operation_id="delete_robot",
    summary="Delete a robot",
    status_code=204,
    response_model=None,
    responses={204: {"description": "Gone."}, 403: PROBLEM, 404: PROBLEM, 409: PROBLEM, 500: PROBLEM, 503: PROBLEM},
)
async def delete_robot(name: RobotName, request: Request, state: StateOf) -> Response:
    """Its name is free again; layouts that were accepted before are carried out all the same."""
    await run_in_threadpool(drop_robot, name, library_of(request, state), state.settings)
    return Response(status_code=204)
