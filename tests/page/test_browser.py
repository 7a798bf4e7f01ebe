"""The page in a real browser on a real daemon: views, live news, commands, deep links, a thousand axes."""

import dataclasses

import pytest

from monitor.commands import CommandBox
from monitor.store import Store
from plant.wire import CBOR, encode_block
from tests.page.browsing import PHONE, chromium, needs_chromium, window
from tests.page.conftest import Served
from tests.page.histories import SAMPLES, START_NS, named, write_history
from tests.scenarios.harness import Plant, blocks_of, burst

pytestmark = needs_chromium
VIEWS = {
    "/": 0, "/axes/axis-2": 2, "/axes/axis-new": 0, "/alerts": 0, "/alerts/axis-2/wear": 1, "/alerts/axis-1/jam": 0,
    "/diagnoses/axis-1": 0,
    "/diagnoses/axis-2": 0, "/diagnoses/axis-2/1": 3, "/system": 0,
}  # fmt: skip
DRAWN = ("/", "/axes/axis-2", "/alerts/axis-2/wear", "/diagnoses/axis-2/1")  # those that change most with the window


@pytest.fixture(scope="module")
def browser():
    with chromium() as one:
        yield one


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """A daemon that goes on with a history of a healthy and a worn axis."""
    folder = tmp_path_factory.mktemp("browser")
    (folder / "var").mkdir()
    names = write_history(folder / "var" / "tribowatch.db")
    with Plant(folder, axes=names) as one:
        one.start()
        yield one


@pytest.fixture(scope="module")
def base(plant):
    return (plant.folder / "var" / "page.url").read_text().strip().rstrip("/")


@pytest.fixture(scope="module")
def shots(tmp_path_factory):
    """Where the pictures go: kept with pytest's base directory, to be looked at."""
    folder = tmp_path_factory.getbasetemp() / "screenshots"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.mark.parametrize(
    ("name", "size", "scheme"), [("light", None, "light"), ("dark", None, "dark"), ("phone", PHONE, "light")]
)
def test_every_view_draws_without_complaint_and_from_here_alone(browser, base, shots, name, size, scheme):
    with window(browser, base, size=size, scheme=scheme) as one:
        for path, charts in VIEWS.items() if name == "light" else {path: VIEWS[path] for path in DRAWN}.items():
            one.open(path).with_charts(charts)
            assert one.fits(), f"{path} is wider than the window"
            one.page.screenshot(path=shots / f"{name}{path.replace('/', '_')}.png", full_page=True)
        assert not one.wrong


def test_news_arrive_while_the_page_is_open(browser, base, plant):
    with window(browser, base) as one:
        one.open("/axes/axis-1")
        one.wait_for_text("#live", "live")
        before = one.text(".figures")
        start = START_NS + 200 * 86_400 * 10**9
        with plant.session() as session:
            key = "tribowatch/test-site/axis-1/samples"
            torque, position = burst(dataclasses.replace(plant.axis, name="axis-1"))
            for block in blocks_of("axis-1", 1, 80 * SAMPLES, start, torque, position):
                payload, encoding = encoded(block)
                session.put(key, payload, encoding=encoding)
            one.wait_for_text(".figures", "2026-07-20")
        assert one.text(".figures") != before
        assert not one.wrong


def encoded(block):
    return encode_block(block), CBOR


def test_acknowledge_and_shelve(browser, base):
    with window(browser, base) as desk, window(browser, base) as wall:
        wall.open("/")
        wall.wait_for_text("#live", "live")
        assert "look soon" in wall.text("tr[data-axis=axis-2]")
        desk.open("/alerts/axis-2/wear")
        desk.page.click("[data-action=acknowledge]")
        desk.page.fill("dialog [name=author]", "Olga")
        desk.page.click("dialog button.primary")
        desk.wait_for_text("#state", "acknowledged")
        wall.wait_for_text("tr[data-axis=axis-2]", "acknowledged")  # without being touched
        desk.page.click("[data-action=shelve]")
        desk.page.select_option("dialog [name=for]", "30d")
        assert desk.page.input_value("dialog [name=author]") == "Olga"  # asked once
        desk.page.click("dialog button.primary")
        desk.wait_for_text("#state", "shelved")
        wall.wait_for_text("tr[data-axis=axis-2]", "set aside")
        desk.wait_for_text("main", "acknowledged → shelved")
        assert "Olga" in desk.text()
        desk.page.click("[data-action=unshelve]")
        desk.page.click("dialog button.primary")
        desk.wait_for_text("#state", "unacknowledged")
        assert not desk.wrong
        assert not wall.wrong


def test_maintenance_is_noted_and_drawn(browser, base):
    with window(browser, base) as one:
        one.open("/axes/axis-2").with_charts(2)
        one.page.click("[data-action=event]")
        one.page.fill("dialog [name=text]", "relubricated <b>twice</b>")
        one.page.fill("dialog [name=author]", "Olga")
        one.page.click("dialog button.primary")
        one.wait_for_text("main", "relubricated <b>twice</b>")
        assert not one.wrong


def test_a_link_shows_the_same_to_somebody_else(browser, base):
    with window(browser, base) as one:
        one.open("/axes/axis-2").with_charts(2)
        one.page.click("button:has-text('7 days')")
        one.page.select_option("select[aria-label='Parameter drawn']", "coulomb_force")
        one.page.wait_for_url("**/axes/axis-2?since=7d&parameter=coulomb_force")
        address = one.page.url
        one.open("/?q=AXIS-2")
        assert "axis-1" not in one.text("tbody")
        one.page.goto(base + "/#/axes/axis-1")  # who types a fragment is led to the view, not left with the fleet
        one.page.wait_for_url("**/axes/axis-1")
        assert not one.wrong
    with window(browser, base) as other:
        other.open(address.removeprefix(base)).with_charts(2)
        assert other.page.get_attribute("button:has-text('7 days')", "aria-pressed") == "true"
        assert other.page.input_value("select[aria-label='Parameter drawn']") == "coulomb_force"
        assert not other.wrong


def test_keys_and_colours(browser, base):
    with window(browser, base) as one:
        one.open("/")
        one.page.keyboard.press("j")
        assert one.page.evaluate("document.activeElement.matches('a.row')")
        one.page.keyboard.press("/")
        assert one.page.evaluate("document.activeElement.id") == "search"
        one.page.keyboard.press("Escape")
        one.page.keyboard.press("?")
        assert "next, previous row" in one.text("dialog")
        one.page.click("dialog button")
        one.page.click("#theme")
        assert one.page.evaluate("document.documentElement.dataset.theme") == "dark"
        one.page.keyboard.press("s")
        one.page.wait_for_url("**/system")
        assert one.page.evaluate("document.documentElement.dataset.theme") == "dark"
        assert not one.wrong


def test_a_thousand_axes_and_a_daemon_that_goes_away(browser, tmp_path):
    store = Store(f"sqlite:///{tmp_path / 'tribowatch.db'}")
    store.register([named(f"axis-{k:04}") for k in range(1000)])
    store.close()
    served = Served(tmp_path)
    try:
        with window(browser, served.url) as one:
            one.open("/")
            assert one.page.locator("tbody tr").count() == 1000
            one.page.fill("#search", "0999")
            assert one.page.locator("tbody tr").count() == 1
            one.page.fill("#search", "nowhere")
            assert "No axis matches" in one.text()
            assert not one.wrong
            one.wait_for_text("#live", "live")
            served.close()
            one.wait_for_text("#live", "away")
    finally:
        if served.server is not None:
            served.close()


def test_an_empty_history_says_what_to_do(browser, tmp_path):
    Store(f"sqlite:///{tmp_path / 'tribowatch.db'}").close()
    served = Served(tmp_path)
    try:
        assert isinstance(served.box, CommandBox)
        with window(browser, served.url) as one:
            for path, words in {
                "/": "axes init",
                "/alerts": "No alarm was ever raised",
                "/axes/x": "not in the history",
            }.items():
                one.page.goto(served.url + path)
                one.wait_for_text("main", words)
    finally:
        served.close()
