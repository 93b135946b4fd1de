"""/v1/meshes: solids that users bring, for obstacles, parts and tools."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse, Response

from duocell.service.api.ownership import library_of
from duocell.service.api.state import StateOf
from duocell.service.library.meshes import mesh_address, mesh_list, mesh_resource
from duocell.service.schemas.meshes import MeshPage, UploadedMesh
from duocell.service.schemas.resources import ProblemDocument
from duocell.service.uploads.uploads import drop_mesh, no_mesh, take_mesh

router = APIRouter(prefix="/v1/meshes", tags=["meshes"])

PROBLEM = {"model": ProblemDocument}


@router.post(
    "",
    operation_id="create_mesh",
    summary="Bring a mesh",
    status_code=201,
    response_model=None,
    responses={
        200: {"model": UploadedMesh, "description": "The same file was sent before; it keeps the name it got then."},
        201: {"model": UploadedMesh, "description": "Kept; requests may name it."},
        **dict.fromkeys((400, 408, 409, 413, 415, 422, 429, 500, 503), PROBLEM),
    },
)
async def create_mesh(request: Request, state: StateOf) -> Response:
    """Send an STL or OBJ file; shapes of requests then refer to its `id`.

    It is taken apart into convex pieces, which takes seconds if it has dents. Nothing but the triangles is read.
    """
    library = library_of(request, state)
    mesh, new = await take_mesh(request, library, state.import_worker, state.places, state.settings)
    return JSONResponse(mesh_resource(mesh), 201 if new else 200, {"Location": mesh_address(mesh)})


@router.get(
    "",
    operation_id="list_meshes",
    summary="List meshes",
    response_model=None,
    responses={200: {"model": MeshPage, "description": "All meshes."}, 500: PROBLEM},
)
def list_meshes(request: Request, state: StateOf) -> Response:
    """Every mesh that a request may refer to, by name."""
    return JSONResponse({"items": mesh_list(library_of(request, state)), "next_cursor": None})


@router.get(
    "/{mesh_id}",
    operation_id="get_mesh",
    summary="See a mesh",
    response_model=None,
    responses={200: {"model": UploadedMesh, "description": "The mesh."}, 404: PROBLEM, 500: PROBLEM},
)
def get_mesh(mesh_id: str, request: Request, state: StateOf) -> Response:
    """Its size, in the units of its file, and what it was taken apart into."""
    mesh = library_of(request, state).user_mesh(mesh_id)
    if mesh is None:
        raise no_mesh(mesh_id)
    return JSONResponse(mesh_resource(mesh))


@router.delete(
    "/{mesh_id}",
    operation_id="delete_mesh",
    summary="Delete a mesh",
    status_code=204,
    response_model=None,
    responses={204: {"description": "Gone."}, 403: PROBLEM, 404: PROBLEM, 500: PROBLEM, 503: PROBLEM},
)
async def delete_mesh(mesh_id: str, request: Request, state: StateOf) -> Response:
    """No further request may refer to it; layouts that were accepted before are carried out all the same."""
    await run_in_threadpool(drop_mesh, mesh_id, library_of(request, state), state.settings)
    return Response(status_code=204)
