"""/v1/robots: the catalogue."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path
from fastapi.responses import JSONResponse, Response

from models.errors import UnknownRobot
from service.problems import Problem
from service.robots import robot_document, robot_list
from service.schemas.resources import ProblemDocument
from service.schemas.robots import RobotDetail, RobotPage

router = APIRouter(prefix="/v1/robots", tags=["robots"])

PROBLEM = {"model": ProblemDocument}
RobotName = Annotated[str, Path(description="Its name in the list of robots.", examples=["puma560"])]


@router.get(
    "",
    operation_id="list_robots",
    summary="List robots",
    response_model=None,
    responses={200: {"model": RobotPage, "description": "All robots."}, 500: PROBLEM},
)
def list_robots() -> Response:
    """Every robot that a request may name."""
    return JSONResponse({"items": robot_list(), "next_cursor": None})


@router.get(
    "/{name}",
    operation_id="get_robot",
    summary="See a robot",
    response_model=None,
    responses={200: {"model": RobotDetail, "description": "The robot."}, 404: PROBLEM, 500: PROBLEM},
)
def get_robot(
    name: RobotName,
) -> Response:
    """Joints, limits, frames, reach, where the data come from."""
    try:
        return JSONResponse(robot_document(name))
    except UnknownRobot as error:
        raise Problem("robot-not-found", error.detail) from error
