"""Fewer triangles: a frame shows no more of a mesh than its pixels, and software OpenGL pays for every vertex."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

FINE = 1000  # triangles of a mesh that is worth the trouble
FEW = 100  # triangles: a thing so small keeps its own

Faces = npt.NDArray[np.int32]


@contextmanager
def coarse_meshes(model: Any, detail: float) -> Iterator[None]:
    """While OpenGL takes the meshes over, vertices within about `detail` metres are one; collisions never see it."""
    vertices, faces, normals = model.mesh_vert.copy(), model.mesh_face.copy(), model.mesh_facenormal.copy()
    counts = model.mesh_facenum.copy()
    for mesh in np.flatnonzero(counts > FINE):
        _coarsen(model, int(mesh), detail)
    yield
    model.mesh_vert[:], model.mesh_face[:], model.mesh_facenormal[:] = vertices, faces, normals
    model.mesh_facenum[:] = counts


def _coarsen(model: Any, mesh: int, detail: float) -> None:
    """Move vertices to the middle of their cell of a grid, and drop the triangles that this flattens."""
    first, triangles = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    start = model.mesh_vertadr[mesh]
    vertices = model.mesh_vert[start : start + model.mesh_vertnum[mesh]]
    _, cells, sizes = np.unique(np.floor(vertices / detail), axis=0, return_inverse=True, return_counts=True)
    kept = first + np.flatnonzero(_is_whole(cells[model.mesh_face[first : first + triangles]]))
    if len(kept) < FEW:
        return
    middles = np.zeros((len(sizes), 3))
    np.add.at(middles, cells, vertices)
    vertices[:] = (middles / sizes[:, None])[cells]
    for column in (model.mesh_face, model.mesh_facenormal):
        column[first : first + len(kept)] = column[kept]
    model.mesh_facenum[mesh] = len(kept)


def _is_whole(corners: Faces) -> npt.NDArray[np.bool_]:
    """Triangles [n, 3] with three different corners."""
    one, two, three = corners.T
    whole: npt.NDArray[np.bool_] = (one != two) & (two != three) & (three != one)
    return whole
