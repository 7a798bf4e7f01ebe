"""Whatever stands in a file that people write: it is read, or refused in one line. Every key with every odd value."""

import copy
import json
import tomllib
from pathlib import Path

import pytest

from monitor.config import read_config
from plant.axis_file import read_axis
from plant.bridge_file import read_bridge
from plant.errors import InputError
from plant.scenario_file import read_scenario
from tests.contracts.command import AXIS, ROOT, write

ODD = ("true", '"x"', '"\\u0000"', "-1", "0", "1e308", "1e-300", "nan", "-inf", "1" + 400 * "0", "1" + 5000 * "0",
       "[]", "[1, 2]", "[[]]", "{}", "{ a = 1 }", "2026-01-01", "07:00:00")  # fmt: skip
BROKEN = ("", "x", "[", "a = ", "\0", "[a]\n[a]", "a = " + 5000 * "[", "\ufeff", 3 * "[[axis]]\n")


class Verbatim(str):
    """A value as it is to stand in the file."""


def toml(value) -> str:
    match value:
        case Verbatim():
            return str(value)
        case dict():
            return "{" + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(toml, value)) + "]"
        case str() | bool():
            return json.dumps(value)
    return value.isoformat() if hasattr(value, "isoformat") else repr(value)


def places(value, so_far=()):
    """Where something stands: keys and positions, from the top."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inside:
        yield (*so_far, key)
        yield from places(one, (*so_far, key))


def with_value(content, place, value):
    """`content` with `value` at `place`; without what stands there where it is None."""
    changed = copy.deepcopy(content)
    table = changed
    for key in place[:-1]:
        table = table[key]
    if value is None:
        del table[place[-1]]
    else:
        table[place[-1]] = Verbatim(value)
    return "\n".join(f"{key} = {toml(one)}" for key, one in changed.items()) + "\n"


def config() -> dict:
    content = tomllib.loads((ROOT / "deploy" / "tribowatch.toml").read_text())
    content["security"]["publishers"] = {"gateway": ["*"]}
    return content | {"axis": [{"file": "axis.toml"}]}


def bridge() -> dict:
    content = tomllib.loads((ROOT / "deploy" / "bridge.toml").read_text())
    content["axis"][0]["pdo"] = [{"id": 0x181, "objects": ["6041:16", "6064:32", "6077:16"]}]
    return content


def axis() -> dict:
    return tomllib.loads((ROOT / "docs" / "axis-file.md").read_text().split("```toml\n")[1].split("```")[0])


def scenario() -> dict:
    return tomllib.loads((ROOT / "plant" / "scenarios" / "production.toml").read_text())


@pytest.mark.parametrize(
    ("content", "read"),
    [(axis, read_axis), (config, read_config), (bridge, read_bridge), (scenario, read_scenario)],
    ids=["axis", "config", "bridge", "scenario"],
)
def test_every_key_with_every_odd_value_is_read_or_refused_in_one_line(tmp_path, content, read):
    write(tmp_path / "axis.toml", AXIS)
    good = content()
    texts = [with_value(good, place, value) for place in places(good) for value in (None, *ODD)]
    refused = []
    for text in (*texts, *BROKEN):
        path = write(tmp_path / "odd.toml", text)
        try:
            read(path)
        except InputError as error:
            refused.append(str(error))
    assert len(refused) > len(texts) / 2
    assert not [message for message in refused if "\n" in message]


@pytest.mark.parametrize("read", [read_axis, read_config, read_bridge, read_scenario])
def test_no_file_a_folder_and_bytes_that_are_no_text(tmp_path, read):
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path / "none.toml", tmp_path, tmp_path / "bytes.toml", Path("a\0b")):
        with pytest.raises(InputError):
            read(path)
