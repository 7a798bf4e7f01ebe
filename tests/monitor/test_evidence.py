"""Evidence of an alert: kept when it rises, says what it holds, and replays to the same verdict."""

import csv
import dataclasses
import io
import json
import zipfile

import numpy as np
import pytest

from monitor.axis_run import model_from
from monitor.cli import app  # noqa: F401  registers the commands
from monitor.cli.app import run_command
from monitor.errors import QueryError
from monitor.estimate import Parameter
from monitor.evidence import MANIFEST, WINDOW, contents, unpack
from monitor.evidence_fit import LAW, fit_of
from monitor.evidence_replay import replay
from monitor.queries import Reader
from monitor.samples import Samples
from plant.presets import paper_friction
from plant.simulation import simulate
from tests.monitor.estimates import estimate
from tests.monitor.test_pipeline import AXIS, Bench, workers  # noqa: F401  a fixture
from tests.scenarios.harness import START_NS, blocks_of, burst

DAY_NS = 86_400 * 10**9


@pytest.fixture(scope="module")
def jammed(tmp_path_factory, workers):  # noqa: F811
    """A history in which friction jumps up from one day to the next, then silence."""
    folder = tmp_path_factory.mktemp("jammed")
    bench = Bench(folder, workers, window={"samples": 2000, "hop": 2000}, drift={"baseline_windows": 6})
    for day in range(12):
        torque, position = burst(AXIS, 1.6 if day > 7 else 1.0, seed=day)
        for block in blocks_of("axis-1", 1, 2000 * day, START_NS + day * DAY_NS, torque, position):
            bench.put(block)
        bench.finish()
    bench.step(200.0)
    bench.store.close()
    return folder, bench


def test_every_alert_has_its_evidence(jammed):
    with Reader(jammed[1].url) as reader:
        kept = {one["kind"]: one for one in reader.evidence_list("axis-1")}
        alerts = {one["kind"]: one for one in reader.alerts("axis-1")}
        assert set(kept) == set(alerts) >= {"jam", "stale"}
        for kind, one in kept.items():
            bundle = unpack(reader.evidence(one["number"]))
            assert bundle.manifest["alert"]["id"] == alerts[kind]["id"]
            assert one["at_ns"] == alerts[kind]["since_ns"]
            assert one["transition"] is not None


def evidence_of(jammed, kind="jam"):
    with Reader(jammed[1].url) as reader:
        number = next(one["number"] for one in reader.evidence_list() if one["kind"] == kind)
        return number, reader.evidence(number)


def test_what_it_says_it_contains_is_there(jammed):
    _, blob = evidence_of(jammed)
    told = contents(blob)
    assert all(name in told["readme"] for name in told["files"] if name != "README.txt")
    for word in ("site/axis-1/jam/1", "no passwords", "replay-evidence"):
        assert word in told["readme"]
    with zipfile.ZipFile(io.BytesIO(blob)) as archive:
        rows = list(csv.DictReader(io.StringIO(archive.read(WINDOW).decode())))
    position, fit, residual = (
        np.array([float(row[name] or "nan") for row in rows]) for name in ("position", "fit_position", "residual")
    )
    assert len(rows) == 2000
    assert np.allclose(residual, position - fit, equal_nan=True)
    assert np.isfinite(fit).mean() > 0.95
    assert np.sqrt(np.nanmean(residual**2)) < 0.01 * np.ptp(position)


@pytest.mark.parametrize("kind", ["jam", "stale"])
def test_it_replays_to_the_same_verdict(jammed, kind, tmp_path, capsys):
    number, blob = evidence_of(jammed, kind)
    file = tmp_path / "evidence.zip"
    words = ["alerts", "evidence", str(number), "--export", str(file), "--state-dir", str(jammed[0]), "--json"]
    assert run_command(words) == 0
    assert json.loads(capsys.readouterr().out)["files"][MANIFEST] > 100
    assert file.read_bytes() == blob
    assert run_command(["alerts", "replay-evidence", str(file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    if kind == "stale":
        assert told["same"] is None
        return
    assert (told["same"], told["bit_for_bit"], told["differences"]) == (True, True, [])
    assert "jam" in told["holding"]["now"]


def test_what_was_tampered_with_does_not_replay(jammed):
    bundle = unpack(evidence_of(jammed)[1])
    bundle.samples.position[100:] += 1e-3
    told = replay(bundle)
    assert not told["same"]
    assert "data_sha256" in told["differences"][0]


def damaged(blob, **changes):
    """The same zip with another manifest."""
    body = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(blob)) as old, zipfile.ZipFile(body, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            if name == MANIFEST:
                text = json.dumps(json.loads(text) | changes).encode()
            new.writestr(name, text)
    return body.getvalue()


@pytest.mark.parametrize("number", ["0", "999", str(10**25)])
def test_a_number_under_which_nothing_is_kept(jammed, number, capsys):
    assert run_command(["alerts", "evidence", number, "--state-dir", str(jammed[0])]) == 2
    assert f"there is no evidence number {number}" in capsys.readouterr().err


def test_what_is_no_evidence_is_said_so(jammed, tmp_path, capsys):
    blob = evidence_of(jammed)[1]
    for wrong, said in (
        (b"GIF89a", "no evidence of tribowatch"),
        (blob[:2000], "no evidence of tribowatch"),
        (damaged(blob, schema_version=99), "another version"),
        (damaged(blob, window={}), "damaged"),
    ):
        with pytest.raises(QueryError, match=said):
            unpack(wrong)
    assert run_command(["alerts", "replay-evidence", str(tmp_path / "none.zip")]) == 2
    assert "cannot be read" in capsys.readouterr().err


def test_the_fit_knows_promoted_effects():
    torque, _ = burst(AXIS)
    defect = {"amplitude": 30.0, "centre": 1.0, "width": 0.05}
    law = paper_friction()
    position = simulate(AXIS, law, torque, sample_time=0.01, effects={"rail_defect": defect}, position0=1.0).position
    samples = Samples(1, 0, START_NS + np.arange(2000) * 10**7, np.asarray(torque), position)
    names = {name: getattr(law, name) for name in LAW}
    misses = []
    for more in ({}, {f"rail_defect.{name}": value for name, value in defect.items()}):
        found = tuple(Parameter(name, value, "1") for name, value in (names | more).items())
        fit = fit_of(samples, AXIS, dataclasses.replace(estimate(0), parameters=found))
        misses.append(np.sqrt(np.nanmean((fit.position - position) ** 2)))
    assert misses[1] < 0.5 * misses[0]
    assert model_from({"rail_defect": defect}) == (
        ("rail_defect",),
        {f"rail_defect.{name}": value for name, value in defect.items()},
    )
