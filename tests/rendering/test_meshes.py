"""Meshes as OpenGL takes them over: fewer triangles, the same shape, and nothing left changed."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from trainer.rendering.meshes import FINE, coarse_meshes

DETAIL = 0.25  # of a ball with radius 1


@pytest.fixture(scope="module")
def ball() -> mujoco.MjModel:
    """A ball of some thousand triangles."""
    points = np.random.default_rng(0).normal(size=(1500, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    vertices = " ".join(f"{number:.6f}" for number in points.ravel())
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="ball" vertex="{vertices}"/></asset>'
        '<worldbody><geom type="mesh" mesh="ball"/></worldbody></mujoco>'
    )


def triangles(model: mujoco.MjModel) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """The corners [n, 3, 3] that are drawn."""
    return np.asarray(model.mesh_vert[model.mesh_face[: model.mesh_facenum[0]]])


def test_fewer_triangles_have_the_same_shape(ball: mujoco.MjModel) -> None:
    before = triangles(ball)
    with coarse_meshes(ball, DETAIL):
        coarse = triangles(ball)
    assert len(before) > FINE > len(coarse) > 100
    radii = np.linalg.norm(coarse, axis=-1)
    assert radii.min() > 1 - DETAIL
    assert radii.max() < 1.01
    sides = coarse[:, 1] - coarse[:, 0], coarse[:, 2] - coarse[:, 0]
    area = np.linalg.norm(np.cross(*sides), axis=1).sum() / 2
    assert area == pytest.approx(4 * np.pi, rel=0.1)  # closed: no holes


def test_collisions_see_the_mesh_as_it_was(ball: mujoco.MjModel) -> None:
    names = ("mesh_vert", "mesh_face", "mesh_facenormal", "mesh_facenum")
    before = {name: getattr(ball, name).copy() for name in names}
    with coarse_meshes(ball, DETAIL):
        pass
    for name in names:
        np.testing.assert_array_equal(getattr(ball, name), before[name])


def test_what_would_vanish_stays(ball: mujoco.MjModel) -> None:
    before = triangles(ball)
    with coarse_meshes(ball, 5.0):
        np.testing.assert_array_equal(triangles(ball), before)
