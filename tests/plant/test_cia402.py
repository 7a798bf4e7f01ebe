"""CiA 402: mappings, scales, states, and the traces that a wrong width leaves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant import cia402
from plant.can_layout import Signal
from plant.can_widths import misfit
from plant.errors import InputError, ParameterError
from tests.plant.can_examples import SCALING

POSITION16 = Signal("position", 0, 16, signed=True, name="P")
POSITION32 = Signal("position", 0, 32, signed=True, name="P")


def test_the_predefined_ids_and_the_packing_of_a_pdo():
    found = cia402.layout(
        "a", 5, [(0, cia402.DEFAULT_TPDO1), (0, ("606C:32", "2033:u16:temperature", "skip:16"))], SCALING
    )
    assert [frame.key for frame in found.frames] == [0x185, 0x285]
    assert [(signal.channel, signal.start, signal.length) for signal in found.frames[1].signals] == [
        ("velocity", 0, 32),
        ("temperature", 32, 16),
    ]
    assert found.frames[1].length == 8
    assert not found.frames[1].is_sampled


def test_gear_and_signs_enter_the_scales():
    scaling = cia402.Scaling(1000.0, 2.4, gear=10.0, sign=-1, torque_sign=1, velocity_per_unit=60.0)
    assert scaling.factor("position") == pytest.approx(-1e-4)
    assert scaling.factor("torque") == pytest.approx(0.0024)
    assert scaling.factor("velocity") == pytest.approx(-1 / 600)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("6064:16", "has 32 bits in CiA 402"),
        ("6077", "is not a mapped object"),
        ("2033:16:colour", "'colour'"),
        ("2033:0:temperature", "1 to 64 bits"),
        ("60ZZ:16", "is not a mapped object"),
    ],
)
def test_objects_that_cannot_be(text, words):
    with pytest.raises(InputError, match=words):
        cia402.parse_object(text)


@pytest.mark.parametrize(
    ("objects", "words"),
    [
        (("6041:16", "6064:32", "6077:16", "6061:8"), "maps 72 bits"),
        (("6064:32", "6077:16", "skip:4"), "maps 52 bits"),
    ],
)
def test_pdos_that_cannot_be(objects, words):
    with pytest.raises(InputError, match=words):
        cia402.layout("a", 1, [(0, objects)], SCALING)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"counts_per_unit": 0.0}, "counts_per_unit is 0"),
        ({"rated_torque": -1.0}, "rated_torque is -1 N"),
        ({"sign": 2}, "sign is 2"),
        ({"gear": float("nan")}, "gear"),
    ],
)
def test_scales_out_of_range(change, words):
    with pytest.raises(ParameterError, match=words):
        cia402.Scaling(**({"counts_per_unit": 1.0, "rated_torque": 1.0} | change))


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (0x0637, "operation enabled"),
        (0x0250, "switch on disabled"),
        (0x0231, "ready to switch on"),
        (0x0018, "fault"),
        (0x0005, None),
    ],
)
def test_states_of_the_drive(word, state):
    assert cia402.drive_state(word) == state
    assert bool(cia402.known_states(np.array([word]))[0]) is (state is not None)


@given(st.integers(5113 * 86_400_000, (5113 + 65_535) * 86_400_000))
def test_the_time_object_keeps_milliseconds_since_1984(milliseconds):
    assert cia402.time_of_day_ns(cia402.time_of_day(milliseconds * 1_000_000)) == milliseconds * 1_000_000


def motion(seed, scale):
    """A position in counts as an axis moves, over `scale` counts."""
    rng = np.random.default_rng(seed)
    t = np.arange(400) * 0.01
    shape = np.sin(rng.uniform(1, 4) * t) + 0.3 * np.sin(rng.uniform(4, 9) * t)
    return np.rint(scale * shape + rng.normal(0, 3, 400)).astype(np.int64)


def wrap16(counts):
    return (counts + 0x8000) % 0x10000 - 0x8000


@given(seed=st.integers(0, 2**32), scale=st.sampled_from([10.0, 1e3, 1e5, 1e6, 1e7, 3e8]))
def test_a_right_layout_is_never_refused(seed, scale):
    assert misfit({"position": (POSITION32, motion(seed, scale))}) is None
    assert misfit({"position": (POSITION16, motion(seed, min(scale, 2e4)))}) is None
    torque = np.random.default_rng(seed).integers(-1000, 1000, 400)
    assert misfit({"torque": (Signal("torque", 0, 16, signed=True, name="T"), torque)}) is None


@given(seed=st.integers(0, 2**32))
def test_the_lower_half_of_a_32_bit_position_is_refused(seed):
    said = misfit({"position": (POSITION16, wrap16(motion(seed, 2e5)))})
    assert said is not None
    assert "turns over at 16 bits" in said


@given(seed=st.integers(0, 2**32))
def test_two_16_bit_values_read_as_one_are_refused(seed):
    low = motion(seed, 5e3)
    high = np.random.default_rng(seed).integers(-900, 900, 400)
    said = misfit({"position": (POSITION32, (high << 16) | (low & 0xFFFF))})
    assert said is not None
    assert "two 16 bit values" in said


def test_other_widths_that_would_fit_are_named():
    assert cia402.other_mappings(cia402.DEFAULT_TPDO1, 6) == ["6041:16 + 6064:16 + 6077:16"]
    assert len(cia402.other_mappings(cia402.DEFAULT_TPDO1, 10)) == 1
    assert cia402.other_mappings(cia402.DEFAULT_TPDO1, 3) == []


def test_emergency_codes_have_words():
    assert "temperature" in cia402.emergency(0x4210)
    assert cia402.emergency(0xFF12) == "manufacturer's own"
    assert "voltage" in cia402.emergency(0x3230)
