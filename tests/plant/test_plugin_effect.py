"""docs/effects.md says how to add an effect: its example is installed and run here, word for word."""

import importlib
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from plant import effects
from plant.errors import InputError
from plant.kernels.laws import LANES, STAGE_FORCE, TO_STAGE, VELOCITY, law
from plant.machine import Plan, march
from plant.presets import paper_axis, paper_friction, paper_torque
from plant.simulation import simulate

PAGE = (Path(__file__).parents[2] / "docs" / "effects.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE, re.DOTALL)
PYTHON = [text for language, text in BLOCKS if language == "python"]
ENTRY = next(text for language, text in BLOCKS if language == "toml" and "entry-points" in text)


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The example as an installed distribution: its file, and the entry point that the page shows."""
    (tmp_path / "brush_drag.py").write_text(next(text for text in PYTHON if "EFFECT = " in text))
    information = tmp_path / "brush_drag-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: brush-drag\nVersion: 1.0\n")
    name, target = re.search(r'^(\w+) = "(.+)"$', ENTRY, re.MULTILINE).groups()
    (information / "entry_points.txt").write_text(f"[{effects.GROUP}]\n{name} = {target}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    effects.find.cache_clear()
    yield name
    effects.find.cache_clear()
    sys.modules.pop("brush_drag", None)


def test_the_entry_point_of_the_page_names_our_group():
    assert f'[project.entry-points."{effects.GROUP}"]' in ENTRY


def test_the_example_of_the_page_is_an_effect_like_any_other(installed):
    assert effects.names() == (*effects.CATALOGUE, installed)
    axis = paper_axis()
    torque = paper_torque(axis, samples=600)
    given = {"amplitude": 20.0, "low": 0.1, "high": 0.2}

    def run(**chosen):
        return simulate(axis, paper_friction(), torque, effects=chosen, substeps=8)

    plain, brushed = run(), run(brush_drag=given)
    outside = plain.position < 0.1
    first = int(np.argmax(~outside))
    np.testing.assert_array_equal(brushed.position[:first], plain.position[:first])
    rubbing = (brushed.position > 0.105) & (brushed.position < 0.195) & (brushed.velocity > 0.05)
    law = paper_friction().force(brushed.velocity)
    np.testing.assert_allclose((brushed.friction_force - law)[rubbing], 20.0, atol=0.5)
    back = (brushed.position > 0.105) & (brushed.position < 0.195) & (brushed.velocity < -0.05)
    assert back.any()
    np.testing.assert_allclose((brushed.friction_force - law)[back], 0.0, atol=0.5)
    both = run(brush_drag=given, rail_defect={"amplitude": 10.0, "centre": 0.15, "width": 0.02})
    assert both.position[first + 60] < brushed.position[first + 60]
    zero = run(brush_drag={**given, "amplitude": 0.0})
    assert np.array_equal(zero.position, plain.position)
    with pytest.raises(InputError, match=r"brush_drag\.amplitude is -1 N, but must be from 0 to 10000 N"):
        run(brush_drag={**given, "amplitude": -1.0})


@law(TO_STAGE)
def _drag_by_stage(t, h, p, x, b):
    for j in range(LANES):
        b[STAGE_FORCE + j] += p[j] * b[VELOCITY + j] * abs(b[VELOCITY + j])


def test_a_law_of_both_velocity_stages_is_second_order_like_the_rest():
    axis, friction = paper_axis(), paper_friction()
    force = axis.mechanics.gain * paper_torque(axis, samples=600)
    t = 0.01 * np.arange(600)
    own = effects.Effect("own", (effects.Parameter("c", "N*s^2/m^2", (0.0, 1e3), absent=0.0),), (_drag_by_stage,))
    twice = effects.Effect("twice", own.parameters, (_drag_by_stage, _drag_by_stage))

    def end(effect, value, substeps):
        blocks = Plan(effects.Surroundings.of(axis), (effect,)).blocks(friction.as_array[:, None], np.array([[value]]))
        blocks.place(0.0, 0.0, force[0])
        return march(blocks, t, force[:-1], force[:-1], substeps)[0, :, 0]

    truth = end(effects.find("quadratic_drag"), 100.0, 200)
    errors = [np.abs(end(own, 100.0, substeps) - truth).max() for substeps in (4, 8, 16)]
    assert errors[0] < 1e-5
    assert errors[2] < errors[0] / 10
    np.testing.assert_allclose(end(twice, 50.0, 4), end(own, 100.0, 4), atol=1e-13)


def test_an_entry_point_that_is_no_effect_is_named(installed, tmp_path):
    (tmp_path / "brush_drag.py").write_text("EFFECT = 'nothing'\n")
    with pytest.raises(InputError, match=r"the plug-in brush_drag of entry point group tribowatch\.effects"):
        effects.find(installed)


@pytest.mark.parametrize("code", [text for text in PYTHON if "EFFECT = " not in text])
def test_the_other_snippets_of_the_page_run(code, capsys):
    scope = {}
    exec(code, scope)
    assert "path" not in scope or np.isfinite(scope["path"].position).all()
    assert "parameter" not in scope or "rail_defect width m" in capsys.readouterr().out
