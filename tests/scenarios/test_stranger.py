"""Publishers written from docs/stream.md alone, without a line of ours: a real daemon takes and acknowledges them."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from monitor.queries import Reader
from tests.scenarios.harness import SITE, Ear, Plant, wait_for

PAGE = (Path(__file__).parents[2] / "docs" / "stream.md").read_text(encoding="utf-8")
ENDPOINT = "tcp/127.0.0.1:7447"


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    with Plant(tmp_path_factory.mktemp("stranger"), axes=("axis-0001",)) as one:
        yield one.start()


@pytest.mark.parametrize(("number", "samples"), [(0, 200), (1, 40)])
def test_a_stranger_writes_a_publisher_from_the_page_alone(plant, tmp_path, number, samples):
    code = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)[number]
    assert "tribowatch" not in "".join(re.findall(r"^(?:import|from).*$", code, flags=re.MULTILINE))
    assert len(code.strip().splitlines()) <= 22
    (tmp_path / "publisher.py").write_text(code.replace(ENDPOINT, plant.endpoint).replace("plant-1", SITE))
    with plant.session() as session:
        ear = Ear(session, "axis-0001")
        before = Reader(plant.url)
        taken = before.axis("axis-0001").samples
        before.close()
        done = subprocess.run(
            [sys.executable, "publisher.py"], cwd=tmp_path, capture_output=True, text=True, timeout=60
        )
        assert done.returncode == 0, done.stderr
        status = wait_for(
            lambda: next((one for one in ear.heard["status"] if one["samples"] == taken + samples), None), 30, "samples"
        )
        wait_for(lambda: ear.heard["status"][-1]["committed"]["seq"] == samples - 1, 30, "acknowledged")
        assert status["rejected"] == {}
        assert status["missing"] == 0
        ear.close()
