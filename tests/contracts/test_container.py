"""Container files, without an engine: what they name exists, and what runs in them is closed."""

import re
import subprocess
import sys

import pytest

from monitor.config import Config, read_axes, read_config
from tests.contracts.command import ROOT, tribowatch

FOLDER = ROOT / "deploy" / "container"
yaml = pytest.importorskip("yaml", reason="comes with the cluster extra")


@pytest.fixture(scope="module")
def services():
    return yaml.safe_load((FOLDER / "compose.yaml").read_text())["services"]


def test_what_the_image_copies_exists():
    text = (FOLDER / "Containerfile").read_text()
    copied = [name for line in re.findall(r"^COPY (?!--from)(.+)$", text, re.M) for name in line.split()[:-1]]
    assert copied
    assert all((ROOT / name).exists() for name in copied)
    assert re.search(r"^USER 64000$", text, re.M)
    assert re.search(r'^CMD \["run"', text, re.M), "exec form: SIGTERM reaches the daemon"


def test_the_configuration_of_the_container_is_good(monkeypatch):
    config = read_config(FOLDER / "etc" / "tribowatch.toml")
    assert list(read_axes(config)) == ["axis-0001"]
    assert str(config.state_dir) == "/var/lib/tribowatch"


@pytest.mark.parametrize("name", ["daemon", "plant", "scheduler", "worker"])
def test_our_containers_can_write_only_their_volumes(services, name):
    service = services[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]
    assert "ports" not in service


def test_the_stand_in_plant_is_a_command_that_exists(services):
    words = services["plant"]["command"]
    done = tribowatch(words[0], "--help")
    assert done.returncode == 0
    assert all(option in done.stdout for option in words if option.startswith("--"))


def test_the_cluster_is_there_when_it_is_asked_for(services):
    assert services["scheduler"]["profiles"] == services["worker"]["profiles"] == ["cluster"]
    assert services["daemon"]["environment"]["TRIBOWATCH_IDENTIFICATION__CLUSTER"] == "${CLUSTER:-}"
    for name in ("scheduler", "worker"):
        program, command, *words = services[name]["entrypoint"]
        helped = subprocess.run([sys.executable, "-m", program, command, "--help"], capture_output=True, text=True)
        assert all(word in helped.stdout for word in words if word.startswith("--"))


def test_the_health_check_asks_the_page_where_the_container_has_it():
    listen = Config.model_fields["page"].default.listen
    assert f"http://{listen}/healthz" in (FOLDER / "Containerfile").read_text()
    assert "[page]" not in (FOLDER / "etc" / "tribowatch.toml").read_text()


def test_no_secret_stands_in_the_files(services):
    assert "${POSTGRES_PASSWORD" in services["database"]["environment"]["POSTGRES_PASSWORD"]
