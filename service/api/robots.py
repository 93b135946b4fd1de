"""/v1/robots: the catalogue."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import JSONResponse, Response

from models.errors import UnknownRobot
from service.problems import Problem
from service.robots import robot_document, robot_list
from service.schemas.resources import ProblemDocument
from service.schemas.robots import RobotDetail, RobotPage

router = APIRouter(prefix="/v1/robots", tags=["robots"])

PROBLEM = {"model": ProblemDocument}


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
def get_robot(name: str) -> Response:
    """Joints, limits, frames, reach, where the data come from."""
    try:
        return JSONResponse(robot_document(name))
    except UnknownRobot as error:
        raise Problem("robot-not-found", error.detail) from error
