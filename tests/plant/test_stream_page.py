"""docs/stream.md is enough to write a publisher from: its own code runs against a real session and is understood."""

import json
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from plant import keys
from plant.acknowledgement import committed_seq
from plant.wire import CBOR, JSON, REASONS, decode_block
from plant.wire_rules import VERSION
from plant.zenoh_session import open_session

PAGE = (Path(__file__).parents[2] / "docs" / "stream.md").read_text(encoding="utf-8")
ENDPOINT = "tcp/127.0.0.1:7447"
DEADLINE = 20.0


def fenced(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.fixture
def stream(tmp_path):
    endpoint, got = f"unixsock-stream/{tmp_path}/z.sock", []
    with open_session("peer", listen=[endpoint]) as session:
        subscriber = session.declare_subscriber(keys.samples_pattern("plant-1"), got.append)
        yield endpoint, session, got
        subscriber.undeclare()


def wait_for(got, count):
    deadline = time.monotonic() + DEADLINE
    while len(got) < count:
        assert time.monotonic() < deadline, f"{len(got)} of {count} blocks arrived"
        time.sleep(0.01)


def test_the_python_publisher_of_the_page_runs_and_its_blocks_are_read(stream, tmp_path):
    endpoint, _, got = stream
    code = fenced("python")[0]
    assert ENDPOINT in code
    assert len(code.strip().splitlines()) <= 22
    (tmp_path / "publisher.py").write_text(code.replace(ENDPOINT, endpoint), encoding="utf-8")
    done = subprocess.run([sys.executable, "publisher.py"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    wait_for(got, 20)
    blocks = [decode_block(sample.payload.to_bytes(), str(sample.encoding)) for sample in got]
    assert [block.seq for block in blocks] == list(range(0, 200, 10))
    assert {str(sample.encoding) for sample in got} == {CBOR}
    assert keys.axis_of(str(got[0].key_expr)) == ("plant-1", blocks[0].axis)
    position = np.concatenate([block.position for block in blocks])
    np.testing.assert_array_equal(position, 1.0 + 0.5 * np.sin(0.01 * np.arange(200)))


def test_the_json_of_the_page_is_read_when_put_by_hand(stream):
    endpoint, _, got = stream
    with open_session("client", connect=[endpoint]) as session:
        session.put("tribowatch/plant-1/axis-0001/samples", fenced("json")[0], encoding=JSON)
        wait_for(got, 1)
    block = decode_block(got[0].payload.to_bytes(), str(got[0].encoding))
    assert np.isnan(block.torque[2])
    assert block.temperature.tolist() == [21.5] * 4


def test_the_status_of_the_page_acknowledges():
    payload = fenced("json")[1]
    assert json.loads(payload)["schema_version"] == VERSION
    assert committed_seq(payload.encode(), epoch=1) == 3


def test_every_reason_is_explained():
    table = PAGE.split("## When a block is refused")[1]
    assert set(re.findall(r"`([a-z_]+)`", re.sub(r"\|[^|\n]*\|$", "", table, flags=re.MULTILINE))) >= set(REASONS)
