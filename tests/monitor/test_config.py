"""The configuration: defaults, environment, and every mistake in one line that says what to do."""

import dataclasses
from pathlib import Path

import pytest

from monitor.access import access_control
from monitor.config import open_to_all, read_axes, read_config
from monitor.errors import ConfigError
from plant.axis_file import write_axis
from plant.presets import paper_axis


@pytest.fixture
def write(tmp_path):
    def one(text):
        path = tmp_path / "tribowatch.toml"
        path.write_text(text)
        return path

    return one


def test_the_documented_example_is_read(write, tmp_path):
    config = read_config(write("""
site = "plant-1"
state_dir = "var"
[zenoh]
listen = ["tcp/127.0.0.1:7447"]
[window]
samples = 2000
hop = 500
[alarms]
false_alarms_per_axis_year = 1.0
[[axis]]
file = "axes/axis-0001.toml"
"""))  # fmt: skip
    assert config.state_dir == tmp_path / "var"
    assert [entry.file for entry in config.axis] == [tmp_path / "axes" / "axis-0001.toml"]
    assert config.database_url == f"sqlite:///{tmp_path / 'var' / 'tribowatch.db'}"
    assert config.model_dump(exclude={"state_dir", "axis"}) == read_config(write('site = "plant-1"')).model_dump(
        exclude={"state_dir", "axis"}
    )


def test_the_environment_wins(write, monkeypatch):
    monkeypatch.setenv("TRIBOWATCH_WINDOW__HOP", "250")
    monkeypatch.setenv("TRIBOWATCH_ZENOH__LISTEN", '["tcp/127.0.0.1:9999"]')
    config = read_config(write('site = "p"\n[window]\nhop = 100\nsamples = 400'))
    assert (config.window.hop, config.window.samples) == (250, 400)
    assert config.zenoh.listen == ("tcp/127.0.0.1:9999",)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('site = "p"\n[window]\nsampels = 3', "unknown key 'window.sampels'; did you mean 'samples'"),
        ('site = "p"\n[windows]\nhop = 3', "did you mean 'window'"),
        ('site = "p"\n[[axis]]\nfile = "a"\nfiles = 3', "did you mean 'file'"),
        ('site = "p"\nqqq = 3', "allowed here: .*state_dir"),
        ("seed = 1", "'site' is missing"),
        ('site = "a b"', "site = 'a b'"),
        ('site = "p"\n[window]\nhop = 0', "window.hop = 0 should be"),
        ('site = "p"\n[window]\nhop = "many"', "window.hop = 'many'"),
        ('site = "p"\n[alarms]\nfalse_alarms_per_axis_year = -1.0', "greater than 0"),
        ("site = ", "not valid TOML"),
        ('site = "alive"', "site is 'alive', but must be"),
        ('site = "p"\n[zenoh]\nprefix = "a//b"', "key prefix is ''"),
        ('site = "p"\n[zenoh]\nprefix = "a/*"', r"key prefix is '\*'"),
        ('site = "p"\n[sharing]\nmember = "a b"', "sharing.member is 'a b'"),
    ],
)
def test_a_mistake_is_one_line_that_names_file_and_key(write, text, said):
    with pytest.raises(ConfigError, match=said) as caught:
        read_config(write(text))
    assert "tribowatch.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_file_is_said_so(tmp_path):
    with pytest.raises(ConfigError, match="cannot read the configuration: No such file"):
        read_config(tmp_path / "none.toml")


def test_a_bad_environment_is_said_so(write, monkeypatch):
    monkeypatch.setenv("TRIBOWATCH_WINDOW__HOP", "often")
    with pytest.raises(ConfigError, match="often"):
        read_config(write('site = "p"'))


def test_axes_are_read_and_names_are_unique(write, tmp_path):
    for name in ("a", "b"):
        write_axis(dataclasses.replace(paper_axis(), name="axis-1"), Path(tmp_path / f"{name}.toml"))
    assert list(read_axes(read_config(write('site = "p"\n[[axis]]\nfile = "a.toml"')))) == ["axis-1"]
    with pytest.raises(ConfigError, match="listed twice"):
        read_axes(read_config(write('site = "p"\n[[axis]]\nfile = "a.toml"\n[[axis]]\nfile = "b.toml"')))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[security]\nidentity = "pki/daemon"', "asks nobody for a certificate"),
        ('[security]\nviewers = ["office"]', "no identity"),
        ('[zenoh]\nlisten = ["tls/0.0.0.0:7447"]', "security.identity is empty"),
    ],
)
def test_endpoints_and_certificates_must_agree(write, text, said):
    with pytest.raises(ConfigError, match=said):
        read_config(write(f'site = "plant-1"\n{text}\n'))


def test_an_endpoint_open_to_all_is_known(write):
    config = read_config(
        write('site = "plant-1"\n[zenoh]\nlisten = ["tcp/127.0.0.1:1", "tcp/[::1]:2", "tcp/0.0.0.0:3", "tcp/host:4"]\n')
    )
    assert open_to_all(config) == ("tcp/0.0.0.0:3", "tcp/host:4")


def test_access_control_has_no_dangling_names():
    control = access_control("p", "s", publishers={"gw": ["a", "b"], "all": ["*"]}, viewers=["v"], operators=["o"])
    rules = [rule["id"] for rule in control["rules"]]
    subjects = [subject["id"] for subject in control["subjects"]]
    assert len(set(rules)) == len(rules)
    assert sorted(name for policy in control["policies"] for name in policy["rules"]) == sorted(rules)
    assert [name for policy in control["policies"] for name in policy["subjects"]] == subjects
    assert control["default_permission"] == "deny"
