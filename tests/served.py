"""The studio's server, run beside a test."""

import contextlib
import queue
import threading

import httpx

from relit.studio.server import Server


@contextlib.contextmanager
def served(app, host="127.0.0.1", **settings):
    """Run an application on a free port, and lend a client of it; the settings are the server's."""
    address = queue.Queue()
    server = Server(app, host, 0, address.put, **settings)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        with httpx.Client(base_url=address.get(timeout=120), timeout=300) as client:
            yield client
    finally:
        server.should_exit = True
        thread.join(30)
