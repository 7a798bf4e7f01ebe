"""The system's own Chromium on the page of a real daemon, and what it complains about."""

import shutil
import time
from contextlib import contextmanager

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
PHONE = {"width": 390, "height": 844}
PATIENCE = 60_000  # ms; a busy computer is slow, and that is no fault of the page

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (Debian: apt install chromium)")


class Window:
    """A browser window that notes every complaint and every request that leaves this computer's page."""

    def __init__(self, context, base: str) -> None:
        self.base, self.page, self.wrong = base, context.new_page(), []
        self.page.set_default_timeout(PATIENCE)
        self.page.on("console", self._hear)
        self.page.on("pageerror", lambda error: self.wrong.append(f"error: {error}"))
        self.page.on("request", self._watch)

    def _hear(self, message):
        if message.type in ("error", "warning"):
            self.wrong.append(f"{message.type}: {message.text}")

    def _watch(self, request):
        if not request.url.startswith((self.base + "/", "data:")):
            self.wrong.append(f"foreign request: {request.url}")

    def open(self, path):
        """Go to a view and wait until its numbers stand."""
        self.page.goto(self.base + path)
        self.page.wait_for_selector("main[data-drawn=yes]")
        return self

    def wait(self, expression, *values):
        """Poll until a function of JavaScript gives something true; our policy forbids the driver's own way, eval."""
        end = time.monotonic() + PATIENCE / 1000
        while not self.page.evaluate(expression, list(values)):
            assert time.monotonic() < end, f"not in time: {expression} {values}"
            self.page.wait_for_timeout(50)

    def with_charts(self, number=1):
        """Wait until charts are drawn."""
        self.wait("([n]) => document.querySelectorAll('.plot[data-drawn=yes]').length >= n", number)
        return self

    def text(self, selector="main"):
        return self.page.inner_text(selector)

    def wait_for_text(self, selector, wanted):
        self.wait("([where, what]) => document.querySelector(where)?.innerText.includes(what)", selector, wanted)

    def fits(self):
        """Nothing sticks out sideways."""
        return self.page.evaluate("document.documentElement.scrollWidth <= innerWidth + 1")


@contextmanager
def chromium():
    """One browser process, ended on leaving."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def window(browser, base, *, size=None, scheme="light"):
    """A window of its own, without cookies of others."""
    context = browser.new_context(viewport=size or {"width": 1280, "height": 800}, color_scheme=scheme)
    try:
        yield Window(context, base)
    finally:
        context.close()
