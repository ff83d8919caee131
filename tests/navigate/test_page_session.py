"""What the page says of the session, and does with it: refusals, records, replays, who has control, the first hint."""

from dataclasses import replace

import pytest

from navigate.browser import Tab, chromium, faultless
from navigate.pretend import PretendSession
from navigate.served import eventually, served
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.recovery import Trouble

STEP, COUNT = 0.05, 400
SPAN = (COUNT - 1) * STEP
REASON = "there is no equilibrium near the present one"


class RefusingSession(PretendSession):
    """Refuses every insertion while it is told to."""

    refuses = False

    def step(self, jog, dt):
        if not (self.refuses and jog.insertion):
            return super().step(jog, dt)
        last = self.snapshot
        text = f"{jog.words()} refused: {REASON}; go back, or another way"
        self.snapshot = replace(last, index=last.index + 1, time=last.time + dt, blocked=text)
        return self.snapshot


@pytest.fixture(scope="module")
def browser():
    with chromium(draws=False) as found:
        yield found


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(RefusingSession(), tmp_path_factory.mktemp("records")) as found:
        yield found


@pytest.fixture(scope="module")
def page(browser, server):
    with faultless(browser, server.url) as found:
        found.get("document.querySelector('#hint-close').click()")
        yield found


@pytest.fixture
def tab(page, server):
    server.session.refuses = False
    server.service.pilot.stop_playing().result(5.0)
    page.start()
    return page


def events(tab):
    return tab.get("[...document.querySelectorAll('#events li')].map(row => row.lastChild.textContent)")


def shows(tab, mode):
    tab.until(f"document.querySelector('#mode').textContent === '{mode}'")


def frames():
    session = PretendSession()
    for _ in range(COUNT):
        yield session.step(Jog(insertion=2e-3), STEP)


@pytest.fixture
def replay(tab, server):
    """A record of 20 s that passes a target at 10 s, shown to the page."""
    server.service.pilot.play(frames(), 1.0, "one.jsonl", SPAN).result(5.0)
    shows(tab, "Replay")
    return tab


def test_a_refused_move_is_told_while_it_lasts_and_leaves_an_event_and_a_mark(tab, server):
    server.session.refuses = True
    tab.page.keyboard.down("w")
    shows(tab, "Refused")
    tab.until(f"document.querySelector('#warnings').textContent.startsWith('Insertion refused: {REASON}')")
    tab.page.keyboard.up("w")
    shows(tab, "Live, at rest")
    told = [text for text in events(tab) if REASON in text]
    assert told == [f"Insertion refused: {REASON}; go back, or another way"]  # once, and not in a double negative
    marks = tab.get("tendonrod.picture.strip.marks.filter(mark => mark.severity === 'limit').map(mark => mark.count)")
    assert marks == [1]


def test_the_same_again_within_a_moment_is_one_mark_with_a_count(tab):
    tab.get("for (let k = 0; k < 5; k += 1) tendonrod.picture.events.add('No command for 150 ms', 'warning')")
    found = tab.get("tendonrod.picture.strip.marks.filter(mark => mark.text === 'No command for 150 ms')")
    assert [mark["count"] for mark in found] == [5]


def test_a_record_ends_only_when_asked_twice_and_a_new_one_needs_a_retracted_robot(tab, server):
    name = server.service.record.name
    assert tab.text("#record") == "End record"
    tab.page.click("#record")
    tab.page.click("#record-dialog [data-close]")
    assert server.service.record is not None
    tab.page.click("#record")
    tab.page.click("#record-end")
    tab.until("!tendonrod.state.recording")
    assert events(tab)[0] == f"This page: the record {name} is ended"
    assert not tab.page.is_visible("#recording")
    tab.page.keyboard.down("w")
    tab.until("document.querySelector('#record').disabled")
    tab.page.keyboard.up("w")
    tab.page.click("#reset")
    tab.page.click("#record")
    tab.until("tendonrod.state.recording")
    assert events(tab)[0] == "This page: a new record begins"
    assert tab.page.is_visible("#recording")


def test_a_replay_pauses_and_goes_on(replay):
    replay.until("tendonrod.state.replay.at > 0.2")
    replay.page.click("#play")
    replay.until("tendonrod.state.replay.paused")
    at = replay.get("tendonrod.state.replay.at")
    replay.page.wait_for_timeout(300)
    assert replay.get("tendonrod.state.replay.at") == at
    assert replay.text("#play") == "Play"
    replay.page.click("#play")
    replay.until(f"tendonrod.state.replay.at > {at} + 0.2")


def test_a_replay_takes_another_speed(replay):
    replay.page.select_option("#player-speed", "8")
    replay.until("tendonrod.state.replay.speed === 8")
    replay.until("tendonrod.state.replay.at > 8")


@pytest.mark.parametrize("at", [15.0, 3.0])
def test_the_bar_goes_to_a_place_and_shows_where_it_is(replay, at):
    replay.page.click("#play")
    replay.until("tendonrod.state.replay.paused")
    replay.page.fill("#player-at", str(at))
    replay.until(f"Math.abs(tendonrod.state.tip[2] - 2e-3 * {at}) < 2.1e-3 * {STEP}")
    replay.until("document.querySelector('#player').textContent.includes('of 0:20.0')")
    assert float(replay.page.input_value("#player-at")) == pytest.approx(at)


def test_a_replay_tells_the_record_s_own_events_at_their_time_and_its_end_none_of_them(replay, server):
    before = events(replay)
    replay.page.fill("#player-at", str(SPAN))
    replay.until("tendonrod.state.replay.paused && tendonrod.state.reached.length === 1")
    assert replay.text("#play") == "Again"
    replay.page.click("#replay-end")
    shows(replay, "Live, at rest")
    replay.until("tendonrod.state.insertion === 0 && tendonrod.state.reached.length === 0")
    assert not replay.page.is_visible("#player")
    replay.page.wait_for_timeout(300)
    new = events(replay)[: len(events(replay)) - len(before)]
    assert new == ["Back to the live session", "Lateral left T12 reached"]
    stamps = replay.get("[...document.querySelectorAll('#events time')].map(one => one.textContent)")
    minutes, seconds = stamps[1].lstrip("▸").split(":")
    assert stamps[1].startswith("▸")
    assert 60 * int(minutes) + float(seconds) == pytest.approx(9.5, abs=0.15)  # 19 mm out at 2 mm/s: within 1 mm of it
    assert not stamps[0].startswith("▸")


def test_who_only_watches_a_replay_cannot_handle_it(browser, server, replay):
    other = Tab(browser, server.url)
    other.until("!document.querySelector('#player').hidden")
    for name in ("#play", "#player-at", "#player-speed", "#replay-end"):
        assert other.page.is_disabled(name)
    assert "handles it" in other.text("#player-name")
    other.context.close()


def test_control_can_be_asked_for_only_where_it_would_be_given(browser, server, tab):
    other = Tab(browser, server.url)
    assert other.page.is_disabled("#take")
    assert "silent for 10 s" in str(other.page.get_attribute("#take", "title"))
    tab.page.click("#take")  # now: release
    other.until("!document.querySelector('#take').disabled")
    assert other.text("#take") == "Take control"
    other.context.close()


def test_an_operator_who_falls_silent_can_be_replaced(browser, server, tab):
    other = Tab(browser, server.url)
    holder = server.service.seat.holder
    server.service.seat.absence = 0.0  # as if ten seconds had passed
    try:
        other.until("document.querySelector('#take').textContent === 'Take over'")
        assert holder in other.page.get_attribute("#take", "title")
        other.page.click("#take")
        other.until("tendonrod.control.you")
    finally:
        server.service.seat.absence = 10.0
        other.context.close()
    assert eventually(lambda: server.service.seat.holder is None)


def test_every_control_in_sight_has_a_name_of_its_own(tab):
    names = tab.get("""[...document.querySelectorAll('button, select, input')]
        .filter(one => one.offsetParent && !one.closest('dialog'))
        .map(one => (one.ariaLabel || one.innerText || one.labels?.[0]?.innerText || '').trim())""")
    assert "" not in names
    assert len(names) == len(set(names))


def test_the_first_hint_is_put_away_for_good_and_can_be_had_again(browser, server):
    tab = Tab(browser, server.url)
    assert tab.page.is_visible("#hint")
    tab.page.click("#hint-close")
    tab.page.reload()
    tab.until("window.tendonrod?.state && tendonrod.connected")
    assert not tab.page.is_visible("#hint")
    tab.page.click("#settings")
    tab.page.click("#hint-again")
    assert tab.page.is_visible("#hint")
    tab.context.close()


@pytest.mark.parametrize("homes", [False, True])
def test_a_fault_of_the_bench_is_shown_to_all_and_acknowledged_by_who_has_control(browser, server, tab, homes):
    other = Tab(browser, server.url)
    server.session.trouble = Trouble(text="the bench stopped: no light", remedy="switch it on", ready=True, homes=homes)
    for each in (tab, other):
        each.until("!document.querySelector('#fault').hidden")
        shows(each, "Bench stopped")
        assert each.text("#fault-text") == "No light"
        assert each.text("#fault-remedy").startswith("Switch it on")
        assert each.text("#acknowledge") == ("Acknowledge and home" if homes else "Acknowledge")
    assert other.page.is_disabled("#acknowledge")
    other.context.close()
    tab.page.click("#acknowledge")
    tab.until("document.querySelector('#fault').hidden")
    assert server.session.acknowledged[-1] is homes


def test_a_page_that_comes_later_shows_the_last_events_and_the_last_minute(browser, server, tab):
    tab.page.keyboard.down("w")
    tab.until("tendonrod.state.insertion > 0.02")
    tab.page.keyboard.up("w")
    tab.until("tendonrod.picture.strip.samples.length > 5")
    server.service.event("info", "dust was seen")
    tab.until("document.querySelector('#events').textContent.includes('Dust was seen')")
    other = Tab(browser, server.url)
    assert "Dust was seen" in other.text("#events")
    assert max(other.get("tendonrod.picture.strip.samples.map(one => one.insertion)")) >= 1.0  # mm
    tops = other.get("tendonrod.picture.strip.samples.map(one => one.now)")
    assert tops == sorted(tops)
    listed = events(other).count("Dust was seen")
    other.get("tendonrod.drop()")
    other.until("tendonrod.connected")
    other.page.wait_for_timeout(200)
    assert events(other).count("Dust was seen") == listed == 1  # what it has heard itself is not told again
    other.context.close()


def test_the_outer_tube_can_be_put_back_to_where_the_session_began_and_says_its_ranges_in_the_form_s_units(tab):
    begun = tab.get("tendonrod.scene.tube")
    tab.page.click("#place")
    tab.page.fill("#place-height", "999")
    tab.page.click("#place-go")
    assert tab.text("#place-error") == "The height must be from −200 to 800 mm."
    tab.page.fill("#place-height", "12")
    tab.page.fill("#place-tilt", "5")
    tab.page.click("#place-go")
    tab.until("tendonrod.state.tube.height === 0.012 && !document.querySelector('dialog[open]')")
    tab.page.click("#place")
    tab.page.select_option("#place-level", "T12")
    values = tab.get("[...document.querySelectorAll('#place-form input')].map(field => field.valueAsNumber)")
    assert values == pytest.approx([0.0, 1.5, 4.9, 22.0, 8.0])  # `default_tube` in the window of the level
    tab.page.select_option("#place-level", "where the session began")
    tab.page.click("#place-go")
    tab.until("!document.querySelector('dialog[open]')")
    assert tab.get("tendonrod.state.tube") == pytest.approx(begun, abs=1e-5)


def test_a_bench_has_no_reset(browser, tmp_path):
    session = PretendSession()
    session.can_reset = False
    with served(session, tmp_path) as server:
        tab = Tab(browser, server.url)
        tab.take()
        tab.until("!document.querySelector('#place').disabled")
        assert tab.page.is_disabled("#reset")
        assert "retract the robot" in str(tab.page.get_attribute("#reset", "title"))
        tab.context.close()
