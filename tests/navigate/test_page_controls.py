"""The page's controls, driven in a browser without pictures: what moves the robot, and everything that must stop it."""

import time

import pytest

from navigate.browser import Tab, chromium, faultless
from navigate.pretend import LENGTH, PretendSession
from navigate.served import eventually, served
from tendonrod.navigate.messages import CLIENT

STANDSTILL = 0.15  # s in which a robot that was not stopped would move on
HOLD = (4,)  # a shoulder button
LEAST = 36  # px, of a button for fingers


@pytest.fixture(scope="module")
def browser():
    with chromium(draws=False) as found:
        yield found


@pytest.fixture(scope="module")
def server():
    with served(PretendSession()) as found:
        yield found


@pytest.fixture(scope="module")
def page(browser, server):
    """The page of all tests. Whatever it said was understood, and its script had no fault."""
    with faultless(browser, server.url) as found:
        yield found
        for message in found.sent:
            CLIENT.validate_json(message)


@pytest.fixture
def tab(page, server):
    """The page in control of a robot that is retracted and stands, with nothing held."""
    page.start()
    assert server.session.snapshot.insertion == 0.0
    return page


def moves(server) -> bool:
    before = server.session.snapshot.posture
    return eventually(lambda: server.session.snapshot.posture != before)


def stands(server) -> bool:
    """Whether the robot comes to rest within the time of the watchdog, and stays so."""
    time.sleep(0.17)
    before = server.session.snapshot.posture
    time.sleep(STANDSTILL)
    return server.session.snapshot.posture == before


@pytest.mark.parametrize(("key", "axis", "sign"), [("w", "insertion", 1), ("d", "rotation", 1), ("a", "rotation", -1)])
def test_a_held_key_moves_and_its_release_stops(tab, server, key, axis, sign):
    tab.page.keyboard.down(key)
    assert eventually(lambda: sign * getattr(server.session.snapshot.posture, axis) > 0.0)
    tab.page.keyboard.up(key)
    assert stands(server)
    last = tab.said("jog")[-1]
    assert (last["hold"], last[axis]) == (False, 0.0)  # said so, instead of leaving it to the watchdog


def test_jogs_are_repeated_while_a_key_is_held_with_growing_numbers(tab):
    tab.page.keyboard.down("e")
    tab.page.wait_for_timeout(500)
    tab.page.keyboard.up("e")
    tab.until("!tendonrod.isMoving")
    numbers = [jog["seq"] for jog in tab.said("jog")]
    assert numbers == sorted(set(numbers))
    assert sum(jog["hold"] and jog["tension"] == 1 for jog in tab.said("jog")) > 2


@pytest.mark.parametrize("event", ["blur", "pagehide", "visibilitychange", "Escape"])
def test_whatever_takes_the_page_away_stops_and_a_key_still_down_does_not_start_again(tab, server, event):
    tab.page.keyboard.down("w")
    assert moves(server)
    if event == "visibilitychange":
        tab.get("Object.defineProperty(document, 'hidden', {value: true, configurable: true})")
        tab.get("document.dispatchEvent(new Event('visibilitychange'))")
        tab.get("Object.defineProperty(document, 'hidden', {value: false, configurable: true})")
    elif event == "Escape":
        tab.page.keyboard.press("Escape")
        assert tab.said("stop")
    else:
        tab.dispatch(event)
    tab.page.keyboard.down("w")  # as a held key repeats
    assert stands(server)
    tab.page.keyboard.up("w")
    tab.page.keyboard.down("w")
    assert moves(server)


def test_a_lost_connection_stops_and_comes_back_without_control(tab, server):
    tab.page.keyboard.down("w")
    assert moves(server)
    tab.get("tendonrod.drop()")
    assert stands(server)
    tab.until("tendonrod.connected")
    tab.page.keyboard.down("w")
    assert stands(server)
    assert not tab.get("tendonrod.control.you")


def test_a_page_that_was_held_up_does_not_take_that_for_a_lost_connection(tab):
    tab.get("(() => { const begun = performance.now(); while (performance.now() - begun < 2000); })()")
    tab.page.wait_for_timeout(300)
    assert tab.get("tendonrod.connected && tendonrod.control.you")


def test_typing_moves_nothing_and_an_open_dialog_stops(tab, server):
    tab.page.keyboard.down("w")
    assert moves(server)
    tab.page.click("#settings")
    assert stands(server)
    tab.page.keyboard.up("w")
    tab.page.keyboard.down("w")
    assert stands(server)


def test_a_gamepad_moves_only_while_its_dead_mans_button_is_held(tab, server):
    tab.pad(0, 0, 0, 0)
    tab.until("tendonrod.gamepads.isNeutralSeen")
    tab.pad(0, -1, 0, 0)
    assert stands(server)
    tab.pad(0, -1, 0, 0, held=HOLD)
    assert eventually(lambda: server.session.snapshot.insertion > 0.0)
    tab.pad(0, -1, 0, 0)
    assert stands(server)


def test_a_lost_gamepad_stops_and_moves_again_only_after_it_was_at_rest(tab, server):
    tab.pad(0, 0, 0, 0)
    tab.until("tendonrod.gamepads.isNeutralSeen")
    tab.pad(0, -1, 0, 0, held=HOLD)
    assert moves(server)
    tab.lose_pad()
    assert stands(server)
    tab.pad(0, -1, 0, 0, held=HOLD)  # back with the stick where it was
    assert stands(server)
    tab.pad(0, 0.05, 0, 0)  # at rest, but for the play of an old stick
    tab.until("tendonrod.gamepads.isNeutralSeen")
    tab.pad(0, -1, 0, 0, held=HOLD)
    assert moves(server)


def test_a_gamepad_that_is_held_when_the_page_gets_control_moves_nothing(tab, server):
    tab.page.click("#take")  # now: release
    tab.until("!tendonrod.control.you")
    tab.pad(0, -1, 0, 0, held=HOLD)
    tab.take()
    assert stands(server)
    assert server.session.snapshot.insertion == 0.0


def test_a_button_on_the_screen_moves_while_the_pointer_is_down_and_a_cancelled_pointer_stops(tab, server):
    tab.page.hover("[data-action='insertion+']")
    tab.page.mouse.down()
    assert moves(server)
    tab.page.mouse.up()
    assert stands(server)
    tab.page.mouse.down()
    assert moves(server)
    tab.page.dispatch_event("[data-action='insertion+']", "pointercancel")
    assert stands(server)


def test_a_second_page_watches_until_the_first_lets_go(browser, server, tab):
    other = Tab(browser, server.url)
    assert other.get("document.querySelector('[data-action=\"insertion+\"]').disabled")
    other.page.keyboard.down("w")
    assert stands(server)
    other.page.keyboard.up("w")
    assert other.page.is_disabled("#take")
    tab.page.click("#take")  # now: release
    other.take()
    other.page.keyboard.down("w")
    assert moves(server)
    other.context.close()  # as a browser that crashes with a key held
    assert stands(server)


def test_a_reloaded_page_goes_on_with_the_session(tab, server):
    tab.page.keyboard.down("w")
    assert moves(server)
    tab.page.keyboard.up("w")
    assert stands(server)
    tab.page.reload()
    tab.until("window.tendonrod?.state && tendonrod.connected")
    assert tab.get("tendonrod.state.insertion") == pytest.approx(server.session.snapshot.insertion, abs=1e-6)
    assert not tab.get("tendonrod.control.you")  # control is asked for anew, never assumed


def test_keys_can_be_changed_and_are_kept(tab, server):
    tab.page.click("#settings")
    tab.page.click("[data-binding='insertion+']")
    tab.page.keyboard.press("s")
    assert "already" in tab.text("#bindings-error")
    tab.page.click("[data-binding='insertion+']")
    tab.page.keyboard.press("ArrowUp")
    tab.page.click("#settings-dialog [data-close]")
    tab.page.keyboard.down("ArrowUp")
    assert eventually(lambda: server.session.snapshot.insertion > 0.0)
    tab.page.keyboard.up("ArrowUp")
    tab.page.reload()
    tab.until("window.tendonrod?.state")
    assert tab.get("tendonrod.bindings.keys['insertion+']") == "ArrowUp"
    tab.get("tendonrod.bindings.reset()")


def test_the_rate_is_what_the_slider_says(tab, server):
    tab.page.fill("input[aria-label='Rate of insertion']", "100")
    assert eventually(lambda: server.service.rates.insertion == pytest.approx(20e-3))
    assert "20.0 mm/s" in tab.text("#axes")


def test_the_outer_tube_moves_only_with_the_robot_retracted(tab, server):
    tab.page.click("#place")
    tab.page.fill("#place-offset", "1.5")
    tab.page.fill("#place-tilt", "-12")
    tab.page.click("#place-go")
    assert eventually(lambda: server.session.snapshot.tube.offset == pytest.approx(1.5e-3))
    assert server.session.snapshot.tube.tilt == pytest.approx(-0.2094, abs=1e-4)
    tab.until("!document.querySelector('#place-dialog').open")
    tab.page.keyboard.down("w")
    assert moves(server)
    tab.until("document.querySelector('#place').disabled")


def test_a_target_gets_marked_when_the_tip_is_there(tab, server):
    tab.page.fill("input[aria-label='Rate of insertion']", "100")
    assert eventually(lambda: server.service.rates.insertion > 10e-3)
    tab.page.keyboard.down("w")
    tab.until("document.querySelector('[data-target=\"lateral-left@T12\"]').dataset.reached === 'true'")
    tab.page.keyboard.up("w")
    assert server.session.snapshot.insertion * LENGTH > 15e-3
    assert "1 of 1 reached" in tab.text("#targets-count")
    assert tab.text("#events").count("reached") == 1


def test_the_list_of_targets_is_one_stop_of_the_tab_key_and_arrows_go_through_it(tab):
    targets = "['a@T12', 'b@T12', 'c@T12'].map(name => ({name, level: 'T12'}))"
    tab.get(f"tendonrod.picture.targets.build({{phantom: {{levels: [{{name: 'T12'}}], targets: {targets}}}}})")
    all_of_them = "[...document.querySelectorAll('#targets button')]"
    stops = f"{all_of_them}.filter(one => one.tabIndex === 0).map(one => one.dataset.target)"
    tab.until(f"{stops}.length === 1")
    tab.page.focus("[data-target='a@T12']")
    for key, found in [("ArrowDown", "b@T12"), ("End", "c@T12"), ("ArrowDown", "c@T12"), ("Home", "a@T12")]:
        tab.page.keyboard.press(key)
        assert tab.get("document.activeElement.dataset.target") == found
    tab.page.keyboard.press("ArrowDown")
    assert tab.get(stops) == ["b@T12"]
    tab.page.reload()
    tab.until("window.tendonrod?.state")


@pytest.mark.parametrize("size", [(1024, 768), (390, 844)])
def test_fingers_get_large_buttons_and_stop_never_leaves_the_screen(browser, server, size):
    tab = Tab(browser, server.url, has_touch=True, is_mobile=True)
    tab.page.set_viewport_size({"width": size[0], "height": size[1]})
    tab.page.wait_for_timeout(100)
    heights = "[...document.querySelectorAll('button')].filter(one => one.offsetParent).map(one => one.offsetHeight)"
    assert min(tab.get(heights)) >= LEAST
    tab.get("window.scrollTo(0, 1e4)")
    tab.page.wait_for_timeout(100)
    top, bottom = tab.get("(box => [box.top, box.bottom])(document.querySelector('#stop').getBoundingClientRect())")
    assert 0 <= top < bottom <= size[1]
    tab.context.close()


def test_the_hint_shows_one_step_where_there_is_little_room_and_the_next_once_it_is_done(browser, server, tab):
    other = Tab(browser, server.url)
    shown = "[...document.querySelectorAll('#hint li')].filter(one => one.offsetParent).map(one => one.innerText)"
    other.until(f"{shown}.length === 1")
    holder = server.service.seat.holder
    assert other.get(shown) == [f"{holder} has control: take it once it is released."]
    server.service.stop()
    server.service.leave(str(holder), "gone")
    other.until(f"{shown}[0] === 'Take control.'")
    other.take()
    other.until(f"{shown}[0].startsWith('Hold E to pull')")
    other.page.set_viewport_size({"width": 1500, "height": 1000})
    other.until(f"{shown}.length > 3")
    other.context.close()
