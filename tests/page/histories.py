"""A history as a daemon would have left it, without the cost of identification: estimates, judged by the real watch."""

import dataclasses
import json
from pathlib import Path

import numpy as np

from identify.mismatch.grids import Grid
from identify.mismatch.maps import Halves, Map
from identify.mismatch.pictures import Accrual, Pictures, Prediction
from monitor.alarms import AlarmRule
from monitor.drift import DriftRule, DriftState, indicators, judge
from monitor.estimate import Parameter
from monitor.judgement import apply
from monitor.picture_values import picture_values
from monitor.samples import Outcome, StreamState, Window, WindowId
from monitor.store import Store
from monitor.store_records import DiagnosisRecord
from plant.presets import paper_axis
from tests.monitor.estimates import DAY_NS, LAW, estimate

SITE = "test-site"
START_NS = 1_767_225_600 * 10**9  # 2026-01-01
SAMPLES = 2000
RULE = DriftRule()
UNITS = {"coulomb_force": "N", "static_force": "N", "stribeck_velocity": "m/s", "viscous_coefficient": "N*s/m"}
WORDS = ("coulomb", "static", "stribeck", "viscous")


def answer(number, rng, growth=1.0, every_ns=DAY_NS // 2):
    """Estimate `number` of an axis whose dry friction has grown by `growth`, with everything a page shows."""
    made = estimate(number, rng, coulomb=growth, static=growth)
    start = START_NS + number * every_ns
    values = {name: LAW[word] * (growth if word in WORDS[:2] else 1.0) for name, word in zip(UNITS, WORDS, strict=True)}
    parameters = tuple(Parameter(name, v, UNITS[name], 0.99 * v, 1.01 * v) for name, v in values.items())
    sure = {"identifiable": True, "at_bound": False}
    shown = {
        one.name: {"value": one.value, "unit": one.unit, "ci95": [one.low, one.high], **sure} for one in parameters
    }
    return dataclasses.replace(
        made,
        window=Window(WindowId(1, number * SAMPLES, SAMPLES), start, start + 20 * 10**9),
        parameters=parameters,
        result={"verdict": "identified", "parameters": shown, "seed": 7},
        conditions={"temperature": 21.0 + 2 * np.sin(number), "mean_speed": 0.2, "travel": 0.5},
        seconds=0.3,
    )


def write_axis_history(store, axis, windows, growth=lambda _: 1.0, seed=0, every_ns=DAY_NS // 2):
    """`windows` answers of `axis`, judged one after the other; gives its alarms by kind."""
    record = store.register([axis])[axis.name]
    rng = np.random.default_rng(seed)
    answers = [answer(k, rng, growth(k), every_ns) for k in range(windows)]
    last = answers[-1].window
    record.samples, record.last_ns = windows * SAMPLES, last.end_ns
    record.stream = StreamState(1, windows * SAMPLES, last.end_ns)
    rows = store.commit([(record, Outcome(windows=[one.window for one in answers]))])
    state, alarms = DriftState(), {}
    for one, (_, row, _) in zip(answers, rows, strict=True):
        state, findings = judge(state, one, RULE)
        record.drift = state.to_dict()
        touched, changes = apply(SITE, axis.name, alarms, findings, one.window.end_ns, lambda _: AlarmRule())
        store.mark_told(store.save(record, row, one, indicators(state, one, RULE), touched, changes))
    return alarms


def named(name):
    """The paper's axis under another name."""
    return dataclasses.replace(paper_axis(), name=name)


def wearing(k):
    """Growth of dry friction: healthy for 40 windows, then half a per cent a window."""
    return 1.0 + max(0, k - 40) * 0.005


def write_diagnosis(store, axis):
    """A diagnosis of `axis` as the daemon stores one: its JSON, and the pictures beside it. Gives its number."""
    record = store.register([axis])[axis.name]
    rng = np.random.default_rng(0)
    middle = np.linspace(0.1, 1.9, 48)
    bump = 40 * np.exp(-(((middle - 0.62) / 0.05) ** 2))
    noise = [Halves(*rng.standard_normal((3, 48))) for _ in range(2)]
    before = dataclasses.replace(noise[0], odd=noise[0].odd + bump)
    t = np.arange(400) * 0.01
    pictures = Pictures(
        maps=(Map("position", "m", middle, before, noise[1]),),
        grids=(grid(),),
        accrual=Accrual(t, np.linspace(0, 300, 400), middle, bump),
        prediction=Prediction(t, np.repeat([0, 1, 2, 3], 100), np.sin(t), 1e-3 * np.cos(t), 1e-4 * np.cos(t)),
        tried=(), screened=(), friction={}, samples={"fitted": 400, "unseen": 400}, sample_time=0.01,
        position_unit="m", force_unit="N",
    )  # fmt: skip
    result = json.loads((Path(__file__).parent / "diagnosis.json").read_text())
    result["pictures"] = picture_values(pictures)
    last = record.last_ns
    seen = DiagnosisRecord(last, START_NS, last, "explained", result, [[1, 0, SAMPLES]], 0, "0.1.0", 4.2)
    return store.add_diagnosis(record.id, seen)


def grid():
    """A rail defect over position and velocity; the corners were never visited."""
    across, along = np.linspace(0.0, 2.0, 41), np.linspace(-0.4, 0.4, 21)
    x, v = np.meshgrid(0.5 * (across[1:] + across[:-1]), 0.5 * (along[1:] + along[:-1]))
    visited = np.abs(v) < 0.4 * np.sqrt(np.clip(1.0 - (x - 1.0) ** 2, 0.0, 1.0))
    force = np.where(visited, 30.0 * np.sign(v) * np.exp(-(((x - 0.62) / 0.04) ** 2)), np.nan)
    return Grid("velocity", "m/s", "m", across, along, np.where(visited, 9, 0), force, 0.02 * force)


def write_history(path, *, worn=("axis-2",), healthy=("axis-1",), windows=80):
    """A database at `path` with healthy and worn axes, and one that never sent anything."""
    store = Store(f"sqlite:///{path}")
    for number, name in enumerate((*worn, *healthy)):
        write_axis_history(store, named(name), windows, wearing if name in worn else lambda _: 1.0, seed=number)
    write_diagnosis(store, named(worn[0]))
    names = (*worn, *healthy, "axis-new")
    store.register([named(name) for name in names])
    store.close()
    return names
