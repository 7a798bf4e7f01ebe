"""Key names: one place says how they are spelled, and ids that could break them are refused."""

import pytest
import zenoh

from plant import keys
from plant.errors import ParameterError


def test_keys_are_spelled_as_the_contract_says():
    assert keys.samples_key("plant-1", "axis-0001") == "tribowatch/plant-1/axis-0001/samples"
    assert keys.status_key("plant-1", "a", prefix="fab/w") == "fab/w/plant-1/a/status"
    assert keys.history_key("s", "a", "parameters") == "tribowatch/s/a/history/parameters"
    assert keys.alive_key("s", "daemon") == "tribowatch/s/alive/daemon"
    assert keys.parameters_key("s", "a") == keys.output_key("s", "a", "parameters") == "tribowatch/s/a/parameters"


def test_the_pattern_receives_every_axis_of_the_site_and_nothing_else():
    pattern = zenoh.KeyExpr(keys.samples_pattern("s"))
    assert pattern.intersects(zenoh.KeyExpr(keys.samples_key("s", "x-1")))
    assert not pattern.intersects(zenoh.KeyExpr(keys.samples_key("other", "x-1")))
    assert not pattern.intersects(zenoh.KeyExpr(keys.status_key("s", "x-1")))


@pytest.mark.parametrize("name", ["", "a/b", "*", "$", "a b", "ä", "-a", "x" * 41, "alive", "@adv", "a\n"])
def test_ids_that_could_break_a_key_are_refused(name):
    with pytest.raises(ParameterError, match="axis is"):
        keys.samples_key("s", name)
    with pytest.raises(ParameterError, match="site is"):
        keys.samples_key(name, "a")
    with pytest.raises(ParameterError, match="prefix"):
        keys.samples_key("s", "a", prefix=f"fab/{name}" if "/" not in name else f"/{name}")


def test_site_and_axis_are_read_back_from_a_key():
    assert keys.axis_of("tribowatch/s/a/samples") == ("s", "a")
    assert keys.axis_of("fab/w/s/a/history/alerts", prefix="fab/w") == ("s", "a")
    for key in ("other/s/a/samples", "tribowatch/s", "tribowatch/s/*/samples"):
        with pytest.raises(ParameterError):
            keys.axis_of(key)


def test_unknown_outputs_and_histories_are_refused():
    with pytest.raises(ParameterError, match="must be parameters"):
        keys.output_key("s", "a", "stats")
    with pytest.raises(ParameterError, match="history"):
        keys.history_key("s", "a", "model")
