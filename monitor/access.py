"""Who may do what on the daemon's links, as Zenoh's access control: made from roles, never written by hand. Pure.

Zenoh accepts policies that name unknown rules or subjects and then silently denies everything;
rules made from roles cannot dangle. Everything that no role allows is dropped, both ways.

- A *publisher* puts the samples of its axes, answers for what was missed, and reads their status.
- A *viewer* reads what the daemon publishes and asks the history; it never gets or puts raw samples.
- An *operator* is a viewer whose commands (acknowledge, shelve, ...) are taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from monitor.config import Config
from plant import keys

BOTH = ("ingress", "egress")
OURS, THEIRS = ("egress",), ("ingress",)  # what we send to them, what they send to us


def security_settings(config: Config) -> dict[str, Any]:
    """What `open_session` needs besides the endpoints: identity and access control; nothing without an identity."""
    security = config.security
    if not security.identity:
        return {}
    control = access_control(
        config.zenoh.prefix,
        config.site,
        publishers=security.publishers,
        viewers=security.viewers,
        operators=security.operators,
        recorders=security.recorders,
    )
    return {"identity": Path(security.identity), "extra": [("access_control", control)]}


def access_control(
    prefix: str,
    site: str,
    *,
    publishers: Mapping[str, Sequence[str]],
    viewers: Sequence[str] = (),
    operators: Sequence[str] = (),
    recorders: Sequence[str] = (),
) -> dict[str, Any]:
    """Zenoh's `access_control` for the roles of a site.

    Args:
        prefix: first part of every key.
        site: second part of every key.
        publishers: the axes each may publish, by the common name of its certificate; `*` means all.
        viewers: common names.
        operators: common names.
        recorders: common names.
    """
    root = f"{prefix}/{site}"
    rules: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []

    def grant(role: str, names: Sequence[str], granted: list[dict[str, Any]]) -> None:
        if not names:
            return
        rules.extend(granted)
        subjects.append({"id": role, "cert_common_names": list(names)})
        policies.append({"rules": [rule["id"] for rule in granted], "subjects": [role]})

    for name, axes in publishers.items():
        grant(f"publisher {name}", [name], _publisher(name, root, axes))
    grant("viewer", viewers, _viewer("viewer", root))
    operator = _rule("operator commands", [f"{root}/*/command"], ["query", "liveliness_query"], THEIRS)
    answer = _rule("operator answers", [f"{root}/*/command"], ["reply", "declare_queryable"], OURS)
    raw = [f"{root}/*/{keys.SAMPLES}{tail}" for tail in ("", "/@adv/**")]
    grant("recorder", recorders, _reading("recorder", [*raw, f"{root}/{keys.ALIVE}/*"]))
    grant("operator", operators, [*_viewer("operator", root), operator, answer])
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _publisher(name: str, root: str, axes: Sequence[str]) -> list[dict[str, Any]]:
    role = f"publisher {name}"
    samples = [f"{root}/{axis}/{keys.SAMPLES}{tail}" for axis in axes for tail in ("", "/@adv/**")]
    status = [f"{root}/{axis}/status{tail}" for axis in axes for tail in ("", "/@adv/**")]
    alive = [f"{root}/{keys.ALIVE}/*"]
    asked = [f"{root}/*/{keys.SAMPLES}{tail}" for tail in ("", "/@adv/**")]  # we ask for all axes in one expression
    return [
        _rule(f"{role} feeds", samples, ["put", "declare_queryable", "reply", "liveliness_token"], THEIRS),
        _rule(
            f"{role} is heard",
            asked,
            ["declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"],
            OURS,
        ),
        *_reading(f"{role} status", [*status, *alive]),
        _rule(f"{role} is alive", alive, ["liveliness_token"], THEIRS),
        _rule(f"{role} tells what it counts", [f"{root}/{name}/{keys.BRIDGE}"], ["put"], THEIRS),
    ]


def _viewer(role: str, root: str) -> list[dict[str, Any]]:
    outputs = [f"{root}/*/{what}{tail}" for what in keys.OUTPUTS for tail in ("", "/@adv/**")]
    outputs.append(f"{root}/*/{keys.BRIDGE}")
    return _reading(f"{role} reads", [*outputs, f"{root}/*/history/**", f"{root}/{keys.ALIVE}/*"])


def _reading(name: str, expressions: list[str]) -> list[dict[str, Any]]:
    """They subscribe and ask; we put and answer."""
    asked = ["declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"]
    answered = ["put", "reply", "declare_queryable", "liveliness_token"]
    return [
        _rule(f"{name}: asked", expressions, asked, THEIRS),
        _rule(f"{name}: answered", expressions, answered, OURS),
    ]


def _rule(name: str, expressions: list[str], messages: list[str], flows: tuple[str, ...]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": list(flows), "messages": messages, "key_exprs": expressions}
