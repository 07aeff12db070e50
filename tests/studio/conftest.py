"""A client of the studio, and a session with the samples in it."""

import pytest

from relit.studio.app import create_app
from tests.served import served
from tests.studio.api import API


@pytest.fixture(scope="module")
def client():
    with served(create_app()) as client:
        yield client


@pytest.fixture
def place(client):
    """A session's address, with the sample photos in it."""
    address = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
    assert client.post(f"{address}/samples").status_code == 200
    yield address
    assert client.delete(address).status_code == 204
