"""Where a server listens, and by which addresses it is reached."""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterator
from contextlib import suppress
from ipaddress import IPv4Address, IPv6Address, ip_address

from relit.errors import OptionError

#: Addresses that no machine has (RFC 5737, RFC 3849): the way to them starts at this machine's own address.
_ELSEWHERE = ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1"))
#: What does not let a server listen, and what to do about it.
_HINDRANCES = {
    errno.EADDRINUSE: "port: {port} of {host} is taken; end what listens there, or give another --port",
    errno.EADDRNOTAVAIL: "host: {host} is no address of this machine; give one that is, 0.0.0.0 for all",
    errno.EACCES: "port: {port} is not for this user to listen at; give a --port of 1024 or more",
}


def plain(address: str) -> IPv4Address | IPv6Address | None:
    """Return an address as an object, that of IPv4 where IPv6 wraps one; None if it is a name.

    Examples
    --------
    >>> plain("::ffff:10.0.0.5"), plain("light.team")
    (IPv4Address('10.0.0.5'), None)
    """
    try:
        found = ip_address(address)
    except ValueError:
        return None
    return getattr(found, "ipv4_mapped", None) or found


def is_loopback(address: str) -> bool:
    """Return whether an address is of this machine alone.

    Examples
    --------
    >>> [is_loopback(address) for address in ("127.0.0.2", "::1", "0.0.0.0", "10.0.0.5")]
    [True, True, False, False]
    """
    found = plain(address)
    return found is not None and found.is_loopback


def resolved(host: str) -> str:
    """Return the address that a name stands for, that of IPv4 first; an address as it is.

    Raises
    ------
    OptionError
        If it stands for none.
    """
    try:
        found = socket.getaddrinfo(host or "none", None, type=socket.SOCK_STREAM)
    except (socket.gaierror, UnicodeError):
        message = f"host: expected an address of this machine or a name of one, got {host!r}"
        raise OptionError(f"{message}; give 127.0.0.1, or 0.0.0.0 for all addresses") from None
    _, *_, address = min(found, key=lambda one: one[0] != socket.AF_INET)
    return str(address[0])


def listen(address: str, port: int, backlog: int) -> socket.socket:
    """Return a socket that listens.

    Parameters
    ----------
    address : str
        One of this machine; 0.0.0.0 or :: for all of them.
    port : int
        0 is any that is free.
    backlog : int
        Connections that may wait to be accepted.

    Returns
    -------
    socket

    Raises
    ------
    OptionError
        If one cannot listen there.
    """
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    every = address == "::" and socket.has_dualstack_ipv6()
    try:
        made = socket.create_server((address, port), family=family, backlog=backlog, dualstack_ipv6=every)
    except OSError as error:
        reason = _HINDRANCES.get(error.errno or 0, f"host: cannot listen at {{host}}, port {{port}}: {error}")
        raise OptionError(reason.format(host=address, port=port)) from None
    # It has to know its protocol: asyncio turns off the wait of 40 ms for larger packets for TCP alone.
    return socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP, fileno=made.detach())


def urls(listener: socket.socket) -> list[str]:
    """Return where a listening socket is reached, with a slash at the end; the loopback address first."""
    host, port = listener.getsockname()[:2]
    found = ip_address(host)
    hosts = [host]
    if found.is_unspecified:
        both = found.version == 6 and not listener.getsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY)
        families = {socket.AF_INET} if found.version == 4 else {socket.AF_INET6}
        hosts = list(dict.fromkeys(_own(families | ({socket.AF_INET} if both else set()))))
    return [f"http://{f'[{host}]' if ':' in host else host}:{port}/" for host in hosts]


def _own(families: set[socket.AddressFamily]) -> Iterator[str]:
    """Yield addresses of this machine, of some families."""
    loopback = {socket.AF_INET: "127.0.0.1", socket.AF_INET6: "::1"}
    yield from (loopback[family] for family in sorted(families))
    for family, address in _ELSEWHERE:
        if family in families:
            # To connect a datagram socket chooses the way, and sends nothing.
            with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((address, 9))
                yield str(probe.getsockname()[0])
    with suppress(OSError):
        for family, *_, found in socket.getaddrinfo(socket.gethostname(), None, type=socket.SOCK_STREAM):
            if family in families and not is_loopback(str(found[0])):
                yield str(found[0])
