"""docs/scenarios.md names every key, form, kind and scenario there is."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from plant.excitation import FORMS
from plant.motion import Cascade
from plant.profiles import REFERENCES
from plant.scenario import Bursts
from plant.scenario_file import CAUSES, TOP, names, parse_scenario
from plant.sensors import Sensors

PAGE = (Path(__file__).parents[2] / "docs" / "scenarios.md").read_text(encoding="utf-8")
WORDS = set(re.findall(r"[a-z_0-9]+", PAGE))


@pytest.mark.parametrize("table", [*FORMS.values(), *REFERENCES.values(), *CAUSES.values(), Bursts, Cascade, Sensors])
def test_every_key_of_every_table_is_documented(table):
    assert {field.name for field in dataclasses.fields(table)} <= WORDS


def test_every_table_form_kind_and_scenario_is_documented():
    assert {*TOP, *FORMS, *REFERENCES, *CAUSES, *names()} <= WORDS


def test_the_file_of_the_page_is_a_scenario():
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    motion = '[excitation]\nform = "sine"\namplitude = 2.3\nfrequency = 0.2\n'
    scenario = parse_scenario(example + motion, "page", Path())
    assert scenario.burst(0).recording.position[0] == 1.0
    assert "rail_defect" in scenario.effects
