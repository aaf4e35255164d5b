"""The page of ``fogsim explore`` in a browser: sliders, what follows from them, and that no request leaves it."""

import re
import subprocess
import sys
from collections.abc import Iterator

import pytest
from early_motorway import EARLY
from playwright.sync_api import Browser, Page, expect

DESK, PHONE = {"width": 1280, "height": 900}, {"width": 390, "height": 844}
SLOW = 60_000.0
"""Time in which what is used for the first time is compiled [ms]."""


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    command = [sys.executable, "-m", "fogsim", "explore", "motorway_fog_bank", "--at", "1", "--no-browser"]
    settings = (EARLY, "duration_s=6", "renderer=cpu", "camera.width=160", "camera.height=120")
    command += [f"--set={one}" for one in settings]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        yield process.stdout.readline().split()[1]
        process.terminate()


@pytest.fixture
def page(browser: Browser, url: str) -> Iterator[Page]:
    page = browser.new_page(viewport=DESK)
    asked: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda message: complaints.append(message.text))
    page.goto(url)
    expect(page.locator("#frames")).to_have_text(re.compile(r"From the last \d+ frames"), timeout=SLOW)
    yield page
    page.close()
    assert complaints == []
    home = url.partition("#")[0]
    assert [address for address in asked if not address.startswith((home, "data:"))] == []


def slide(page: Page, name: str, place: str) -> None:
    page.locator(f"#{name}").evaluate(
        "(slider, place) => { slider.value = place; slider.dispatchEvent(new Event('input')); }", place
    )


def test_sliders_change_the_frame_the_estimates_and_the_advice(page: Page) -> None:
    expect(page.locator("h1")).to_have_text("motorway_fog_bank")
    expect(page.locator("#time-text")).to_have_text("1.0 of 6 s")
    clear = page.locator("#frame").get_attribute("src")
    slide(page, "visibility", "0.26")
    expect(page.locator("#visibility-text")).to_have_text("79.3 m", timeout=SLOW)
    assert page.locator("#frame").get_attribute("src") != clear
    expect(page.locator("#estimates .method")).to_have_count(3)
    expect(page.locator("#sign")).not_to_have_class(re.compile("free"), timeout=SLOW)
    expect(page.locator("#command")).to_contain_text("--set=fog.visibility_m=79.3")
    page.click("#own-fog")
    expect(page.locator("#command")).not_to_contain_text("visibility", timeout=SLOW)
    slide(page, "light", "-1")
    expect(page.locator("#light-text")).to_have_text("0.1 lx", timeout=SLOW)
    expect(page.locator("#day-note")).to_be_empty()
    page.click("#reset")
    expect(page.locator("#day-note")).to_have_text("not drawn by day", timeout=SLOW)


def test_it_plays_to_the_end(page: Page) -> None:
    page.click("#play")
    expect(page.locator("#play")).to_have_text("❚❚")
    expect(page.locator("#time-text")).to_have_text(re.compile(r"^[2-9]"), timeout=SLOW)
    expect(page.locator("#play")).to_have_text("▶", timeout=SLOW)
    expect(page.locator("#frames")).to_have_text(re.compile(r"From the last \d+ frames"), timeout=SLOW)


def test_it_fits_on_a_phone(page: Page) -> None:
    page.set_viewport_size(PHONE)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
