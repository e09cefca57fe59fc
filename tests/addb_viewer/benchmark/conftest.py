"""One simulated release for all tests of the benchmark."""

import pytest

from tests.addb_viewer.benchmark.simulated_release import write_release


@pytest.fixture(scope="session")
def release(tmp_path_factory):
    return write_release(tmp_path_factory.mktemp("benchmark") / "release")
