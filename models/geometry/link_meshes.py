"""The meshes of a robot's links as convex bodies: within a budget for the whole robot, and taken apart only once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from xml.etree import ElementTree

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.decomposition import MOST_PIECES, Decomposition, decompose
from duocell.models.geometry.meshes import in_metres, read_triangles
from duocell.models.geometry.piece_cache import PieceCache, PiecesInMemory, key_of

MeshSource = Callable[[str], bytes]
"""Gives the contents of a mesh by the ``filename`` of the URDF; raises `FileNotFoundError` or `InvalidInput`."""

MOST_CUTS = 112
"""Cuts that the meshes of a robot share: so 14 links get `MOST_PIECES` each, and 60 links three."""

LONGEST = 20.0
"""m; a longer mesh of what stands is taken for one in millimetres."""

_in_memory = PiecesInMemory()


class LinkMeshes:
    """Convex pieces of the meshes of one robot.

    Args:
        document: its ``<robot>`` element; says how many meshes there are, and how many a link has.
        source: where their contents come from.
        cache: where pieces are kept; None: in the memory of this process.
    """

    def __init__(self, document: ElementTree.Element, source: MeshSource, cache: PieceCache | None = None) -> None:
        self._source = source
        self._cache = _in_memory if cache is None else cache
        self._in_link: Counter[str] = Counter()
        files = set()
        for link in document.findall("link"):
            meshes = [mesh.get("filename", "") for mesh in link.iterfind("collision/geometry/mesh")]
            self._in_link[link.get("name", "")] = len(meshes)
            files |= set(meshes)
        self._most = int(np.clip(1 + MOST_CUTS // max(len(files), 1), 2, MOST_PIECES))

    def pieces(self, link: str, filename: str, scale: Floats, longest: float) -> Decomposition:
        """What stands for a mesh of a link.

        Args:
            link: its name. filename: of the mesh, as the URDF has it.
            scale: (3,) factors to metres.
            longest: m; a longer mesh is refused, it was not made in metres.

        Raises:
            FileNotFoundError: it is not there.
            InvalidInput: it cannot be used.
        """
        data, kind = self._source(filename), filename.rsplit(".", 1)[-1]
        most = max(1, self._most // self._in_link[link])
        key = key_of(data, kind, scale.tolist(), most)
        found = self._cache.find(key)
        if found is None:
            mesh = in_metres(read_triangles(data, kind), scale)
            _check_size(np.ptp(mesh.vertices, axis=0), longest)  # before a second's work
            found = decompose(mesh, most)
            self._cache.keep(key, found)
        _check_size(found.extent, longest)
        return found


def _check_size(extent: Floats, longest: float) -> None:
    """Ask back where a mesh is so long that it cannot be in metres."""
    if float(extent.max()) <= longest:
        return
    metres = " x ".join(f"{side:.4g}" for side in extent)
    millimetres = " x ".join(f"{side / 1000.0:.4g}" for side in extent)
    raise InvalidInput(
        f"the mesh measures {metres} m, and nothing longer than {longest:.3g} m fits this robot. Did you mean "
        f'millimetres ({millimetres} m)? Then add scale="0.001 0.001 0.001" to its <mesh>.',
        "/scale",
    )
