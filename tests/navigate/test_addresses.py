"""Where the server is found: from this machine, and from others where it listens for them."""

import contextlib

from tendonrod.navigate.addresses import own_addresses
from tendonrod.navigate.doors import Door, is_loopback
from tendonrod.navigate.server import listening


def test_other_machines_are_told_this_one_s_addresses_where_it_listens_on_all(monkeypatch):
    monkeypatch.setattr(
        "tendonrod.navigate.doors.own_addresses", lambda is_ipv6: ("fd00::7",) if is_ipv6 else ("10.1.2.3",)
    )
    token = {"port": 8420, "token": "a-secret"}
    assert Door(host="0.0.0.0", **token).url == "http://127.0.0.1:8420/?token=a-secret"
    assert Door(host="0.0.0.0", **token).urls_elsewhere == ("http://10.1.2.3:8420/?token=a-secret",)
    assert Door(host="::", **token).urls_elsewhere == ("http://[fd00::7]:8420/?token=a-secret",)
    for host in ("127.0.0.1", "192.168.1.5", "bench.local"):
        assert Door(host=host, **token).urls_elsewhere == ()


def test_own_addresses_are_this_machine_s_and_none_that_only_it_can_reach():
    for is_ipv6 in (False, True):
        for each in own_addresses(is_ipv6):
            assert not is_loopback(each)
            with contextlib.closing(listening(each, 0)) as at:  # which no other machine's address allows
                assert at.getsockname()[0] == each
