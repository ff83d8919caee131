"""Phantoms of one or two levels, built once; distances kept in a folder of the tests' own."""

import pytest

from tendonrod.anatomy import Phantom, building, load_phantom, loading
from tendonrod.surface import Cylinder


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TENDONROD_CACHE", str(tmp_path_factory.mktemp("distances")))
        yield


@pytest.fixture(scope="session")
def printed(_own_cache) -> Phantom:
    return load_phantom("printed", levels="T11")


@pytest.fixture(scope="session")
def anatomical(_own_cache) -> Phantom:
    return load_phantom("anatomical", levels="T11")


@pytest.fixture
def without_distances(monkeypatch):
    """Phantoms are built without their distances, which take their time and which not every test asks for."""
    monkeypatch.setattr(building, "_around", lambda *_: Cylinder(point=(0, 0, 0), axis=(0, 0, 1), radius=3e-3))
    monkeypatch.setattr(loading, "_built", loading._built.__wrapped__)


@pytest.fixture(params=["printed", "anatomical"])
def either(request) -> Phantom:
    return request.getfixturevalue(request.param)
