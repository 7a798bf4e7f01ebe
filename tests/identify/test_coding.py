import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from identify.coding import decode, encode


@given(code=st.integers(0, 255), low=st.floats(-1e3, 1e3), span=st.floats(1e-3, 1e3))
def test_decoding_then_encoding_gives_the_code_back(code, low, span):
    assert encode(np.array([decode(np.array([code]), low, low + span)]), low, low + span).item() == code


@given(bits=st.integers(2, 16))
def test_the_ends_of_the_range_are_the_first_and_the_last_code(bits):
    low, high = np.array([0.0, -3.0]), np.array([40.0, 5.0])
    assert (decode(np.zeros(2, dtype=np.int64), low, high, bits) == low).all()
    assert np.allclose(decode(np.full(2, 2**bits - 1), low, high, bits), high)


def test_equation_3_is_met_at_the_papers_example():
    assert decode(np.array([51]), np.array([0.0]), np.array([40.0])).item() == 40.0 / 255 * 51


def test_values_outside_the_range_take_its_ends():
    assert encode(np.array([[-1.0], [9.0]]), np.array([0.0]), np.array([2.0])).ravel().tolist() == [0, 255]


def test_a_parameter_held_at_one_value_decodes_to_it():
    low = high = np.array([3.0])
    assert decode(encode(np.array([3.0]), low, high), low, high).item() == 3.0
