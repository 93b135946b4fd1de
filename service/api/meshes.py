"""/v1/meshes: solids that users bring, for obstacles, parts and tools."""

from __future__ import annotations

from fastapi import APIRouter, Response
from fastapi.concurrency import run_in_threadpool

from duocell.service.api.bodies import FormBody
from duocell.service.api.ownership import OwnLibrary
from duocell.service.api.state import StateOf
from duocell.service.http.described import answer, form_body_of, problems
from duocell.service.library.meshes import mesh_address, mesh_list, mesh_resource
from duocell.service.schemas.meshes import MeshPage, UploadedMesh
from duocell.service.schemas.uploads import MeshUpload
from duocell.service.uploads.uploads import drop_mesh, no_mesh, take_mesh

router = APIRouter(prefix="/v1/meshes", tags=["meshes"])


@router.post(
    "",
    operation_id="create_mesh",
    summary="Bring a mesh",
    status_code=201,
    responses={
        200: answer("The same file was sent before; it keeps the name it got then.", "Location", model=UploadedMesh),
        201: answer("Kept; requests may name it.", "Location"),
        **problems(400, 408, 409, 413, 415, 422, 429, 500, 503),
    },
    openapi_extra=form_body_of(MeshUpload),
)
async def create_mesh(upload: FormBody, library: OwnLibrary, state: StateOf, response: Response) -> UploadedMesh:
    """Send an STL or OBJ file; shapes of requests then refer to its `id`.

    It is taken apart into convex pieces, which takes seconds if it has dents. Nothing but the triangles is read.
    """
    mesh, new = await take_mesh(upload, library, state.import_worker, state.settings)
    response.status_code = 201 if new else 200
    response.headers["Location"] = mesh_address(mesh)
    return UploadedMesh.model_validate(mesh_resource(mesh))


@router.get(
    "",
    operation_id="list_meshes",
    summary="List meshes",
    responses={200: answer("All meshes."), **problems(500)},
)
def list_meshes(library: OwnLibrary) -> MeshPage:
    """Every mesh that a request may refer to, by name."""
    return MeshPage.model_validate({"items": mesh_list(library), "next_cursor": None})


@router.get(
    "/{mesh_id}",
    operation_id="get_mesh",
    summary="See a mesh",
    responses={200: answer("The mesh."), **problems(404, 500)},
)
def get_mesh(mesh_id: str, library: OwnLibrary) -> UploadedMesh:
    """Its size, in the units of its file, and what it was taken apart into."""
    mesh = library.user_mesh(mesh_id)
    if mesh is None:
        raise no_mesh(mesh_id)
    return UploadedMesh.model_validate(mesh_resource(mesh))


@router.delete(
    "/{mesh_id}",
    operation_id="delete_mesh",
    summary="Delete a mesh",
    status_code=204,
    responses={204: answer("Gone."), **problems(403, 404, 500, 503)},
)
async def delete_mesh(mesh_id: str, library: OwnLibrary, state: StateOf) -> None:
    """No further request may refer to it; layouts that were accepted before are carried out all the same."""
    await run_in_threadpool(drop_mesh, mesh_id, library, state.settings)
