"""Where a server listens, and what it says of that."""

import ipaddress
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.errors import OptionError
from relit.studio.addresses import is_loopback, listen, plain, resolved, urls


@given(st.ip_addresses())
def test_loopback_is_what_the_standard_library_says(address):
    assert is_loopback(str(address)) == address.is_loopback
    assert plain(str(address)) in (address, getattr(address, "ipv4_mapped", None))


@given(st.ip_addresses(v=4))
def test_an_address_in_ipv6_clothes_is_the_same(address):
    assert plain(f"::ffff:{address}") == address


@pytest.mark.parametrize("name", ["", "localhost", "[::1]", "1.2.3", "a" * 300, "127.0.0.1:80"])
def test_names_are_no_addresses(name):
    assert plain(name) is None
    assert not is_loopback(name)


@pytest.mark.parametrize("host", ["", "no.such.name.invalid", "a" * 300, "256.1.1.1"])
def test_what_stands_for_no_address_is_refused(host):
    with pytest.raises(
        OptionError, match=r"^host: expected an address of this machine or a name of one, got "
    ):
        resolved(host)


def test_an_address_stands_for_itself_and_localhost_for_this_machine():
    assert [resolved(host) for host in ("127.0.0.3", "0.0.0.0")] == ["127.0.0.3", "0.0.0.0"]
    assert is_loopback(resolved("localhost"))


def test_a_port_is_taken_once():
    with listen("127.0.0.1", 0, 5) as listener:
        port = listener.getsockname()[1]
        assert urls(listener) == [f"http://127.0.0.1:{port}/"]
        with pytest.raises(OptionError, match=rf"^port: {port} of 127\.0\.0\.1 is taken; .*another --port$"):
            listen("127.0.0.1", port, 5)


def test_an_address_of_another_machine_is_refused():
    with pytest.raises(
        OptionError, match=r"^host: 192\.0\.2\.77 is no address of this machine; .*0\.0\.0\.0"
    ):
        listen("192.0.2.77", 0, 5)


@pytest.mark.parametrize("every", ["0.0.0.0", "::"])
def test_every_address_that_is_told_is_one_that_answers(every):
    try:
        listener = listen(every, 0, 5)
    except OptionError:
        pytest.skip("no IPv6 here")
    with listener:
        told = urls(listener)
        assert len(told) == len(set(told))
        assert any("127.0.0.1" in one for one in told)
        for one in told:
            host, _, port = one.removeprefix("http://").rstrip("/").rpartition(":")
            assert not ipaddress.ip_address(host.strip("[]")).is_unspecified
            socket.create_connection((host.strip("[]"), int(port)), timeout=120).close()
