"""What an exchange of roles found, refitted from there to what was fitted first."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch import carried as module
from identify.mismatch.carried import carried
from identify.mismatch.compare import Comparison
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.rules import NO_NAME
from identify.mismatch.select import Selection


@dataclasses.dataclass
class Found:
    """A conclusion that names what its selection holds, or nothing."""

    selection: Selection
    explains: bool = True
    evidence: SimpleNamespace = dataclasses.field(default_factory=lambda: SimpleNamespace(held_out=None))
    final: None = None


def step(name, evidence, refused=None):
    problem = SimpleNamespace(p=7, samples=SimpleNamespace(used=1000), gravity_known=False)
    fit = SimpleNamespace(found=SimpleNamespace(criterion=-evidence), problem=problem, names=(name,))
    told = Comparison(-evidence, 3.2, -evidence, 0.3, 0.5, 800.0, 5.0)
    misplaced = refused is not None
    guise = SimpleNamespace(name=name)
    return SimpleNamespace(fit=fit, guise=guise, evidence=told, refused=refused, misplaced=misplaced)


def both_ways(monkeypatch, gained, *, beside=(), aside=(), explains=True):
    """What comes of stiction found with the roles exchanged, which gains so much of what was fitted first."""
    stiction = step("dwell_time_stiction", gained)
    monkeypatch.setattr(module, "starts_from", lambda *_: np.zeros((2, 3)))
    monkeypatch.setattr(module, "fit", lambda *_: stiction.fit)
    monkeypatch.setattr(module, "weighed", lambda *_: stiction)
    baseline = SimpleNamespace(names=aside, problem=SimpleNamespace(guises=(), including=lambda guises: guises))
    first = Found(Selection(baseline, baseline, opening=list(beside)), explains)
    turned = Found(Selection(baseline, stiction.fit, [stiction]))
    return carried(first, turned)


def test_what_an_exchange_of_roles_found_is_the_answer_where_it_is_likeliest(monkeypatch):
    """Three recordings of a wafer handler: stiction with 15 in the first two, 3425 from where the third had led."""
    drag = step("level_above_speed", 1650.0, "the evidence comes from few places (z = 1.6)")
    found = both_ways(monkeypatch, 3425.0, beside=[drag])
    assert [one.guise.name for one in found.selection.steps] == ["dwell_time_stiction"]
    assert found.selection.opening[0] is drag


@pytest.mark.parametrize(
    "other",
    [
        {"beside": [step("frictional_lag", 5000.0, NO_NAME)]},
        {"aside": ("dwell_time_stiction",)},
        {"explains": False},
    ],
)
def test_it_is_none_where_something_else_is_likelier_or_it_does_not_stand(monkeypatch, other):
    assert both_ways(monkeypatch, 3425.0, **other) is None


def test_nothing_is_carried_where_the_exchange_found_nothing():
    nothing = Found(Selection(SimpleNamespace(names=()), None))
    assert carried(nothing, nothing) is None


@pytest.mark.parametrize(
    ("foreseen", "z", "unseen", "hints"),
    [(392.0, 5.5, 0.7, True), (200.0, 5.5, 0.7, False), (392.0, 2.0, 0.7, False), (392.0, 5.5, 0.9, False)],
)
def test_unseen_data_may_hint_at_what_the_fitted_ones_do_not_hold(foreseen, z, unseen, hints):
    """A drag of which slow jogs say nothing (-4), and fast strokes 392."""
    told = Comparison(4.0, 0.7, 9.0, 1.01, unseen, foreseen, z)
    drag = SimpleNamespace(evidence=told, misplaced=False, guise=SimpleNamespace(depends=None))
    assert Conclusion.hinted.fget(SimpleNamespace(selection=SimpleNamespace(opening=[drag]))) is hints
