"""The documentation cannot rot: its commands run, its examples parse, its generated pages match the code.

The commands of one page run in order in one folder. Where the recordings of real machines are absent (they are not part
of the repository) a simulated twin stands in, so that the commands are the same everywhere.
"""

import json
import os
import re
import runpy
import shlex
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.contracts.command import ROOT, tribowatch, write
from tests.contracts.conftest import daemon
from tests.contracts.test_cli import all_commands

PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")])
GENERATED = ("cli.md", "configuration.md")
DATA = Path(os.environ.get("TRIBOWATCH_DATA", ROOT.parent / "shared" / "data"))
LONG = {"make", "git"}  # what they start is tested elsewhere


def blocks(page: Path, kind: str) -> list[str]:
    """Fenced blocks of a page, without their indentation."""
    found = re.findall(rf"^( *)```{kind}\n(.*?)^ *```", page.read_text(encoding="utf-8"), re.M | re.S)
    return ["\n".join(line.removeprefix(indent) for line in text.splitlines()) + "\n" for indent, text in found]


def commands(page: Path) -> list[list[str]]:
    """What a page tells to type, in order."""
    lines = [line for block in blocks(page, "console") for line in block.splitlines() if line.startswith("$ ")]
    return [words for line in lines if (words := shlex.split(line[2:], comments=True))[0] not in LONG]


RUNNABLE = [page for page in PAGES if page.name not in GENERATED and commands(page)]


def names(page: Path) -> str:
    return page.name


def test_the_readme_has_commands_to_run():
    assert ROOT / "README.md" in RUNNABLE


@pytest.mark.parametrize("page", RUNNABLE, ids=names)
def test_commands_run_as_printed(page, tmp_path, worn):
    here = prepare(tmp_path, page)
    if page.name != "README.md":  # whose daemon makes a history of its own
        shutil.copytree(worn[0], here / "var")
    port = free_port()
    environment = {"TRIBOWATCH_ZENOH__LISTEN": json.dumps([f"tcp/127.0.0.1:{port}"])}
    running = None
    try:
        for words in commands(page):
            assert words[0] == "tribowatch", f"{page.name}: {words}"
            if words[-1] == "&":
                assert words[1] == "run", f"{page.name}: only the daemon runs in the background"
                os.environ.update(environment)
                running = daemon(here / words[words.index("--config") + 1])
                running.__enter__()
                continue
            more = ["--connect", f"tcp/127.0.0.1:{port}"] if words[1] in ("replay", "bridge", "record") else []
            done = tribowatch(*words[1:], *more, cwd=here, timeout=400, **environment)
            assert done.returncode == 0, f"{page.name}: {' '.join(words)}: {done.stderr}"
            assert done.stdout.strip(), f"{page.name}: {' '.join(words)} printed nothing"
    finally:
        if running is not None:
            running.__exit__(None, None, None)
        for name in environment:
            os.environ.pop(name, None)


def prepare(tmp_path: Path, page: Path) -> Path:
    """A folder like a checkout, with what the pages name: recordings, a history, configurations."""
    here = tmp_path / "checkout"
    here.mkdir()
    simulate = ("simulate", "--scenario", "wear")
    done = tribowatch(*simulate, "--out", here / "recording.csv", "--write-axis", here / "axis-0001.toml")
    assert done.returncode == 0, done.stderr
    if page.name != "README.md":  # which writes one itself
        shutil.copy(here / "axis-0001.toml", here / "axis.toml")
    emps = tmp_path / "shared" / "data" / "emps"
    if (DATA / "emps" / "axis.toml").exists():
        shutil.copytree(DATA / "emps", emps)
    else:
        twin_of_emps(here, emps)
    for text in blocks(page, "toml"):
        if match := re.match(r"# ([\w.-]+\.toml)\n", text):
            write(here / match[1], text)
    return here


def twin_of_emps(here: Path, folder: Path) -> None:
    """Axis file and recording with the names of the real ones."""
    folder.mkdir(parents=True)
    text = (here / "axis-0001.toml").read_text().replace('name = "axis-0001"', 'name = "emps"')
    write(folder / "axis.toml", text + '\n[[recording]]\nfile = "emps_train.csv"\nsample_time = 0.01\n')
    shutil.copy(here / "recording.csv", folder / "emps_train.csv")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_the_query_of_the_page_is_answered(worn, tmp_path):
    """The page's program as printed, but for the endpoint and the site of the demo."""
    folder = tmp_path / "demo"
    shutil.copytree(worn[0], folder)
    port = free_port()
    config = folder / "tribowatch.toml"
    config.write_text(re.sub(r"127\.0\.0\.1:\d+", f"127.0.0.1:{port}", config.read_text()))
    program = blocks(ROOT / "docs" / "outputs.md", "python")[0]
    program = program.replace("127.0.0.1:7447", f"127.0.0.1:{port}").replace("plant-1", "demo")
    program = program.replace("since=30d", "since=1y")  # a busy computer answers long after the samples came
    with daemon(config):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
        wrong = program.replace("coulomb_force;", "colour;")
        refused = subprocess.run([sys.executable, "-c", wrong], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert 5 <= len(lines) <= 20
    assert all(" N [" in line for line in lines)
    assert "refused" in refused.stdout
    assert "'colour'" in refused.stdout


# --- what the pages hold ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["docs/cli.md", "docs/configuration.md", "deploy/tribowatch.toml", "deploy/bridge.toml"]
)
def test_generated_pages_match_the_code(name):
    pages = runpy.run_path(str(ROOT / "docs" / "generate.py"))["PAGES"]
    assert (ROOT / name).read_text(encoding="utf-8") == pages[name](), "run: make docs"


def test_the_example_configuration_equals_the_defaults():
    """Every key is in it, and leaving it out changes nothing."""
    import tomllib

    from monitor.config import Config

    text = (ROOT / "deploy" / "tribowatch.toml").read_text(encoding="utf-8")
    said = tomllib.loads(text)
    assert Config(**said) == Config(site=said["site"])
    assert set(said) == set(Config.model_fields) - {"axis"}
    for name, section in said.items():
        if isinstance(section, dict):
            assert set(section) == set(type(Config.model_fields[name].default).model_fields)


def test_the_example_bridge_file_equals_the_defaults(tmp_path):
    from plant.bridge_file import read_bridge
    from plant.bridge_settings import SECTIONS, meanings

    text = (ROOT / "deploy" / "bridge.toml").read_text(encoding="utf-8")
    whole = read_bridge(write(tmp_path / "whole.toml", text))
    bare = "\n".join(
        line for line in text.splitlines() if line.startswith(("name", "site", "[[axis", "node", "counts", "rated"))
    )
    said = read_bridge(write(tmp_path / "bare.toml", bare))
    assert whole == said
    for name, kind in SECTIONS.items():
        assert f"[{name}]" in text
        assert all(f"\n{key} = " in text for key, _, _ in meanings(kind))


def test_every_command_is_documented():
    guides = "".join(page.read_text(encoding="utf-8") for page in PAGES if page.name not in GENERATED)
    reference = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    for words in all_commands():
        assert f"`tribowatch {' '.join(words)}`" in reference
        assert f"`tribowatch {words[0]}" in guides


def test_commands_that_do_not_exist_are_not_documented():
    known = {words[0] for words in all_commands()}
    for page in PAGES:
        # a command is what follows the program in code, not in prose
        text = page.read_text(encoding="utf-8")
        named = set(re.findall(r"(?:`|^ *\$ )tribowatch ([a-z][a-z-]+)", text, re.M))
        assert named <= known, page.name


def test_the_axis_file_of_the_page_can_be_read(tmp_path):
    from plant.axis_file import read_axis

    examples = blocks(ROOT / "docs" / "axis-file.md", "toml")
    assert len(examples) == 1
    axis = read_axis(write(tmp_path / "axis.toml", examples[0]))
    assert axis.name == "axis-0001"
    assert len(axis.recordings) == 1


def test_every_key_of_the_axis_file_is_documented():
    from plant.axis_schema import TABLES

    text = blocks(ROOT / "docs" / "axis-file.md", "toml")[0]
    page = (ROOT / "docs" / "axis-file.md").read_text(encoding="utf-8")
    silent = [key for keys in TABLES.values() for key in keys if key not in text and f"`{key}`" not in page]
    silent = [key for key in silent if key not in page]
    assert not silent


def test_every_key_command_and_refusal_is_documented():
    from monitor.operate import ACTIONS
    from plant import keys
    from plant.wire import REASONS

    outputs, stream, http = (
        (ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("outputs.md", "stream.md", "http-api.md")
    )
    for what in (*keys.OUTPUTS, *(f"history/{what}" for what in keys.HISTORIES), keys.COMMAND):
        assert f"| `<axis>/{what}` |" in outputs
    for action in ACTIONS:
        assert f"`{action}`" in outputs
        assert f"`{action}`" in http
    for reason in (*REASONS, "wrong_axis", "queue_full", "internal_error", "judgement_error"):
        assert f"`{reason}`" in stream


def test_every_field_of_the_answers_is_documented():
    from identify.mismatch.result import Diagnosis, Location, Quantity
    from identify.mismatch.result import Verdict as Found
    from identify.result import IdentificationResult, Verdict

    nothing = IdentificationResult(Verdict.BAD_DATA, "", "a", {}, None, None, "", 0, 0, 0, 0.0, 0.0).to_dict()
    found = Diagnosis(Found.UNEXPLAINED, "a", "").to_dict()
    parts = Location("time", (0.0, 1.0), 0.5, 0.01).to_dict() | Quantity(1.0, "N").to_dict()
    page = (ROOT / "docs" / "json.md").read_text(encoding="utf-8")
    silent = [name for name in (*nothing, *found, *parts, *Found, *Verdict) if f"`{name}`" not in page]
    assert not silent


def test_links_between_pages_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{page.name}: {target}"


# --- what is told to be run can be run --------------------------------------------------------------------------


MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"^([a-z0-9-]+):.*## ", MAKEFILE, re.M))
HELPERS = {  # programs that another program starts
    "tests/blind/rivals.py",
    "tests/scenarios/daemon_on_another_clock.py",
    "tests/scenarios/kill9_publisher.py",
}


def test_every_make_target_that_is_named_exists():
    for path in committed_files():
        if path.suffix in (".py", ".md", ".toml", ".yaml", ".service") and path.name != "CHANGELOG.md":
            named = set(re.findall(r"(?:`|^ *\$ |run: )make ([a-z][a-z0-9-]+)", path.read_text(encoding="utf-8"), re.M))
            assert named <= TARGETS, f"{path.relative_to(ROOT)}: {sorted(named - TARGETS)}"


def test_every_target_is_phony_so_that_no_file_of_its_name_hides_it():
    assert set(re.findall(r"^\.PHONY: (.*)$", MAKEFILE, re.M)[0].split()) == TARGETS


def test_every_study_has_a_make_target():
    for path in (ROOT / "tests").rglob("*.py"):
        name = path.relative_to(ROOT).as_posix()
        if not path.name.startswith("test_") and 'if __name__ == "__main__":' in path.read_text(encoding="utf-8"):
            module = name.removesuffix(".py").removesuffix("/__main__").replace("/", ".")
            assert name in HELPERS or re.search(rf"-m {re.escape(module)}(\s|$)", MAKEFILE, re.M), name


# --- what committed files must not hold -------------------------------------------------------------------------


def committed_files() -> list[Path]:
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip("not a git checkout: no list of committed files")
    return [ROOT / name for name in done.stdout.split("\0") if name and (ROOT / name).is_file()]


FORBIDDEN = {
    "an absolute path of somebody's machine": (
        r"(?<![\w.<>/-])/(?:home|Users|work|root|opt(?!/tribowatch)|mnt)/[A-Za-z0-9_.-]+"
    ),
    "the address of a package index": r"https?://[^\s\"')>]*(?:pypi|/simple\b)|--(?:extra-)?index-url|file:///",
    "a key or password": r"-----BEGIN [A-Z ]*PRIVATE KEY|AKIA[0-9A-Z]{16}",
}


@pytest.mark.parametrize("what", FORBIDDEN)
def test_no_committed_file_names(what):
    pattern = re.compile(FORBIDDEN[what])
    found = []
    for path in committed_files():
        if path == Path(__file__).resolve():
            continue
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        found += [f"{path.relative_to(ROOT)}: {match[0]}" for match in pattern.finditer(text)]
    assert not found
