"""Requests and messages made up by machines: nothing breaks the server, and nothing malformed moves the robot."""

import asyncio
import contextlib
import json
import time

import httpx
import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from navigate.pretend import PretendSession
from navigate.served import served
from tendonrod.navigate import asked
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.hub import Client, Hub
from tendonrod.navigate.messages import CLIENT
from tendonrod.navigate.ration import Ration
from tendonrod.navigate.records import Records
from tendonrod.navigate.service import Service

QUICK = settings(
    max_examples=10, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.function_scoped_fixture],
)  # fmt: skip
AHEAD = 200.0  # the service's clock runs so much faster, so that no step of a script takes its time


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("records")
    with served(PretendSession(), folder, clock=lambda: AHEAD * time.monotonic()) as found:
        yield found


@pytest.fixture(scope="module")
def api(server):
    return schemathesis.openapi.from_url(f"{server.url}/api/openapi.json")


@pytest.fixture(scope="module")
def key(server):
    """Of a script that has control."""
    return httpx.post(f"{server.url}/api/take", json={"name": "fuzz"}).json()["key"]


def operations(api):
    return [found.ok() for found in api.get_all_operations()]


def modes(operation):
    """Requests as described, and requests that are not."""
    both = (schemathesis.GenerationMode.POSITIVE, schemathesis.GenerationMode.NEGATIVE)
    return st.one_of([operation.as_strategy(generation_mode=mode) for mode in both])


def test_requests_of_strangers_are_answered_as_described_and_move_nothing(server, api):
    for operation in operations(api):

        @QUICK
        @given(modes(operation))
        def holds(case):
            before = server.session.snapshot.posture
            case.call_and_validate()
            assert server.session.snapshot.posture == before
            server.service.seat.holder = None  # /take lets anybody in while nobody has control

        holds()


def test_requests_of_the_operator_are_answered_as_described(server, api, key):
    for operation in operations(api):
        if operation.path.endswith(("take", "release")):
            continue

        @QUICK
        @given(modes(operation))
        def holds(case):
            server.service.seat.holder = "fuzz-1"
            case.call_and_validate(headers={"X-Key": key})

        holds()


NUMBERS = st.one_of(st.floats(allow_nan=True), st.integers(), st.booleans(), st.text(max_size=5), st.none())
FIELDS = st.sampled_from(["seq", "insertion", "rotation", "tension", "hold", "tube", "on", "name", "id", "speed", "x"])
KINDS = st.sampled_from([*(each.model_fields["type"].default for each in asked.Message.__subclasses__()
                           if "type" in each.model_fields), "fly", ""])  # fmt: skip
OBJECTS = st.builds(lambda kind, rest: {**rest, "type": kind}, KINDS, st.dictionaries(FIELDS, NUMBERS, max_size=6))
JOGS = st.fixed_dictionaries(
    {
        "type": st.just("jog"),
        "seq": NUMBERS,
        "insertion": NUMBERS,
        "rotation": NUMBERS,
        "tension": NUMBERS,
        "hold": NUMBERS,
    }
)
TEXTS = st.one_of(st.text(max_size=60), st.one_of(OBJECTS, JOGS).map(json.dumps), st.binary(max_size=20))


@pytest.fixture(scope="module")
def bridge(tmp_path_factory):
    """A hub with one client who has control, and no thread that moves anything."""
    hub = Hub(Service(PretendSession(), Records(tmp_path_factory.mktemp("fuzzed"))))
    client = Client("page-1")
    return hub, client


@settings(QUICK, max_examples=300)
@given(sent=TEXTS)
def test_a_message_that_is_not_of_the_schema_moves_nothing_and_is_answered(bridge, sent):
    hub, client = bridge
    client.waiting.clear()
    hub.service.seat.take("page-1")
    client.messages = client.faults = Ration(1.0, 1e9)
    hub.service.pilot.hold(Jog(insertion=1e-3))
    received = {"text": None, "bytes": sent} if isinstance(sent, bytes) else {"text": sent, "bytes": None}
    asyncio.run(answered(hub, client, received))
    if not understood(sent):
        assert not hub.service.pilot.dead_man.is_held
        assert json.loads(client.waiting[-1])["type"] == "error"


async def answered(hub, client, received):
    """As the hub does with what comes in; requests are not waited for, since nobody carries them out here."""
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(hub.heard(client, received), 0.001)


def understood(sent) -> bool:
    try:
        CLIENT.validate_json(sent) if isinstance(sent, str) else CLIENT.validate_json("")
    except ValidationError:
        return False
    return True
