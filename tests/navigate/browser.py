"""Chromium for the tests of the page: Debian's, without a window; small pages, since it draws in software."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from playwright.sync_api import Browser, sync_playwright

PATIENCE = 15.0  # s, on a loaded machine
NAMES = ("chromium", "chromium-browser", "google-chrome")
QUIET = ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--no-first-run"]
FLAT = "--disable-3d-apis"  # no WebGL: the controls are then tested without waiting for pictures
SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
DRAWN = "tendonrod.framesDrawn > 1 && tendonrod.picture.anatomy.parts.length > 0"
PADS = "window.pads = []; navigator.getGamepads = () => window.pads;"


@contextmanager
def chromium(*, draws: bool) -> Iterator[Browser]:
    """A browser; draws: whether it has WebGL. Skips the test where there is none, and fails on CI."""
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        reason = "no chromium on this machine: apt-get install chromium"
        (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=[*QUIET, *(SOFTWARE if draws else [FLAT])])
        yield browser
        browser.close()


@contextmanager
def faultless(browser: Browser, url: str, **options: Any) -> Iterator[Tab]:
    """A page whose script has had no fault by the end; options: of its context."""
    tab = Tab(browser, url, **options)
    yield tab
    assert not tab.faults
    tab.context.close()


class Tab:
    """One page of a served session. sent: what it said; asked: addresses it asked for; faults: errors of its script."""

    def __init__(self, browser: Browser, url: str, **options: Any) -> None:
        self.context = browser.new_context(viewport={"width": 700, "height": 520}, **options)
        self.page, self.sent = self.context.new_page(), []
        self.asked: list[str] = []
        self.faults: list[str] = []
        self.page.add_init_script(PADS)
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("websocket", self._listen)
        self.page.goto(url)
        self.until("window.tendonrod?.state && tendonrod.connected")

    def _listen(self, socket: Any) -> None:
        self.asked.append(socket.url)
        socket.on("framesent", lambda text: self.sent.append(text))

    def said(self, kind: str) -> list[dict[str, Any]]:
        """The messages of one type that were sent so far."""
        self.get("0")  # playwright hands over what it heard while it waits for an answer
        return [message for message in map(json.loads, self.sent) if message["type"] == kind]

    def get(self, expression: str) -> Any:
        return self.page.evaluate(expression)

    def until(self, expression: str) -> Any:
        """Wait until it is true in the page. (The page's own policy forbids playwright's way of waiting.)"""
        end = time.monotonic() + PATIENCE
        while not (value := self.get(expression)):
            assert time.monotonic() < end, f"never true: {expression}"
            self.page.wait_for_timeout(20)
        return value

    def start(self) -> None:
        """Nothing held, no dialog open, this page in control, the robot retracted."""
        for key in ("w", "s", "a", "d", "q", "e", "ArrowUp"):
            self.page.keyboard.up(key)
        self.page.mouse.up()
        self.lose_pad()
        self.get("document.querySelectorAll('dialog[open]').forEach(dialog => dialog.close())")
        self.until("tendonrod.connected")
        if not self.get("tendonrod.control.you"):
            self.take()
        self.page.click("#reset")
        self.until("tendonrod.state.insertion === 0 && !tendonrod.state.moving")

    def take(self) -> None:
        self.page.click("#take")
        self.until("tendonrod.control.you")

    def pad(self, *axes: float, held: tuple[int, ...] = ()) -> None:
        """What a gamepad shows from now on: its axes and the buttons held."""
        buttons = [{"pressed": i in held, "value": float(i in held)} for i in range(16)]
        pad = {"connected": True, "index": 0, "id": "Pad (test)", "axes": list(axes), "buttons": buttons}
        self.page.evaluate("pad => { window.pads = [pad]; }", pad)

    def lose_pad(self) -> None:
        self.page.evaluate("window.pads = []")

    def dispatch(self, event: str) -> None:
        self.page.evaluate(f"window.dispatchEvent(new Event('{event}'))")

    def text(self, selector: str) -> str:
        return self.page.inner_text(selector)
