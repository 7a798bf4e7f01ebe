"""The payload: what goes in comes out, every rule refuses with its reason, and no bytes do more than be refused."""

import dataclasses
import json
import math
import random

import cbor2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant.cbor_map import TypedArray, read_map
from plant.errors import PayloadError
from plant.wire import CBOR, JSON, MAX_BYTES, REASONS, Block, decode_block, encode_block
from plant.wire_rules import CHANNELS

T0 = 1_800_000_000_000_000_000


def block(**changes):
    whole = Block(
        "axis-0001",
        7,
        2000,
        T0 + np.arange(3) * 10_000_000,
        np.array([0.1, 0.2, 0.3]),
        torque=np.array([1.0, 2.0, 3.0]),
    )
    return dataclasses.replace(whole, **changes)


def same(a, b):
    assert (a.axis, a.epoch, a.seq, a.dt_ns, a.channels()) == (b.axis, b.epoch, b.seq, b.dt_ns, b.channels())
    np.testing.assert_array_equal(a.t_ns, b.t_ns)
    for name in a.channels():
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


values = st.floats(allow_nan=True, allow_infinity=False) | st.floats(-1e3, 1e3, width=32)


@st.composite
def blocks(draw):
    n = draw(st.integers(1, 12))
    channel = st.lists(values, min_size=n, max_size=n).map(np.array)
    if draw(st.booleans()):
        dt_ns = draw(st.integers(1, 10**9))
        t_ns = draw(st.integers(0, T0)) + dt_ns * np.arange(n)
    else:
        dt_ns = None
        t_ns = np.cumsum(draw(st.lists(st.integers(1, 10**9), min_size=n, max_size=n)))
    drive = draw(st.sampled_from(["torque", "force"]))
    optional = {name: draw(channel) for name in CHANNELS[3:] if draw(st.booleans())}
    return Block(
        axis=draw(st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}", fullmatch=True).filter(lambda s: s != "alive")),
        epoch=draw(st.integers(0, 2**63 - 1)),
        seq=draw(st.integers(0, 2**62)),
        t_ns=t_ns,
        dt_ns=dt_ns,
        position=draw(channel),
        **{drive: draw(channel)},
        **optional,
    )


@given(block=blocks(), encoding=st.sampled_from([CBOR, JSON, "application/cbor;tribowatch.block.v1"]))
@settings(max_examples=200, deadline=None)
def test_a_block_survives_the_wire(block, encoding):
    same(decode_block(encode_block(block, encoding), encoding), block)


@pytest.mark.parametrize(("order", "f4", "f8", "i8"), [("<", 85, 86, 79), (">", 81, 82, 75)])
def test_both_byte_orders_and_widths_are_read_as_another_library_writes_them(order, f4, f8, i8):
    def tagged(tag, kind, numbers):
        return cbor2.CBORTag(tag, np.array(numbers, f"{order}{kind}").tobytes())

    payload = cbor2.dumps(
        {"v": 1, "axis": "a", "epoch": 1, "seq": 0, "t0_ns": T0, "t_ns": tagged(i8, "i8", [T0, T0 + 5])}
        | {"force": tagged(f4, "f4", [1.5, math.nan]), "position": tagged(f8, "f8", [0.1, 0.2])}
    )
    got = decode_block(payload, CBOR)
    assert got.force.dtype == got.position.dtype == np.float64
    assert got.force[0] == 1.5
    assert np.isnan(got.force[1])
    assert got.position.tolist() == [0.1, 0.2]
    assert got.t_ns.tolist() == [T0, T0 + 5]


def test_float32_stays_float32_and_takes_half_the_bytes():
    wide = encode_block(block())
    narrow = encode_block(block(torque=np.float32([1, 2, 3]), position=np.float32([1, 2, 3])))
    assert len(wide) - len(narrow) == 2 * (3 * 4 + 1)  # 24 bytes need a longer CBOR head than 12
    assert {value.tag for value in cbor2.loads(narrow).values() if isinstance(value, cbor2.CBORTag)} == {79, 85}


def test_json_shows_nan_as_null_and_reads_by_eye():
    content = json.loads(encode_block(block(torque=np.array([1.0, np.nan, 3.0]), dt_ns=10_000_000), JSON))
    assert content["torque"] == [1.0, None, 3.0]
    assert list(content) == ["v", "axis", "epoch", "seq", "t0_ns", "dt_ns", "torque", "position"]


GOOD = {
    "v": 1,
    "axis": "a",
    "epoch": 1,
    "seq": 0,
    "t0_ns": T0,
    "dt_ns": 10_000_000,
    "torque": [1, 2],
    "position": [0.1, 0.2],
}
GONE = object()
STAMPED = {"dt_ns": GONE, "t_ns": [T0, T0 + 1]}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"v": 2}, "bad_version"),
        ({"v": True}, "bad_version"),
        ({"v": GONE}, "missing_key"),
        ({"axis": GONE}, "missing_key"),
        ({"position": GONE}, "missing_key"),
        ({"torque": GONE}, "missing_key"),
        ({"force": [1, 2]}, "missing_key"),
        ({"temprature": [1, 2]}, "unknown_key"),
        ({"axis": "alive"}, "bad_id"),
        ({"axis": "a/b"}, "bad_id"),
        ({"axis": 5}, "bad_id"),
        ({"epoch": -1}, "bad_seq"),
        ({"epoch": 2**63}, "bad_seq"),
        ({"epoch": 1.5}, "bad_type"),
        ({"seq": -1}, "bad_seq"),
        ({"seq": 2**63 - 1}, "bad_seq"),
        ({"seq": True}, "bad_type"),
        ({"seq": "1"}, "bad_type"),
        ({"t0_ns": GONE}, "bad_time"),
        ({"t0_ns": -1}, "bad_time"),
        ({"t0_ns": 2**63 - 5}, "bad_time"),
        ({"t0_ns": 1.8e18}, "bad_type"),
        ({"dt_ns": 0}, "bad_time"),
        ({"dt_ns": -5}, "bad_time"),
        ({"dt_ns": GONE}, "bad_time"),
        ({"t_ns": [T0, T0 + 1]}, "bad_time"),
        (STAMPED | {"t_ns": [T0, T0]}, "bad_time"),
        (STAMPED | {"t_ns": [T0 + 1, T0]}, "bad_time"),
        (STAMPED | {"t_ns": [0, 10]}, "bad_time"),
        (STAMPED | {"t_ns": [T0, 2**63]}, "bad_time"),
        (STAMPED | {"t_ns": [T0, None]}, "bad_time"),
        (STAMPED | {"t_ns": [T0]}, "bad_length"),
        ({"torque": [1]}, "bad_length"),
        ({"velocity": [1, 2, 3]}, "bad_length"),
        ({"torque": [], "position": []}, "empty"),
        ({"torque": 5}, "bad_type"),
        ({"torque": [1, "2"]}, "bad_type"),
        ({"torque": [1, [2]]}, "bad_type"),
        ({"torque": [1, True]}, "bad_type"),
        ({"torque": [1, 1e999]}, "infinite"),
        ({"torque": [1, 10**400]}, "infinite"),
    ],
)
def test_each_rule_refuses_with_its_reason(change, reason):
    content = {name: value for name, value in (GOOD | change).items() if value is not GONE}
    payload = json.dumps(content).replace("Infinity", "1e999").encode()
    with pytest.raises(PayloadError) as caught:
        decode_block(payload, JSON)
    assert caught.value.reason == reason
    assert len(str(caught.value)) < 300


def test_the_good_payload_itself_is_read():
    assert len(decode_block(json.dumps(GOOD).encode(), JSON)) == 2


@pytest.mark.parametrize(
    ("payload", "encoding", "reason"),
    [
        (b"{}", "application/msgpack", "unknown_encoding"),
        (b"{}", "zenoh/bytes", "unknown_encoding"),
        (b"{", JSON, "bad_json"),
        (b"[1]", JSON, "bad_json"),
        (b"\xff\xfe", JSON, "bad_json"),
        (b"[" * 500_000, JSON, "bad_json"),
        (b'{"v":1,"seq":' + b"9" * 10_000 + b"}", JSON, "bad_json"),
        (b'{"v":NaN}', JSON, "bad_json"),
        (b'{"v":1,"v":1}', JSON, "duplicate_key"),
        (b"{}" + b" " * MAX_BYTES, JSON, "too_large"),
        (b"", CBOR, "bad_cbor"),
        (cbor2.dumps([1]), CBOR, "bad_cbor"),
        (cbor2.dumps({1: 1}), CBOR, "bad_cbor"),
        (cbor2.dumps({"v": [1]}), CBOR, "bad_cbor"),
        (cbor2.dumps({"v": {"v": 1}}), CBOR, "bad_cbor"),
        (cbor2.dumps({"v": 2**70}), CBOR, "bad_tag"),
        (cbor2.dumps({"v": b"1"}), CBOR, "bad_cbor"),
        (cbor2.dumps({"v": "x" * 300}), CBOR, "bad_cbor"),
        (cbor2.dumps({"v": 1}) + b"\0", CBOR, "bad_cbor"),
        (cbor2.dumps({str(i): i for i in range(40)}), CBOR, "bad_cbor"),
        (b"\xa2\x61v\x01\x61v\x01", CBOR, "duplicate_key"),
        (b"\xbf\x61v\x01\xff", CBOR, "bad_cbor"),
        (b"\xbb" + b"\xff" * 8, CBOR, "bad_cbor"),
        (b"\xa1\x61v\xd8\x56\x5b" + b"\x7f" * 8, CBOR, "bad_cbor"),
        (b"\xa1\x7b" + b"\x7f" * 8, CBOR, "bad_cbor"),
        (cbor2.dumps({"v": cbor2.CBORTag(86, "text")}), CBOR, "bad_tag"),
        (cbor2.dumps({"v": cbor2.CBORTag(80, b"1234")}), CBOR, "bad_tag"),
        (cbor2.dumps({"torque": cbor2.CBORTag(86, b"123")}), CBOR, "bad_length"),
        (cbor2.dumps({"torque": cbor2.CBORTag(79, b"12345678")}), CBOR, "bad_tag"),
        (cbor2.dumps({"t_ns": cbor2.CBORTag(86, b"12345678")}), CBOR, "bad_tag"),
        (cbor2.dumps({"t_ns": cbor2.CBORTag(71, b"\xff" * 8)}), CBOR, "bad_time"),
        (cbor2.dumps({"torque": [1.0, 2.0]}), CBOR, "bad_cbor"),
    ],
)
def test_hostile_payloads_are_refused_by_name(payload, encoding, reason):
    with pytest.raises(PayloadError) as caught:
        decode_block(payload, encoding)
    assert caught.value.reason == reason


plain = st.integers(-(2**64), 2**64 - 1) | st.floats() | st.booleans() | st.none() | st.text(max_size=9)


@given(content=st.dictionaries(st.text(max_size=5), plain, max_size=6))
@settings(max_examples=150, deadline=None)
def test_our_cbor_reader_agrees_with_cbor2_on_plain_maps(content):
    ours = read_map(cbor2.dumps(content), frozenset())
    assert repr(ours) == repr(cbor2.loads(cbor2.dumps(content)))


def test_typed_arrays_are_not_copied_while_reading():
    payload = cbor2.dumps({"a": cbor2.CBORTag(86, b"12345678")})
    array = read_map(payload, frozenset({86}))["a"]
    assert isinstance(array, TypedArray)
    assert array.data.obj is payload


@pytest.mark.parametrize("encoding", [CBOR, JSON])
def test_random_and_mutated_bytes_are_only_ever_refused(encoding):
    rng = random.Random(1)
    seeds = [encode_block(block(dt_ns=10_000_000), encoding), encode_block(block(load=np.ones(3)), encoding)]
    counts = {}
    for i in range(20_000):
        payload = bytearray(rng.randbytes(rng.randrange(60)) if i % 4 == 0 else rng.choice(seeds))
        for _ in range(rng.randrange(1, 6) if i % 4 else 0):
            match rng.randrange(3):
                case 0:
                    payload[rng.randrange(len(payload))] = rng.randrange(256)
                case 1:
                    at = rng.randrange(len(payload))
                    del payload[at : at + rng.randrange(1, 9)]
                case _:
                    payload[rng.randrange(len(payload)) : 0] = rng.randbytes(rng.randrange(1, 9))
            if not payload:
                break
        try:
            got = decode_block(bytes(payload), encoding)
        except PayloadError as error:
            counts[error.reason] = counts.get(error.reason, 0) + 1
        else:
            assert np.isfinite(got.t_ns).all()
            assert (np.diff(got.t_ns) > 0).all()
    assert set(counts) <= set(REASONS)
    assert len(counts) >= 6  # the mutations reach deep, not only the outermost check
    assert sum(counts.values()) > 10_000


def test_encoding_holds_itself_to_the_same_rules():
    for wrong, reason in [
        (block(torque=None), "missing_key"),
        (block(axis="a b"), "bad_id"),
        (block(dt_ns=5), "bad_time"),
        (block(position=np.array([1.0, np.inf, 0.0])), "infinite"),
        (block(t_ns=np.array([1.0, 2.0, 3.0])), "bad_type"),
        (block(t_ns=np.array([3, 2, 1])), "bad_time"),
    ]:
        with pytest.raises(PayloadError) as caught:
            encode_block(wrong)
        assert caught.value.reason == reason
    n = 60_000
    with pytest.raises(PayloadError, match="at most 1000000"):
        encode_block(Block("a", 0, 0, np.arange(n), np.zeros(n), np.zeros(n)))
