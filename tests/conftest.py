"""For all tests: no fixed times. A busy computer is slow, and that is no fault of the code."""

import os

import pytest
from hypothesis import settings

from tests.postgres import Server, programs

# daemons of tests that run side by side: each page takes a free port
os.environ.setdefault("TRIBOWATCH_PAGE__LISTEN", "127.0.0.1:0")

settings.register_profile("patient", deadline=None, print_blob=True)
settings.load_profile("patient")


@pytest.fixture(scope="session")
def postgres():
    """A PostgreSQL server of this test process."""
    pytest.importorskip("psycopg", reason="psycopg is not installed")
    if programs() is None:
        pytest.skip("no PostgreSQL server is installed here (apt-get install postgresql)")
    server = Server()
    yield server
    server.close()


@pytest.fixture(params=["sqlite", "postgresql"])
def history_url(request, tmp_path):
    """An empty history in each kind of database."""
    if request.param == "postgresql":
        return request.getfixturevalue("postgres").database()
    return f"sqlite:///{tmp_path / 'history.db'}"


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def module_history_url(request, tmp_path_factory):
    """The same, shared by the tests of a module."""
    if request.param == "postgresql":
        return request.getfixturevalue("postgres").database()
    return f"sqlite:///{tmp_path_factory.mktemp('history') / 'history.db'}"
