"""Who asks: what is one client, so that none takes what is for all."""

from __future__ import annotations

from ipaddress import IPv6Address, ip_address

from starlette.types import Scope

#: Bits of an IPv6 address that a site is given: the rest its machines, and whoever is on one, choose at will.
_SITE = 64


def client_of(scope: Scope) -> str:
    """Return what tells the client of a request from others: its address, of IPv6 the first 64 bits.

    Behind a trusted proxy, the server puts the address that this tells into `scope`. All who come without an
    address, as through a socket of this machine, are one client.

    Examples
    --------
    >>> client_of({"client": ("10.1.2.3", 4000)}), client_of({"client": ("2001:db8::5%eth0", 1)})
    ('10.1.2.3', '2001:db8::')
    >>> client_of({"client": ("::ffff:10.1.2.3", 4000)}), client_of({"client": None})
    ('10.1.2.3', '')
    """
    name: str = (scope.get("client") or ("", 0))[0]
    try:
        address = ip_address(name.partition("%")[0])
    except ValueError:  # the name of a socket, or what a proxy made up
        return name
    if not isinstance(address, IPv6Address):
        return str(address)
    if address.ipv4_mapped:
        return str(address.ipv4_mapped)
    return str(IPv6Address(int(address) >> (128 - _SITE) << (128 - _SITE)))
