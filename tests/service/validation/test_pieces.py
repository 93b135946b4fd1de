"""Meshes of many pieces, named many times in few bytes."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest

from duocell.service.common.issues import InvalidRequest
from duocell.service.library.library import Library
from duocell.service.library.user_mesh import UserMesh, mesh_document
from duocell.service.requests.accept import accept
from duocell.service.schemas.request import EXAMPLE
from duocell.service.settings import Limits

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def library_with(folder: Path, pieces: int) -> Library:
    library = Library(folder)
    mesh = UserMesh(
        "m", "m", "stl", 100, 4, np.array([[0.0] * 3, [1.0] * 3]), (CORNERS,) * pieces, "2026-01-01T00:00:00Z"
    )
    assert library.mesh_store.put("m", mesh_document(mesh))
    return library


@pytest.mark.parametrize("place", ["obstacles", "part", "tool_shapes"])
def test_pieces_of_all_meshes_are_limited_together(tmp_path: Path, place: str) -> None:
    library = library_with(tmp_path, 30)
    request = copy.deepcopy(EXAMPLE)
    shape = {"type": "mesh", "id": "m"}
    if place == "obstacles":
        request["obstacles"] = [{"name": str(k), "shape": shape} for k in range(4)]
    elif place == "part":
        request["part"] = {"shapes": [{"shape": shape}] * 4}
    else:
        request["arms"][0]["tool_shapes"] = [{"shape": shape}] * 4
    body = json.dumps(request).encode()
    with pytest.raises(InvalidRequest, match="120 convex pieces, 30 of them here; allowed are 119") as refused:
        accept(body, Limits(max_pieces=119), library)
    assert refused.value.code == "too-large"
    assert accept(body, Limits(max_pieces=120), library).name == EXAMPLE["name"]
