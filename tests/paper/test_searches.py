"""The paper's claims about its identifications (§4.4, §4.5, §4.6), a few seeds; `make paper` runs all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.paper.search_figures import HEAD, TABLE_HEAD, TEXT_4_4, TEXT_TABLE, fig_10, fig_11, page, section_4_4
from tests.paper.searches import (
    DESIGN,
    by_default,
    by_ours,
    by_paper,
    contained,
    default_errors,
    inputs_of_table_1,
    paper_errors,
    record,
    share,
)
from tests.paper.simulations import NOISE, case

PAGE = Path(__file__).parents[2] / "docs" / "paper-searches.md"
READINGS = ["paper-literal", "paper-bump"]
SEEDS = range(4)


def of_the_sine(reading, noise=0.0, seed=0):
    machine = case(reading)
    return machine, *record(machine, machine.sine(), noise, seed)


def test_the_papers_algorithm_errs_as_the_paper_says_it_does():
    machine, recording, clean = of_the_sine("paper-literal")
    runs = [by_paper(machine, recording, clean, seed, DESIGN) for seed in SEEDS]
    errors = np.median([run.errors for run in runs], axis=0)
    assert 0.5 < errors.max() / paper_errors(machine).max() < 2.5
    assert np.median([run.worst for run in runs]) < 1.5e-3  # "less than one millimeter" (§4.4)


@pytest.mark.parametrize("reading", READINGS)
def test_ours_ends_lower_than_the_papers_from_every_seed(reading):
    machine, recording, clean = of_the_sine(reading, NOISE)
    for seed in SEEDS:
        paper = by_paper(machine, recording, clean, seed, DESIGN)
        assert by_ours(machine, recording, clean, seed).criterion <= paper.criterion


@pytest.mark.parametrize("reading", READINGS)
def test_the_default_beats_the_papers_errors_five_times_with_intervals_that_hold(reading):
    machine, recording, _ = of_the_sine(reading)
    for seed in SEEDS:
        result = by_default(machine, recording, seed)
        assert (5 * default_errors(machine, result) < paper_errors(machine)).all()
        assert all(contained(machine, result))


@pytest.mark.parametrize("reading", READINGS)
def test_with_noise_the_intervals_of_the_default_hold_the_truth(reading):
    held = []
    for seed in range(16):
        machine, recording, _ = of_the_sine(reading, NOISE, seed)
        held += [answer for answer in contained(machine, by_default(machine, recording, seed)) if answer is not None]
    assert sum(held) >= 0.85 * len(held)
    assert len(held) >= 16


def test_what_the_paper_calls_very_bad_our_default_does_not_pretend_to_know():
    machine = case("paper-literal")
    squares = [row for row in inputs_of_table_1(machine) if row[0] == "square"]
    for _, _, _, _, excitation in squares:
        recording, _ = record(machine, excitation, NOISE)
        result = by_default(machine, recording, 0)
        assert not result.parameters["stribeck_velocity"].identifiable


def test_the_best_so_far_never_rises_and_belongs_to_its_parameters():
    machine, recording, clean = of_the_sine("paper-literal")
    run = by_paper(machine, recording, clean, 1, DESIGN)
    assert (np.diff(run.best_criteria) <= 0).all()
    assert run.best_values[-1] == pytest.approx(run.values)
    assert len(run.best_values) == DESIGN.generations


def test_the_interval_of_a_share_holds_it():
    low, high = share(5, 20)
    assert 0 < low < 0.25 < high < 1
    assert share(20, 20)[1] == pytest.approx(1.0)


def test_the_page_carries_the_words_of_the_code():
    text = PAGE.read_text(encoding="utf-8")
    for part in (HEAD, TEXT_4_4, TABLE_HEAD, TEXT_TABLE):
        assert part.strip() in text


def test_page_and_plots_can_be_made():
    machine, recording, clean = of_the_sine("paper-literal")
    run = by_paper(machine, recording, clean, 0, DESIGN)
    result = section_4_4(machine, NOISE, 1)
    assert "| literal | ours on eq. (4) |" in page([result], [result], {})
    assert len(fig_10([("one", [run])]).data) == 2
    assert len(fig_11("one", [run], machine.friction.as_array).data) == 4
