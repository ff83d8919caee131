"""What the service makes of its session: rates that the drive can follow, each piece of news once."""

import json
from dataclasses import asdict, replace
from math import radians

import pytest

from navigate.pretend import PretendSession
from tendonrod.navigate import asked
from tendonrod.navigate.commands import Jog, Rates
from tendonrod.navigate.recovery import Trouble
from tendonrod.navigate.service import Service

SLOW = Jog(insertion=0.45e-3, rotation=radians(170), tension=0.04)


@pytest.fixture
def slow():
    """A service whose drive follows `SLOW` and no more, steered by "page"."""
    session = PretendSession()
    session.fastest = SLOW
    service = Service(session)
    service.take("page")
    return service


def test_rates_are_no_faster_than_the_drive(slow):
    told = slow.welcome("page")
    assert told["rates"] == {"insertion": SLOW.insertion, "rotation": Rates().rotation, "tension": SLOW.tension}
    assert {name: high for name, (_, high) in told["allowed_rates"].items()} == asdict(SLOW)
    slow.jog("page", asked.Jog(type="jog", seq=1, hold=True, insertion=1.0, rotation=-1.0, tension=0.5))
    slow.pilot.tick()
    assert slow.pilot.session.steps[-1][0] == Jog(
        insertion=SLOW.insertion, rotation=-Rates().rotation, tension=0.5 * SLOW.tension
    )


def test_faster_rates_are_brought_down_to_what_the_drive_can_and_slower_ones_hold(slow):
    slow.set_rates("page", asked.SomeRates(insertion=2e-3, rotation=radians(10)))
    assert asdict(slow.rates) == {"insertion": SLOW.insertion, "rotation": radians(10), "tension": SLOW.tension}


def test_without_a_bench_rates_are_the_usual_ones():
    told = Service(PretendSession()).welcome("page")
    assert told["rates"] == asdict(Rates())
    assert told["allowed_rates"] == {name: list(ends) for name, ends in Rates.allowed().items()}


def test_a_fault_of_the_bench_is_one_event(slow):
    session, told = slow.pilot.session, []
    slow.tell = lambda message: told.append(json.loads(message.model_dump_json()))
    session.trouble = Trouble(text="the bench stopped: dust", remedy="clean it", ready=True, homes=False)
    plain = session.step
    session.step = lambda jog, dt: replace(plain(jog, dt), blocked="the bench stopped: dust")
    slow.pilot.ask(lambda session: None)
    for _ in range(3):
        slow.pilot.tick()
    slow.pilot._rest(0.0)
    assert [each["text"] for each in told if "dust" in each.get("text", "")] == ["the bench stopped: dust"]
