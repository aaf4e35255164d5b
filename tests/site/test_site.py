"""The documentation site is built without a warning, and a browser finds all of it in order (``make browse``).

It is opened from its folder, as by somebody who has nothing else: no server, no network, no checkout.
"""

import re
import sys
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlparse

import pytest
from playwright.sync_api import Browser, Error, Page, Request

from tests.helpers.command import run_program

CHECKOUT = Path(__file__).resolve().parents[2]
PHONE = {"width": 390, "height": 844}
DESK = {"width": 1280, "height": 900}

SOUGHT = {
    "the meaning of each column of steps.parquet": ("reference/results.html", "stepsparquet"),
    "how V_met enters a frame": ("explanation/physics.html", "how-v_met-enters-a-frame"),
    "how to add an estimator": ("how_to/own_estimator.html", ""),
    "what a policy gains at V_met 60 m": ("benchmarks/policies.html", ""),
    "what a key of a scenario file means": ("reference/scenarios.html", "keys"),
    "how to run every table again, and to cite": ("benchmarks/reproducibility.html", ""),
}
"""What a newcomer looks for, and where it is."""

QUERIES = {
    "steps.parquet columns": "reference/results.html",
    "overdriving": "reference/metrics.html",
    "register an estimator": "how_to/own_estimator.html",
    "Koschmieder": "explanation/",
}
"""What is typed into the search, and the page (or folder) that must be among what is found."""

RUN = "08_airlight"
"""The notebook that is run here: `make notebooks` runs them all."""

pytestmark = pytest.mark.timeout(900)


@dataclass(frozen=True)
class Visit:
    """What a browser found on a page; of its links, `told` are those of its text."""

    links: tuple[str, ...]
    told: tuple[str, ...]
    anchors: frozenset[str]
    dead_pictures: tuple[str, ...]
    width: int
    complaints: tuple[str, ...]
    elsewhere: tuple[str, ...]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    # Material tells of its own future at each start otherwise.
    setting = {"NO_MKDOCS_2_WARNING": "1", "NOTEBOOKS_NOT_RUN": "0[1-7]_*"}
    command = (sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder)
    done = run_program(*command, cwd=CHECKOUT, environment=setting)
    assert "WARNING" not in done.stderr
    return folder


@pytest.fixture(scope="module")
def visits(site: Path, browser: Browser) -> dict[str, Visit]:
    """Every page of the site, at the width of a phone, by its path."""
    pages = sorted(path for path in site.rglob("*.html") if path.name != "404.html")
    # A page of the browser's for all: a new one takes twice as long as what is looked for.
    page = browser.new_page(viewport=PHONE)
    return {path.relative_to(site).as_posix(): visited(page, path) for path in pages}


def visited(page: Page, path: Path) -> Visit:
    complaints: list[str] = []
    elsewhere: list[str] = []

    def watch(request: Request) -> None:
        if not request.url.startswith(("file:", "data:", "blob:")):
            elsewhere.append(request.url)

    def complain(error: Error) -> None:
        complaints.append(str(error))

    def miss(request: Request) -> None:
        # What is cut off by going on to the next page was not needed.
        if request.failure != "net::ERR_ABORTED":
            complaints.append(f"not loaded: {request.url}")

    page.on("pageerror", complain)
    page.on("requestfailed", miss)
    page.on("request", watch)
    page.goto(path.as_uri())
    page.evaluate("for (const i of document.images) i.loading = 'eager'")
    page.wait_for_function("[...document.images].every(i => i.complete)")
    found = Visit(
        links=tuple(page.eval_on_selector_all("a[href]", "all => all.map(a => a.href)")),
        told=tuple(page.eval_on_selector_all("article a[href]", "all => all.map(a => a.href)")),
        anchors=frozenset(page.eval_on_selector_all("[id]", "all => all.map(e => e.id)")),
        dead_pictures=tuple(page.evaluate("[...document.images].filter(i => !i.naturalWidth).map(i => i.src)")),
        width=page.evaluate("document.documentElement.scrollWidth"),
        complaints=tuple(complaints),
        elsewhere=tuple(elsewhere),
    )
    page.remove_listener("pageerror", complain)
    page.remove_listener("requestfailed", miss)
    page.remove_listener("request", watch)
    return found


def led_to(link: str, site: Path) -> tuple[str, str] | None:
    """Page and anchor of a link within the site; none of one that leads out of it."""
    address, anchor = urldefrag(link)
    if urlparse(address).scheme != "file":
        return None
    path = Path(unquote(urlparse(address).path))
    return path.relative_to(site).as_posix(), unquote(anchor)


def test_pages_load_with_their_figures_and_ask_nobody(visits: dict[str, Visit]) -> None:
    assert len(visits) > 80
    assert {name: visit.complaints for name, visit in visits.items() if visit.complaints} == {}
    assert {name: visit.dead_pictures for name, visit in visits.items() if visit.dead_pictures} == {}
    assert {name: visit.elsewhere for name, visit in visits.items() if visit.elsewhere} == {}


def test_notebooks_show_what_they_print_and_draw(site: Path) -> None:
    text = (site / "notebooks" / f"{RUN}.html").read_text(encoding="utf-8")
    assert text.count('class="jp-RenderedImage') >= 1
    assert re.findall(r'<div[^<>]*"application/vnd.jupyter.stderr"', text) == []


def test_no_link_is_dead(visits: dict[str, Visit], site: Path) -> None:
    dead = []
    for name, visit in visits.items():
        for link in visit.links:
            target = led_to(link, site)
            if target is None:
                continue
            page, anchor = target
            there = visits[page].anchors if page in visits else ()
            if not (site / page).is_file() or (anchor and anchor not in there):
                dead.append(f"{name}: {page}#{anchor}")
    assert dead == []


def test_a_phone_shows_every_page_without_moving_it_sideways(visits: dict[str, Visit]) -> None:
    assert {name: visit.width for name, visit in visits.items() if visit.width > PHONE["width"]} == {}


@pytest.mark.parametrize("question", SOUGHT)
def test_it_is_found_within_two_clicks(question: str, visits: dict[str, Visit], site: Path) -> None:
    page, anchor = SOUGHT[question]
    assert page in visits
    assert not anchor or anchor in visits[page].anchors

    # The navigation has every page in a drawer, which would make all of this true.
    def led(name: str) -> set[str]:
        return {target[0] for link in visits[name].told if (target := led_to(link, site)) and target[0] in visits}

    once = led("index.html")
    assert page in once | set().union(*map(led, once))


@pytest.mark.parametrize("query", QUERIES)
def test_search_finds_it(query: str, browser: Browser, site: Path) -> None:
    page = browser.new_page(viewport=DESK)
    page.goto((site / "index.html").as_uri())
    page.click(".md-search__input")
    # The theme listens to keys, as a person presses them.
    page.locator(".md-search__input").press_sequentially(query)
    page.wait_for_selector(".md-search-result__item a", timeout=30_000)
    found = page.eval_on_selector_all(".md-search-result__item a", "all => all.map(a => a.href)")
    assert any(QUERIES[query] in link for link in found[:20]), found[:20]
    page.close()


def test_text_can_be_read_on_a_phone(browser: Browser, site: Path) -> None:
    page = browser.new_page(viewport=PHONE)
    page.goto((site / "tutorial" / "first_run.html").as_uri())
    size = page.evaluate("parseFloat(getComputedStyle(document.querySelector('article p')).fontSize)")
    assert size >= 14
    page.click("label.md-header__button[for='__drawer']")
    assert page.is_visible(".md-nav--primary")
    page.close()
