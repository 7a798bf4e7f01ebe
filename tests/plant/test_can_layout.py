"""The compiled decoding says what cantools says, for every kind of signal, and our own frames survive a round trip."""

import cantools
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from plant.can_layout import AxisLayout, Frame, Signal, decode_signal, encode_frame, frame_key, show_id
from plant.dbc_cantools import dbc_layout
from plant.errors import InputError, ParameterError
from tests.plant.can_examples import drive


@st.composite
def signals(draw):
    """A signal in an 8-byte frame, as DBC text and as its description."""
    big = draw(st.booleans())
    is_float = draw(st.booleans())
    length = draw(st.sampled_from([32, 64])) if is_float else draw(st.integers(1, 64))
    first = draw(st.integers(0, 64 - length))  # bits from the frame's first bit, in the order of the bytes
    start = 8 * (first // 8) + 7 - first % 8 if big else first
    signed = draw(st.booleans()) or is_float
    scale = draw(st.sampled_from([1.0, 0.1, 1e-6, 0.0024, -0.5, 2.0]))
    offset = draw(st.sampled_from([0.0, -40.0, 0.5]))
    return start, length, big, signed, is_float, scale, offset


def dbc(start, length, big, signed, is_float, scale, offset):
    kind = {32: 1, 64: 2}[length] if is_float else 0
    text = f'VERSION ""\nNS_ :\nBS_:\nBU_: A\nBO_ 385 M: 8 A\n SG_ S : {start}|{length}@{0 if big else 1}'
    text += f'{"-" if signed else "+"} ({scale!r},{offset!r}) [0|0] "" A\n\n'
    return text + (f"SIG_VALTYPE_ 385 S : {kind};\n" if kind else "")


@settings(max_examples=200)
@given(signal=signals(), payload=st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=8))
@example((7, 64, True, True, True, 2.0, 0.0), [b"\x7f\xe0" + 6 * b"\0"])
def test_every_signal_decodes_as_cantools_decodes_it(signal, payload):
    start, length, big, signed, is_float, scale, offset = signal
    message = cantools.database.load_string(dbc(*signal), "dbc").get_message_by_name("M")
    expected = [message.decode(one, decode_choices=False)["S"] for one in payload]
    ours = Signal("position", start, length, big, signed, is_float, scale, offset)
    decoded = decode_signal(ours, np.frombuffer(b"".join(payload), dtype=np.uint8).reshape(-1, 8))
    with np.errstate(over="ignore"):
        np.testing.assert_allclose(decoded, np.array(expected, dtype=float), rtol=4e-16, atol=0)


@given(
    position=st.lists(st.integers(-(2**31), 2**31 - 1), min_size=1, max_size=50),
    torque=st.integers(-(2**15), 2**15 - 1),
)
def test_what_the_simulated_drive_encodes_is_decoded_to_the_same_counts(position, torque):
    (frame,) = drive().frames
    count = len(position)
    values = {"position": 1e-6 * np.array(position), "torque": np.full(count, 0.008 * torque)}
    payload = encode_frame(frame, values | {"statusword": np.full(count, 0x0637)}, count)
    by_channel = {signal.channel: decode_signal(signal, payload) for signal in frame.signals}
    np.testing.assert_allclose(by_channel["position"], values["position"], rtol=1e-15, atol=1e-20)
    np.testing.assert_allclose(by_channel["torque"], values["torque"], rtol=1e-15, atol=1e-20)
    assert set(by_channel["statusword"]) == {0x0637}


def test_ids_of_29_bits_are_other_ids():
    assert frame_key(0x181) != frame_key(0x181, extended=True)
    assert (show_id(frame_key(0x181)), show_id(frame_key(0x18FF0102, True))) == ("0x181", "0x18FF0102x")


@pytest.mark.parametrize(
    ("signals", "words"),
    [
        ((Signal("position", 0, 32),), "one of torque and force"),
        ((Signal("torque", 0, 16),), "with position"),
        ((Signal("position", 0, 16), Signal("position", 16, 16), Signal("torque", 32, 16)), "position"),
    ],
)
def test_a_layout_needs_each_channel_once(signals, words):
    with pytest.raises(ParameterError, match=words):
        AxisLayout("a", (Frame(1, 8, signals, "M"),))


def test_signals_beyond_their_frame_and_odd_floats_are_refused():
    with pytest.raises(ParameterError, match="end of S in M"):
        Frame(1, 4, (Signal("position", 16, 32, name="S"),), "M")
    with pytest.raises(ParameterError, match="float"):
        Signal("position", 0, 12, is_float=True, name="S").span()


DBC = """\
VERSION ""
NS_ :
BS_:
BU_: M
BO_ 385 AX1: 8 M
 SG_ Status : 0|16@1+ (1,0) [0|0] "" M
 SG_ Position : 16|32@1- (1E-06,0) [0|0] "m" M
 SG_ Torque : 48|16@1- (0.0024,0) [0|0] "Nm" M
BO_ 2566840066 AX2: 8 M
 SG_ Position : 7|32@0- (0.001,0) [0|0] "mm" M
 SG_ Torque : 39|16@0- (0.1,-5) [0|0] "Nm" M
BO_ 386 MUX: 8 M
 SG_ Which M : 0|8@1+ (1,0) [0|0] "" M
 SG_ Value m1 : 8|16@1+ (1,0) [0|0] "" M
"""


@pytest.fixture
def dbc_file(tmp_path):
    path = tmp_path / "plant.dbc"
    path.write_text(DBC)
    return path


def test_a_dbc_gives_frames_scales_and_29_bit_ids(dbc_file):
    found = dbc_layout(dbc_file, "a", {"position": "AX2.Position", "torque": "AX2.Torque"}, {"position": 1e-3})
    (frame,) = found.frames
    assert frame.key == frame_key(0x18FEDF02, True)
    payload = np.array([[0, 0, 7, 208, 0, 100, 0, 0]], dtype=np.uint8)
    values = {signal.channel: decode_signal(signal, payload)[0] for signal in frame.signals}
    assert values == {"position": pytest.approx(0.002), "torque": pytest.approx(5.0)}


@pytest.mark.parametrize(
    ("signals", "words"),
    [
        ({"position": "AX1.Postion", "torque": "AX1.Torque"}, "AX1.Position"),
        ({"position": "Position", "torque": "AX1.Torque"}, "AX1.Position (0x181), AX2.Position (0x18FEDF02x)"),
        ({"position": "AX1.Position"}, "torque and force"),
    ],
)
def test_signals_that_cannot_be_are_named_with_what_is_there(dbc_file, signals, words):
    with pytest.raises(InputError) as caught:
        dbc_layout(dbc_file, "a", signals, {})
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_no_dbc_is_one_line(tmp_path):
    (tmp_path / "x.dbc").write_text("BO_ nonsense\n")
    for name in ("x.dbc", "none.dbc"):
        with pytest.raises(InputError, match=name):
            dbc_layout(tmp_path / name, "a", {"position": "P", "torque": "T"}, {})
