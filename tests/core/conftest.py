"""Runs that several test modules look at; none of them changes what it is given."""

import pytest

from core import Settings, reconstruct
from core.surface.choice import Choice
from tests import shapes

RESOLUTION = 48


@pytest.fixture
def at_offset(monkeypatch):
    """Runs that extract double covers at an offset, of surfaces with two sides as well."""
    monkeypatch.setattr(Choice, "_may_be_sheet", lambda _: False)


@pytest.fixture(scope="session")
def sphere_run():
    return reconstruct(shapes.sphere(1500), Settings(resolution=RESOLUTION))


@pytest.fixture(scope="session")
def hemisphere_run():
    return reconstruct(shapes.hemisphere(1500), Settings(resolution=RESOLUTION))


@pytest.fixture(scope="session")
def disc_run():
    return reconstruct(shapes.disc(800), Settings(resolution=RESOLUTION))


@pytest.fixture(scope="session")
def moebius_run():
    return reconstruct(shapes.moebius(1500), Settings(resolution=64))


@pytest.fixture(scope="session")
def torus_run():
    return reconstruct(shapes.torus(2000), Settings(resolution=RESOLUTION))


@pytest.fixture(scope="session")
def sheets_run():
    """Two squares of side 2, a tenth apart: more than two cells, less than two local spacings."""
    return reconstruct(shapes.sheets(2000, gap=0.1), Settings(resolution=RESOLUTION, offset=0.5))
