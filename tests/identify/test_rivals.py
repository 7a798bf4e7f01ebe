"""What a set of names is compared with, where nothing tells it from another."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch import rivals
from identify.mismatch.rivals import fit_of


class Model(SimpleNamespace):
    """A fit that knows its guises, and where each begins."""

    def __init__(self, *names, criterion=0.0):
        guises = [SimpleNamespace(name=name, stiff=False) for name in names]
        problem = SimpleNamespace(guises=tuple(guises), slot=lambda _: slice(0, 1), gravity_known=True)
        super().__init__(problem=problem, x=np.zeros(1), found=SimpleNamespace(criterion=criterion))

    @property
    def names(self):
        return tuple(guise.name for guise in self.problem.guises)


@pytest.fixture
def refitted(monkeypatch):
    """A fit is its names."""
    monkeypatch.setattr(rivals, "trimmed", lambda _, kept: Model(*(guise.name for guise in kept)))
    monkeypatch.setattr(rivals, "extend", lambda model, guise, _: (Model(*model.names, guise.name), np.zeros((1, 1))))
    monkeypatch.setattr(rivals, "fit", lambda model, _: model)


def tried(*names, criterion=0.0):
    model = Model(*names, criterion=criterion)
    return SimpleNamespace(fit=model, guise=model.problem.guises[-1])


def test_beside_a_rival_stands_what_is_taken_into_account_beside_the_names(refitted):
    """A train case: an asymmetry beside a gap was called a constant force, likelier by 617; beside as much, less by 32.

    Its model had the clocks apart and viscous friction that differs with the direction, neither of which had a name.
    """
    chosen = Model("dead_time", "force_offset", "viscous_asymmetry", "backlash")
    bare = tried("backlash", "coulomb_asymmetry")
    found = fit_of({"backlash", "coulomb_asymmetry"}, {"backlash", "force_offset"}, chosen, [[bare]], ())
    assert set(found.names) == {"backlash", "coulomb_asymmetry", "dead_time", "viscous_asymmetry"}


def test_the_best_fit_that_was_seen_stands_for_a_rival_where_nothing_else_is_in_the_model(refitted):
    chosen = Model("backlash", "force_offset")
    seen = [tried("backlash", "coulomb_asymmetry", criterion=value) for value in (3.0, -2.0, 1.0)]
    found = fit_of({"backlash", "coulomb_asymmetry"}, {"backlash", "force_offset"}, chosen, [seen], ())
    assert found is seen[1].fit
