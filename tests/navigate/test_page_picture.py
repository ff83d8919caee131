"""What the page shows, drawn in software: pictures come, say what the messages say, and nothing is asked elsewhere."""

import hashlib
from math import pi
from pathlib import Path
from urllib.parse import urlsplit

import pytest

import tendonrod.navigate
from navigate.browser import DRAWN, chromium, faultless
from navigate.pretend import PretendSession
from navigate.served import served

BUILT = Path(tendonrod.navigate.__file__).with_name("web")
SOURCES = Path(__file__).parents[2] / "web"
PRESETS = {"Dorsal": (1, 0, 0), "Ventral": (-1, 0, 0), "Left": (0, -1, 0), "Right": (0, 1, 0), "Cranial": (0, 0, 1)}


@pytest.fixture(scope="module")
def browser():
    with chromium(draws=True) as found:
        yield found


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(PretendSession(), tmp_path_factory.mktemp("records")) as found:
        yield found


@pytest.fixture(scope="module")
def tab(browser, server):
    with faultless(browser, server.url, color_scheme="light") as found:
        found.until(DRAWN)
        yield found


def test_the_page_asks_no_other_host(tab, server):
    assert len(tab.asked) > 4
    assert {urlsplit(address).netloc for address in tab.asked} == {urlsplit(server.url).netloc}


def test_pictures_come(tab):
    before = tab.get("tendonrod.framesDrawn")
    tab.until(f"tendonrod.framesDrawn > {before} + 2")
    assert tab.get("document.querySelector('#view-missing').hidden")


@pytest.mark.parametrize("name", PRESETS)
def test_a_camera_stands_where_its_name_says(tab, name):
    """+x dorsal, +y the patient's right, +z cranial; and but for the view from above, cranial is up."""
    tab.get(f"document.querySelector('[data-camera={name}]').click()")
    away = "tendonrod.picture.stage.camera.position.clone().sub(tendonrod.picture.stage.controls.target).normalize()"
    assert tab.get(f"{away}.toArray()") == pytest.approx(PRESETS[name], abs=3e-3)
    tab.get("tendonrod.picture.stage.camera.updateMatrixWorld()")
    up = tab.get("[4, 5, 6].map(i => tendonrod.picture.stage.camera.matrixWorld.elements[i])")
    assert up == pytest.approx((1, 0, 0) if name == "Cranial" else (0, 0, 1), abs=3e-3)


def test_the_section_is_cut_from_the_mesh(tab):
    """The pretended cord is a corner of a cube of 10 mm: its section at z is a triangle of (10 - z)^2 / 2."""
    tab.get("document.querySelector('[data-camera=Oblique]').click()")
    area = """loop => Math.abs(loop.reduce((sum, [x, y], i) => {
        const [u, v] = loop[(i + 1) % loop.length]; return sum + x * v - u * y; }, 0)) / 2"""
    for z in (0.5, 4.0, 9.0):
        loops = tab.get(f"tendonrod.picture.anatomy.parts[0].slicer.cut({z})")
        assert len(loops) == 1
        assert tab.page.evaluate(f"({area})", loops[0]) == pytest.approx((10 - z) ** 2 / 2, rel=1e-3)
    assert tab.get("tendonrod.picture.anatomy.parts[0].slicer.cut(10.5)") == []


def test_the_robot_is_a_tube_around_the_centre_line(tab, server):
    """Every vertex of its mesh lies one radius from the axis x = y = 0, on which the pretended robot goes."""
    tab.take()
    tab.page.keyboard.down("w")
    tab.until("tendonrod.state.insertion > 0.02")
    tab.page.keyboard.up("w")
    tab.until("!tendonrod.state.moving")
    drawn = tab.get("tendonrod.framesDrawn")
    tab.until(f"tendonrod.framesDrawn > {drawn} + 1")
    tube = "tendonrod.picture.stage.robot.geometry"
    count = len(server.session.snapshot.centerline)
    points = tab.get(f"Array.from({tube}.attributes.position.array)")[: 3 * 15 * count]
    radii = [(x * x + y * y) ** 0.5 for x, y in zip(points[::3], points[1::3], strict=True)]
    assert radii == pytest.approx([0.7] * len(radii), rel=1e-4)
    assert max(points[2::3]) == pytest.approx(1e3 * tab.get("tendonrod.state.tip[2]"), abs=1e-3)


def test_gauges_show_the_messages_in_the_units_of_people(tab, server):
    length = server.session.scenario.robot.section.L
    tab.page.wait_for_timeout(200)
    shown = float(tab.text("[data-gauge=insertion] b"))
    assert shown == pytest.approx(1e3 * length * server.session.snapshot.insertion, abs=0.06)
    turned = float(tab.text("[data-gauge=rotation] b").replace("−", "-"))
    assert turned == pytest.approx(server.session.snapshot.posture.rotation * 180 / pi, abs=0.6)
    assert float(tab.text("[data-gauge=clearance-cord] b")) == pytest.approx(1.0, abs=0.01)
    assert tab.text("[data-gauge=clearance-canal] b") == "–"  # infinitely far


def test_dark_and_light_follow_the_system_until_they_are_chosen(tab):
    ground = "getComputedStyle(document.body).backgroundColor"
    light = tab.get(ground)
    tab.page.emulate_media(color_scheme="dark")
    tab.until("document.documentElement.dataset.theme === 'dark'")
    assert tab.get(ground) != light
    tab.page.click("#theme")
    assert tab.get(ground) == light
    tab.page.reload()
    tab.until("window.tendonrod?.state && tendonrod.framesDrawn > 1")
    assert tab.get("document.documentElement.dataset.theme") == "light"


@pytest.mark.parametrize("size", [(1366, 768), (1180, 820), (1024, 768), (820, 1180)])
def test_nothing_is_cut_off_on_laptop_and_tablet(tab, size):
    tab.page.set_viewport_size({"width": size[0], "height": size[1]})
    tab.page.wait_for_timeout(100)
    assert tab.get("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]") == list(size)
    outside = """[...document.querySelectorAll('button, canvas, #gauges, .panel')].filter(one => {
        const box = one.getBoundingClientRect();
        return box.width && !one.closest('.scroll, dialog') && (box.left < 0 || box.right > innerWidth + 1 ||
            box.bottom > innerHeight + 1 || box.height < 8); }).map(one => one.id || one.className)"""
    assert tab.get(outside) == []
    nameless = "one => !(one.textContent || one.ariaLabel || one.title).trim()"
    assert tab.get(f"[...document.querySelectorAll('button')].filter({nameless}).length") == 0


def test_a_phone_needs_no_scrolling_sideways(tab):
    tab.page.set_viewport_size({"width": 390, "height": 844})
    tab.page.wait_for_timeout(100)
    assert tab.get("document.documentElement.scrollWidth") == 390


def test_a_slow_browser_gets_fewer_triangles_and_the_same_sections(tab):
    """A sphere of 5 mm: its coarser mesh stays within a cell of it, and has a fraction of the triangles."""
    anatomy = "tendonrod.picture.anatomy"
    area = tab.get(f"{anatomy}.parts[0].slicer.cut(4)[0].length")
    tab.get(f"{anatomy}.coarsen()")
    assert tab.get(f"{anatomy}.parts[0].slicer.cut(4)[0].length") == area
    sphere = tab.get("""(() => {
        const ball = tendonrod.picture.stage.robot.tip.geometry.clone().scale(5, 5, 5);
        const data = {positions: ball.attributes.position.array, faces: ball.index.array};
        const part = {mesh: {geometry: ball}, look: {cell: 1.2}, data};
        tendonrod.picture.anatomy.thin(part);
        const found = part.mesh.geometry;
        return [ball.index.count, found.index.count, Array.from(found.attributes.position.array)]; })()""")
    before, after, points = sphere
    assert 0 < after < 0.9 * before
    radii = [sum(x * x for x in points[k : k + 3]) ** 0.5 for k in range(0, len(points), 3)]
    assert all(5.0 - 0.6 < radius <= 5.0 + 1e-3 for radius in radii)


def test_a_lost_connection_is_told_and_comes_back(tab):
    tab.get("tendonrod.drop()")
    tab.until("document.querySelector('#banner').innerText.includes('Connection lost: stopped')")
    tab.until("tendonrod.connected")
    tab.until("document.querySelector('#banner').hidden")


def test_the_built_page_is_that_of_the_sources():
    """`make web` was run after the last change: the bundle holds a fingerprint of what it was built from."""
    if not SOURCES.is_dir():
        pytest.skip("an installation without the page's sources")
    files = [path for folder in ("src", "style") for path in (SOURCES / folder).rglob("*") if path.is_file()]
    files += [SOURCES / name for name in ("index.html", "icon.svg", "package.json")]
    found = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files, key=str))).hexdigest()
    assert found in (BUILT / "app.js").read_text(encoding="utf-8")[:300], "run: make web"
    assert (BUILT / "index.html").read_bytes() == (SOURCES / "index.html").read_bytes()
    assert "MIT License" in (BUILT / "LICENSE-three.txt").read_text(encoding="utf-8")
