"""`diagnose --report`: one page that holds everything, asks nobody for anything, and draws in a browser."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.grids import FEWEST
from identify.mismatch.pictures import Prediction
from identify.mismatch.result import Verdict
from monitor.cli.app import run_command
from monitor.picture_values import figures_of, picture_values
from monitor.report_figures import pictures_figures, prediction_figure
from monitor.report_file import write_report
from monitor.report_heat import grid_figure
from plant.axis_file import read_axis
from plant.errors import InputError
from plant.recording_files import read_recording_entry
from tests.reference.cases import CaseSpec, draw_case, write_case

CHROMIUM = Path("/usr/bin/chromium")
HIDDEN = {"seed": 5101, "effects": ("viscous_asymmetry",), "excitation": "sine", "size": 0.7}
QUIET = {"seed": 5001, "excitation": "multisine", "duration": 12.0}
STILL = {"seed": 5301, "excitation": "still", "duration": 12.0}


def written(folder, **spec):
    """Axis file, axis and recordings of a case of the independent simulator."""
    axis_file = write_case(draw_case(CaseSpec(**spec)), folder)
    axis = read_axis(axis_file)
    return axis_file, axis, [read_recording_entry(entry, axis) for entry in axis.recordings]


def page_of(folder, **spec):
    """The diagnosis of a case, and its page as text."""
    _, axis, recordings = written(folder, **spec)
    found = diagnose(recordings, axis)
    path = folder / "report.html"
    write_report(path, found, axis, recordings)
    return found, path.read_text(encoding="utf-8")


def own(page: str) -> str:
    """The page without plotly's own program."""
    return re.sub(r"<script>.*?</script>", "", page, flags=re.S)


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    """A machine with one hidden effect: its folder, diagnosis and page."""
    folder = tmp_path_factory.mktemp("hidden")
    return folder, *page_of(folder, **HIDDEN)


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """A machine with nothing hidden: its folder, diagnosis and page."""
    folder = tmp_path_factory.mktemp("quiet")
    return folder, *page_of(folder, **QUIET)


def test_the_page_says_verdict_sizes_rivals_seed_and_data(hidden):
    _, found, page = hidden
    text = own(page)
    assert found.verdict is Verdict.EXPLAINED
    assert '<span class="verdict explained">explained</span>' in text
    assert found.data_sha256 in text
    assert "Seed 0" in text
    for effect in found.effects:
        assert effect.name.replace("_", " ") in text
        for name, quantity in effect.parameters.items():
            assert name.replace("_", " ") in text
            assert f"{quantity.value:.2g}"[:3] in text
    refused = [one for one in found.pictures.tried if one.outcome != "named"]
    assert refused
    assert all(one.outcome in text for one in refused)


@pytest.mark.parametrize("case", ["hidden", "quiet"])
def test_nothing_is_fetched_from_anywhere(case, request):
    _, _, page = request.getfixturevalue(case)
    assert not re.findall(r"<(?:script|link|img|iframe|source)\b[^>]*\b(?:src|href)\s*=", page.split("<script>")[0])
    assert "http://" not in own(page)
    assert "https://" not in own(page)
    assert "default-src 'none'" in page


def test_pictures_show_what_the_effect_takes_away(hidden):
    _, found, _ = hidden
    pictures = found.pictures
    along = pictures.maps[0]
    assert along.coordinate == "speed"
    left = [float(np.nanmean(half.even**2)) for half in (along.before, along.after)]
    assert left[1] < 0.5 * left[0]
    steps = np.diff(pictures.accrual.running)
    assert pictures.accrual.running[-1] > 25.0
    assert pictures.accrual.gained.sum() == pytest.approx(pictures.accrual.running[-1], rel=0.02)
    assert np.mean(steps > 0) > 0.5
    assert np.sum(pictures.prediction.after**2) < 0.7 * np.sum(pictures.prediction.before**2)
    ratio = np.sum(pictures.prediction.after**2) / np.sum(pictures.prediction.before**2)
    assert ratio == pytest.approx(found.fit["extended"].held_out / found.fit["baseline"].held_out, rel=1e-6)


def test_with_nothing_missing_the_page_lists_what_could_hide(quiet):
    _, found, page = quiet
    assert found.verdict is Verdict.NO_MISMATCH
    assert "What could still hide" in page
    assert "What is left out" not in page
    assert all(name.replace("_", " ") in own(page) for name in found.detectable)
    assert found.pictures.accrual is None
    assert all(one.after is None for one in found.pictures.maps)


def test_data_that_cannot_tell_make_a_page_with_the_reason(tmp_path):
    found, page = page_of(tmp_path, **STILL)
    assert found.verdict is Verdict.INSUFFICIENT_DATA
    assert found.reason in own(page)
    assert page.count('class="plot"') == 1


def test_the_command_writes_the_page_beside_pure_json(tmp_path, capsys):
    axis_file, _, _ = written(tmp_path, **STILL)
    page = tmp_path / "page.html"
    assert run_command(["diagnose", "--axis", str(axis_file), "--report", str(page), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["verdict"] == "insufficient_data"
    assert "pictures" not in said
    assert said["reason"] in page.read_text(encoding="utf-8")


def test_a_report_that_cannot_be_written_is_refused_before_the_work(tmp_path, capsys):
    axis_file, axis, recordings = written(tmp_path, **STILL)
    nowhere = str(tmp_path / "none" / "page.html")
    assert run_command(["diagnose", "--axis", str(axis_file), "--report", nowhere]) == 2
    assert "does not exist" in capsys.readouterr().err
    with pytest.raises(InputError, match="cannot be written"):
        write_report(tmp_path, diagnose(recordings, axis), axis, recordings)


@pytest.mark.skipif(not CHROMIUM.exists(), reason="no /usr/bin/chromium to open the page in")
@pytest.mark.parametrize("case", ["hidden", "quiet"])
def test_every_plot_is_drawn_in_a_browser(case, request, tmp_path):
    folder, _, page = request.getfixturevalue(case)
    browser = [
        str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}",
        "--enable-logging=stderr", "--virtual-time-budget=20000", "--dump-dom", f"file://{folder}/report.html",
    ]  # fmt: skip
    done = subprocess.run(browser, capture_output=True, text=True, timeout=240, check=True)
    shutil.rmtree(tmp_path, ignore_errors=True)
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert not said
    assert done.stdout.count('data-drawn="yes"') == page.count('class="plot"')


def test_what_the_daemon_keeps_draws_the_same_figures(hidden):
    """The pictures go through JSON into the history; the page draws them by the code of the report."""
    _, found, _ = hidden
    kept = json.loads(json.dumps(picture_values(found.pictures), allow_nan=False))
    assert len(json.dumps(kept)) < 200_000  # bytes a diagnosis may add to the history
    location = None if found.location is None else found.location.to_dict()
    drawn = figures_of(kept, location)
    grids = [(one.other, grid_figure(one, found.pictures.force_unit, found.location)) for one in found.pictures.grids]
    original = [*grids, *pictures_figures(found.pictures, found.location)]
    assert len(drawn) == len(original) + 2  # the build-up of the evidence, and the predictions
    for (_, before), after in zip(original, drawn, strict=False):
        for one, other in zip(before["data"], after["figure"]["data"], strict=True):
            shown = "z" if one["type"] == "heatmap" else "y"
            known, again = (np.array(figure[shown], dtype=float) for figure in (one, other))  # None becomes NaN
            np.testing.assert_allclose(again, known, rtol=5e-3, equal_nan=True)


def test_over_two_coordinates_what_was_not_visited_stays_empty(hidden):
    _, found, page = hidden
    over = {one.other: one for one in found.pictures.grids}
    assert set(over) == {"velocity", "time"}
    for one in over.values():
        assert one.count.shape == one.before.shape == (len(one.edges) - 1, len(one.position) - 1)
        np.testing.assert_array_equal(np.isnan(one.before), one.count < FEWEST)
        assert 0.2 < np.mean(np.isnan(one.before)) < 0.95  # a sine never stands in the middle of its stroke
    edges = over["velocity"].edges
    fast = edges[:-1] > 0.3 * edges[-1]  # near standstill the turn of friction is blurred
    left = [abs(np.nanmean(force[fast])) for force in (over["velocity"].before, over["velocity"].after)]
    assert left[1] < 0.5 * left[0]
    drawn = grid_figure(over["velocity"], "N", found.location)
    scale = drawn["layout"]["coloraxis"]
    assert scale["cmin"] == -scale["cmax"] < 0
    assert len(drawn["data"]) == 2
    assert "grey where too little was measured" in own(page)


def test_no_line_is_drawn_over_what_lies_between_two_stretches_of_unseen_data():
    t = np.concatenate([np.arange(0.0, 2.0, 0.01), np.arange(4.0, 6.0, 0.01), np.arange(0.0, 1.0, 0.01)])
    error = np.zeros(len(t))
    seen = Prediction(t, np.arange(len(t)) // 100, t, error, error)
    measured, *_ = prediction_figure(seen, "m")["data"]
    gaps = [index for index, place in enumerate(measured["y"]) if place is None]
    assert gaps == [200, 401]  # a new free run within a stretch is no gap
