"""Reports to file and to send: an identification, and what happened to an axis; one page each that asks nobody."""

import json
import re

import numpy as np
import pytest

from identify.identification import identify_friction
from identify.one_second import one_second_ahead
from monitor.errors import QueryError
from monitor.query_page import PageReader
from monitor.report_file import write_axis_report, write_identification
from plant.errors import InputError
from plant.presets import paper_axis
from plant.recording import Recording
from tests.contracts.command import complaint, tribowatch
from tests.page.browsing import chromium, needs_chromium, window
from tests.scenarios.harness import burst


@pytest.fixture(scope="module")
def identified():
    """Axis, recording and answer of one test run of the paper."""
    axis = paper_axis()
    torque, position = burst(axis, samples=1000)
    t = 0.01 * np.arange(len(torque))
    recording = Recording(t, torque * axis.mechanics.gain, position, sample_time=0.01, note="<b>bold</b>")
    return axis, recording, identify_friction(recording, axis)


@pytest.fixture(scope="module")
def pages(identified, history, tmp_path_factory):
    """Paths of both reports."""
    folder = tmp_path_factory.mktemp("reports")
    axis, recording, found = identified
    write_identification(folder / "identification.html", found, axis, recording)
    with PageReader(f"sqlite:///{history / 'tribowatch.db'}") as reader:
        write_axis_report(folder / "axis.html", reader, "axis-2", "20d")
    return folder


def own(path):
    """A page without plotly's own program, and the figures in it."""
    text = path.read_text(encoding="utf-8")
    figures = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text, flags=re.S)
    return re.sub(r"<script>.*?</script>", "", text, flags=re.S), [json.loads(one) for one in figures]


@pytest.mark.parametrize("name", ["identification", "axis"])
def test_a_report_asks_nobody_and_says_where_it_comes_from(pages, name):
    text, figures = own(pages / f"{name}.html")
    assert "http:" not in text
    assert "https:" not in text
    assert "default-src 'none'" in text
    assert re.search(r"SHA-256 <code>[0-9a-f]{64}</code>", text)
    assert "Seed " in text
    assert "tribowatch 0" in text
    assert len(figures) >= 3
    assert all(figure["data"] for figure in figures)


def test_an_identification_shows_its_numbers_and_its_proof(pages, identified):
    _, recording, found = identified
    text, figures = own(pages / "identification.html")
    for name, one in found.parameters.items():
        assert name.replace("_", " ") in text
        if one.ci95:
            assert f"{one.value:.2g}"[:3] in text
    assert recording.sha256() in text
    assert "&lt;b&gt;bold&lt;/b&gt;" in text
    assert "<b>bold" not in text
    assert figures[0]["layout"]["xaxis"]["title"]["text"] == "speed [m/s]"


def test_one_second_ahead_agrees_with_the_criterion(identified):
    axis, recording, found = identified
    ahead = one_second_ahead(recording, axis, found)
    spread = np.sum((ahead.position - ahead.position.mean()) ** 2)
    assert np.isfinite(ahead.error).all()
    # the same law over the same runs by another road: the front door of the plant instead of the fitted problem
    assert np.sum(ahead.error**2) / spread == pytest.approx(found.criterion, rel=0.2)


def test_an_axis_report_tells_what_happened(pages, history):
    text, figures = own(pages / "axis.html")
    with PageReader(f"sqlite:///{history / 'tribowatch.db'}") as reader:
        alert = reader.alerts("axis-2")[0]
        points = reader.history("axis-2", since_ns=20 * 86_400 * 10**9, parameter="coulomb_force")
    assert alert["recommended_action"] in text.replace("&#x27;", "'")
    assert "Maintenance" in text
    drawn = [figure["data"][-1] for figure in figures if figure["layout"]["xaxis"].get("type") == "date"]
    assert len(points["series"]["coulomb_force"]["points"]) in {len(one["x"]) for one in drawn}


def test_a_report_of_an_axis_without_answers_says_so(history, tmp_path):
    with PageReader(f"sqlite:///{history / 'tribowatch.db'}") as reader:
        write_axis_report(tmp_path / "new.html", reader, "axis-new", "90d")
        assert "Nothing was identified" in own(tmp_path / "new.html")[0]
        for axis, since in (("nobody", "90d"), ("axis-1", "soon")):
            with pytest.raises(QueryError):
                write_axis_report(tmp_path / "x.html", reader, axis, since)
        with pytest.raises(InputError, match="cannot be written"):
            write_axis_report(tmp_path, reader, "axis-1", "90d")


def test_by_command(history, tmp_path):
    path = tmp_path / "r.html"
    done = tribowatch("axes", "report", "axis-2", "--state-dir", history, "--report", path, "--json")
    assert json.loads(done.stdout)["report"] == str(path)
    assert path.stat().st_size > 1e6
    line = complaint(
        tribowatch("axes", "report", "axis-2", "--state-dir", history, "--report", tmp_path / "no" / "x"), 2
    )
    assert "does not exist" in line


@needs_chromium
def test_reports_draw_in_a_browser(pages):
    with chromium() as browser:
        for path in sorted(pages.glob("*.html")):
            with window(browser, f"file://{pages}") as one:
                one.page.goto(path.as_uri())
                one.with_charts(3)
                assert not one.wrong
