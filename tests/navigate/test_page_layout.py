"""What lies where on the page: the view's middle stays free, no word is cut off, and keys turn the view."""

import math
from dataclasses import replace

import pytest

from navigate.browser import DRAWN, chromium, faultless
from navigate.pretend import PretendSession
from navigate.served import served
from tendonrod.navigate.snapshot import Notice

SIZES = [(1366, 768), (1180, 820), (1024, 768), (820, 1180)]
REFUSAL = (
    "insertion refused: no equilibrium is found near the present one, the robot would fold or snap away; "
    "go back, or another way"
)
OTHERS = (
    Notice(code="pressure", text="contact pressure 19.9 kPa on soft tissue is above 4.8 kPa", severity="limit"),
    Notice(code="accuracy", text="the shape is known to 0.12 mm only", severity="info"),
)
JUMP = "the robot snapped by 2.3 mm"
SPINE = 0.16  # half of the width that the phantom takes in the middle of the view, over the view's height


class TellingSession(PretendSession):
    """Says that it refuses while it is told to; a withdrawal is a jump, told in its own step only."""

    refuses = False

    def step(self, jog, dt):
        told = super().step(jog, dt)
        if self.refuses:
            self.snapshot = replace(told, blocked=REFUSAL, warnings=OTHERS)
        if jog.insertion < 0.0:
            self.snapshot = replace(told, warnings=(Notice(code="snap", text=JUMP, severity="limit"),))
        return self.snapshot


@pytest.fixture(scope="module")
def browser():
    with chromium(draws=True) as found:
        yield found


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(TellingSession(), tmp_path_factory.mktemp("records")) as found:
        yield found


@pytest.fixture(scope="module")
def page(browser, server):
    with faultless(browser, server.url) as found:
        found.until(DRAWN)
        yield found


@pytest.fixture
def tab(page, server):
    server.session.refuses = False
    page.page.set_viewport_size({"width": 1024, "height": 768})
    page.start()
    return page


def refused(tab, server):
    """The page while a refused key is held."""
    server.session.refuses = True
    tab.page.keyboard.down("w")
    tab.until("document.querySelector('#warnings').textContent.includes('refused')")


@pytest.mark.parametrize("size", SIZES)
def test_what_lies_over_the_view_leaves_the_spine_free(tab, server, size):
    tab.page.set_viewport_size({"width": size[0], "height": size[1]})
    refused(tab, server)
    boxes = tab.get("""['#view', '#hint', '.tools', '.legend', '.warnings'].map(name => {
        const box = document.querySelector(name).getBoundingClientRect();
        return [box.left, box.right, box.top, box.bottom]; })""")
    tab.page.keyboard.up("w")
    (left, right, top, bottom), *others = boxes
    middle, free = (left + right) / 2, SPINE * (bottom - top)
    assert all(b[1] <= middle - free or b[0] >= middle + free for b in others)
    assert all(b[1] > b[0] for b in others)
    for i, a in enumerate(others):  # and nothing lies over another
        assert not any(a[0] < b[1] and b[0] < a[1] and a[2] < b[3] and b[2] < a[3] for b in others[:i])


@pytest.mark.parametrize("size", [*SIZES, (390, 844)])
def test_no_warning_and_no_button_is_cut_short(tab, server, size):
    tab.page.set_viewport_size({"width": size[0], "height": size[1]})
    refused(tab, server)
    cut = tab.get("""[...document.querySelectorAll('.warning, button, .chip')].filter(one => one.offsetParent &&
        one.scrollWidth > one.clientWidth + 1).map(one => one.textContent)""")
    outside = tab.get("""[...document.querySelectorAll('.bar button')].filter(one => {
        const box = one.getBoundingClientRect();
        return box.left < 0 || box.right > innerWidth; }).map(one => one.id)""")
    tab.page.keyboard.up("w")
    assert cut == []
    assert outside == []


def test_a_jump_is_told_once_and_stays_in_sight(tab):
    """The server tells it in a single state, of which 60 come in a second."""
    tab.page.keyboard.down("w")
    tab.until("tendonrod.state.insertion > 0.02")
    tab.page.keyboard.up("w")
    tab.page.keyboard.down("s")
    tab.until("tendonrod.state.warnings.some(one => one.code === 'snap')")
    tab.page.keyboard.up("s")
    tab.page.keyboard.down("e")
    tab.until("tendonrod.state.warnings.length === 0")
    tab.page.keyboard.up("e")
    tab.page.wait_for_timeout(300)
    assert tab.text("#warnings") == JUMP[0].upper() + JUMP[1:]


def test_the_view_is_turned_and_zoomed_by_keys_that_move_nothing_else(tab, server):
    where = "tendonrod.picture.stage.camera.position.clone().sub(tendonrod.picture.stage.controls.target).toArray()"
    tab.get("document.querySelector('[data-camera=Dorsal]').click()")
    assert tab.get("document.querySelector('[data-camera=Dorsal]').getAttribute('aria-pressed')") == "true"
    before = tab.get(where)
    tab.page.focus("#view")
    tab.page.keyboard.press("ArrowLeft")
    turned = tab.get(where)
    assert math.hypot(*turned) == pytest.approx(math.hypot(*before))
    angle = math.atan2(turned[1], turned[0]) - math.atan2(before[1], before[0])
    assert angle == pytest.approx(-math.radians(5), abs=1e-6)
    assert tab.get("document.querySelector('[data-camera=Dorsal]').getAttribute('aria-pressed')") == "false"
    tab.page.keyboard.press("+")
    assert math.hypot(*tab.get(where)) < math.hypot(*before)
    assert server.session.snapshot.insertion == 0.0
