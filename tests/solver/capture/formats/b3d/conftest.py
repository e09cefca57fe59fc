"""The subject that most of these tests write and read."""

import pytest


@pytest.fixture
def subject(small_b3d):
    return small_b3d
