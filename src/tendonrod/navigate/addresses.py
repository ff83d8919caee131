"""The addresses of this machine on its networks, found without asking any other host."""

from __future__ import annotations

import socket
import struct
import sys

SIOCGIFADDR = 0x8915  # of Linux, netdevice(7)
FAR = {
    False: "192.0.2.1",
    True: "2001:db8::1",
}  # kept for documentation (RFC 5737, RFC 3849): only a route is looked up


def own_addresses(is_ipv6: bool = False) -> tuple[str, ...]:
    """Addresses at which other machines may find this one, the one towards the widest network first; none offline.

    On Linux those of all its interfaces, elsewhere (and of IPv6) that of the default route. Nothing is sent.
    """
    found = [_towards(FAR[is_ipv6], is_ipv6)]
    if sys.platform == "linux" and not is_ipv6:
        found += [_of_interface(name) for _, name in socket.if_nameindex()]
    return tuple(each for each in dict.fromkeys(found) if each and not each.startswith("127.") and each != "::1")


def _towards(far: str, is_ipv6: bool) -> str:
    """The address that packets to ``far`` would come from, "" where there is no way to it. Connecting sends none."""
    with socket.socket(socket.AF_INET6 if is_ipv6 else socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((far, 9))
            return str(probe.getsockname()[0])
        except OSError:
            return ""


def _of_interface(name: str) -> str:
    """The IPv4 address of a network interface of Linux, "" where it has none."""
    import fcntl

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            answer = fcntl.ioctl(asked.fileno(), SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
        except OSError:
            return ""
    return socket.inet_ntoa(answer[20:24])
