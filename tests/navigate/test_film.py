"""The film of a record: its pace, pauses and places, with a clock that stands still unless it is told to go on."""

import pytest

from navigate.pretend import PretendSession
from tendonrod.errors import TendonrodError
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.film import AHEAD, Film

STEP = 0.05  # s between two snapshots
COUNT = 200
SPAN = (COUNT - 1) * STEP


class Clock:
    now = 5.0

    def __call__(self):
        return self.now


def snapshots(count=COUNT, then=None):
    session = PretendSession()
    for _ in range(count):
        yield session.step(Jog(insertion=1e-3), STEP)
    if then is not None:
        raise then


def shown(film, clock, seconds, rounds=20):
    """The last of what is seen in so many rounds; in s from the beginning."""
    clock.now += seconds / rounds
    found = film.look()
    for _ in range(rounds - 1):
        clock.now += seconds / rounds
        found = film.look()
    return found.time - STEP


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def film(clock):
    return Film(snapshots(), name="a", span=SPAN, clock=clock)


@pytest.mark.parametrize("speed", [0.25, 1.0, 4.0])
def test_it_goes_as_fast_as_it_is_asked(film, clock, speed):
    film.change(speed=speed)
    assert shown(film, clock, 2.0) == pytest.approx(2.0 * speed, abs=STEP)
    assert film.playing.at == pytest.approx(2.0 * speed)


def test_another_speed_goes_on_from_where_it_is(film, clock):
    shown(film, clock, 1.0)
    film.change(speed=2.0)
    assert film.playing.at == pytest.approx(1.0)
    assert shown(film, clock, 1.0) == pytest.approx(3.0, abs=STEP)


def test_a_pause_shows_the_same_and_is_no_motion(film, clock):
    at = shown(film, clock, 1.0)
    assert film.is_moving
    film.change(paused=True)
    assert shown(film, clock, 3.0) == at
    assert not film.is_moving
    film.change(paused=False)
    assert shown(film, clock, 1.0) == pytest.approx(2.0, abs=STEP)


@pytest.mark.parametrize("at", [0.0, 2.5, 7.3])
def test_it_goes_to_a_place_before_or_beyond(film, clock, at):
    shown(film, clock, 4.0)
    film.change(at=at, paused=True)
    found = shown(film, clock, 0.1)
    assert found == pytest.approx(at, abs=STEP)
    assert found <= at + 1e-9
    assert film.playing.at == pytest.approx(at)


def test_what_is_not_computed_yet_is_waited_for(clock):
    """A round computes a part only, so that states come meanwhile; the place asked for is told at once."""
    film = Film(snapshots(2000), span=1999 * STEP, clock=clock)
    film.look()
    film.change(at=90.0)
    first = film.look()
    assert 0.0 < first.time < 90.0
    assert film.playing.at == 90.0
    assert shown(film, clock, 0.0) == pytest.approx(90.0, abs=STEP)


def test_a_round_computes_ahead_but_not_all(film, clock):
    film.look()
    assert 0.0 < film.playing.known <= AHEAD * STEP + 1e-9 < SPAN


def test_beyond_the_end_is_the_end_where_it_pauses_and_begins_anew_when_asked(film, clock):
    film.change(at=1e6)
    assert shown(film, clock, 1.0) == pytest.approx(SPAN)
    assert film.playing.paused
    assert film.is_idle
    film.change(paused=False)
    assert shown(film, clock, 0.5) == pytest.approx(0.5, abs=1.1 * STEP)


def test_a_replay_that_breaks_off_tells_so_once_it_is_there(clock):
    film = Film(snapshots(40, TendonrodError("step 40 differs")), span=SPAN, clock=clock)
    assert shown(film, clock, 1.5) == pytest.approx(1.5, abs=STEP)
    with pytest.raises(TendonrodError, match="differs"):
        shown(film, clock, 1.0)


def test_what_happens_in_a_record_is_told_once_when_it_is_passed_and_again_after_going_back():
    clock = Clock()
    film = Film(snapshots(600), span=599 * STEP, speed=8.0, clock=clock)  # the target at 20 mm: within 1 mm after 19
    told = []
    for _ in range(100):
        clock.now += 0.03
        film.look()
        told += film.passed()
    assert [(pytest.approx(at, abs=1.5 * STEP), text) for at, _, text in told] == [
        (19.0 - STEP, "target lateral-left@T12 is reached")
    ]
    film.change(at=1.0, paused=True)
    film.look()
    assert film.passed() == []
    film.change(at=20.0)
    while film.playing.at > film.playing.known:
        film.look()
    film.look()
    assert list(film.passed()) == told


def test_a_film_that_is_computed_too_slowly_says_how_fast_it_goes():
    clock = Clock()
    film = Film(snapshots(), span=SPAN, speed=8.0, clock=clock)
    for _ in range(30):  # at most 20 snapshots a round
        clock.now += 20 * STEP / 2.0
        film.look()
        if film.playing.pace is not None:
            break
    assert film.playing.pace == pytest.approx(2.0, rel=0.01)
    film.change(paused=True)
    film.look()
    assert film.playing.pace is None
