"""Dashboard and alert rules name only metrics that the daemon exports, labels included."""

import json
import re
import shutil
import subprocess

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from tests.contracts.command import ROOT

DEPLOY = ROOT / "deploy"
FUNCTIONS = {
    "sum", "count", "rate", "increase", "deriv", "vector", "histogram_quantile", "by", "and", "or", "label_values",
}  # fmt: skip
FOREIGN = {"up"}  # Prometheus' own


@pytest.fixture(scope="module")
def exported(served):
    """Name of every series -> its labels, of a daemon that has had something of everything."""
    served.board.hear("parameters", "axis-1", {"verdict": "identified", "seconds": 0.3})
    served.board.hear("alerts", "axis-1", {"kind": "wear", "transition": {"after": "unacknowledged"}})
    found: dict[str, set[str]] = {}
    for family in text_string_to_metric_families(served.get("/metrics").text):
        found.setdefault(family.name + ("_total" if family.type == "counter" else ""), set())
        for sample in family.samples:
            found.setdefault(sample.name, set()).update(sample.labels)
    return found


def expressions():
    """Where a query stands, and its text."""
    rules = yaml.safe_load((DEPLOY / "prometheus" / "tribowatch-rules.yml").read_text())
    for group in rules["groups"]:
        for rule in group["rules"]:
            yield rule["alert"], rule["expr"]
    board = json.loads((DEPLOY / "grafana" / "tribowatch.json").read_text())
    for panel in board["panels"]:
        for target in panel["targets"]:
            yield panel["title"], target["expr"]
    for variable in board["templating"]["list"]:
        if variable["type"] == "query":
            yield variable["name"], variable["query"]


@pytest.mark.parametrize(("where", "expression"), list(expressions()), ids=lambda one: one[:40])
def test_only_metrics_that_exist_are_named(where, expression, exported):
    labels = set(re.findall(r"(\w+)\s*(?:=~|!=|=)\s*\"", expression)) | set(re.findall(r"by \((\w+)\)", expression))
    bare = re.sub(r"\{[^}]*\}|\[[^\]]*\]|\"[^\"]*\"|by \([^)]*\)", " ", expression)
    names = {name for name in re.findall(r"[a-z_][a-z0-9_]*", bare) if not name.isdigit()} - FUNCTIONS - FOREIGN
    if expression.startswith("label_values"):
        names.discard("axis")
    names -= {"e9"}
    for name in names:
        assert name in exported, f"{where} asks for {name}"
    if all(exported[name] or not labels for name in names):  # a rotary axis is not in this history
        known = set().union(*(exported[name] for name in names)) | {"job"}
        assert labels <= known, f"{where} asks for labels {labels - known}"


def test_rules_tell_what_to_do():
    rules = yaml.safe_load((DEPLOY / "prometheus" / "tribowatch-rules.yml").read_text())
    for group in rules["groups"]:
        for rule in group["rules"]:
            assert rule["annotations"]["summary"]
            assert rule["labels"]["severity"] in ("info", "warning", "critical")


needs_promtool = pytest.mark.skipif(
    shutil.which("promtool") is None, reason="needs promtool (Debian: apt install prometheus)"
)


def promtool(*arguments, **options):
    """Run it; it must be content."""
    command = ["promtool", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, **options)
    assert done.returncode == 0, done.stdout + done.stderr


@needs_promtool
def test_promtool_accepts_names_rules_and_scrape_configuration(served):
    promtool("check", "metrics", input=served.get("/metrics").text)
    promtool("check", "rules", DEPLOY / "prometheus" / "tribowatch-rules.yml")
    promtool("check", "config", DEPLOY / "prometheus" / "prometheus.yml")


@needs_promtool
def test_rules_fire_where_they_should_and_nowhere_else():
    promtool("test", "rules", ROOT / "tests" / "page" / "rules-test.yml")
