import numpy as np
import pytest

from identify.coding import encode
from identify.errors import ParameterError
from identify.genetic import GeneticAlgorithm, GeneticSettings

LOW, HIGH = np.full(4, -1.0), np.full(4, 1.0)


def bowl(x):
    return ((x - 0.3) ** 2).sum(axis=1)


def run(settings, seed, criterion=bowl):
    ga = GeneticAlgorithm(LOW, HIGH, settings, np.random.default_rng(seed))
    best = []
    for _ in range(settings.generations):
        ga.tell(criterion(ga.ask()))
        best.append(ga.best_criterion)
    return ga, best


def test_the_same_seed_gives_the_same_search_bit_by_bit():
    first, second = (run(GeneticSettings(generations=20), 7)[0] for _ in range(2))
    assert (first.ask() == second.ask()).all()
    assert first.best_criterion == second.best_criterion


def test_the_best_individual_known_is_never_lost():
    ga, best = run(GeneticSettings(generations=30), 3)
    assert (np.diff(best) <= 0).all()
    assert (ga.ask() == ga.best).all(axis=1).any()


def test_it_finds_the_bottom_of_a_bowl_from_any_seed():
    ends = [run(GeneticSettings(generations=60), seed)[1][-1] for seed in range(20)]
    assert np.median(ends) < 0.01
    assert max(ends) < 0.05


def test_without_mutation_and_crossover_only_the_worst_is_replaced():
    settings = GeneticSettings(population=6, crossover_rate=0.0, mutation=0.0)
    ga = GeneticAlgorithm(LOW, HIGH, settings, np.random.default_rng(0))
    before = ga.ask()
    values = bowl(before)
    ga.tell(values)
    after = {tuple(x) for x in ga.ask()}
    assert tuple(before[np.argmax(values)]) not in after
    assert tuple(before[np.argmin(values)]) in after
    assert after <= {tuple(x) for x in before}


def test_crossover_exchanges_tails_and_keeps_every_bit_in_the_pair():
    settings = GeneticSettings(population=8, crossover_rate=1.0, mutation=0.0)
    ga = GeneticAlgorithm(LOW, HIGH, settings, np.random.default_rng(1))
    parents = ga._codes.copy()
    children = ga._cross(parents)
    assert not (np.sort(children, axis=0) == np.sort(parents, axis=0)).all()
    bits = np.arange(settings.bits)
    count = [((codes[..., None] >> bits) & 1).sum(axis=0) for codes in (parents, children)]
    assert (count[0] == count[1]).all()


def test_the_share_of_flipped_bits_is_the_mutation_probability():
    settings = GeneticSettings(population=100, mutation=0.05)
    ga = GeneticAlgorithm(LOW, HIGH, settings, np.random.default_rng(2))
    zeros = np.zeros((2500, 4), dtype=np.int64)
    flipped = ((ga._mutate(zeros)[..., None] >> np.arange(8)) & 1).mean()
    assert flipped == pytest.approx(0.05, abs=4 * np.sqrt(0.05 * 0.95 / zeros.size / 8))


def test_mu_counts_improvements_and_raises_the_mutation_up_to_a_limit():
    ga = GeneticAlgorithm(LOW, HIGH, GeneticSettings(), np.random.default_rng(0))
    assert ga.mutation == 0.03
    for value in np.linspace(1.0, 0.1, 200):
        ga.tell(np.full(50, value))
    assert ga.mu == 200
    assert ga.mutation == 0.1


def test_diverged_simulations_do_not_stop_it():
    ga, _ = run(GeneticSettings(generations=5), 0, lambda x: np.where(x[:, 0] > 0, np.inf, bowl(x)))
    assert np.isfinite(ga.best_criterion)


def test_given_parents_take_the_first_places():
    seed = np.array([[0.1, 0.2, 0.3, 0.4]])
    ga = GeneticAlgorithm(LOW, HIGH, GeneticSettings(bits=16), np.random.default_rng(0), seed)
    assert (encode(ga.ask()[:1], LOW, HIGH, 16) == encode(seed, LOW, HIGH, 16)).all()


@pytest.mark.parametrize(
    "wrong", [{"population": 5}, {"population": 2}, {"bits": 1}, {"mutation": 1.1}, {"crossover_rate": -0.1}]
)
def test_settings_out_of_range_are_named(wrong):
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        GeneticSettings(**wrong)
