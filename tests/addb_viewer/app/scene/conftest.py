"""A server that nobody looks at."""

import pytest
import trimesh

from addb_viewer.app.scene.scene import TrialScene
from addb_viewer.app.security.server import open_server

MESHES = {"pelvis": trimesh.creation.box((0.2, 0.2, 0.3))}


@pytest.fixture(scope="module")
def server():
    server = open_server(port=0)
    yield server
    server.stop()


@pytest.fixture
def scene(server, make_replay):
    """Of a walk."""
    scene = TrialScene(server)
    scene.show(make_replay(), MESHES)
    return scene
