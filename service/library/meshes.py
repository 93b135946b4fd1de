"""Uploaded meshes as JSON documents."""

from __future__ import annotations

from typing import Any

from duocell.service.library.library import Library
from duocell.service.library.user_mesh import UserMesh


def mesh_list(library: Library) -> list[dict[str, Any]]:
    """All meshes by name."""
    found = (library.user_mesh(mesh_id) for mesh_id in library.mesh_ids())
    meshes = sorted((mesh for mesh in found if mesh is not None), key=lambda mesh: (mesh.name, mesh.id))
    return [mesh_resource(mesh) for mesh in meshes]


def mesh_resource(mesh: UserMesh) -> dict[str, Any]:
    """A mesh."""
    return {
        "id": mesh.id,
        "name": mesh.name,
        "format": mesh.kind,
        "size": mesh.size,
        "triangles": mesh.triangles,
        "bounding_box": {"lower": mesh.bounds[0].tolist(), "upper": mesh.bounds[1].tolist()},
        "pieces": len(mesh.pieces),
        "depth": mesh.depth,
        "left_out": mesh.left_out,
        "created_at": mesh.created_at,
        "href": mesh_address(mesh),
    }


def mesh_address(mesh: UserMesh) -> str:
    """Address of a mesh."""
    return f"/v1/meshes/{mesh.id}"
