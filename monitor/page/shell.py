"""The shell of every view: head, navigation, a place for the numbers, and the first numbers as data. Pure.

The views draw themselves from JSON (files/*.js); the first answer travels inside the shell, so numbers stand at once.
"""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from typing import Any

from monitor.page.assets import PLOTLY, address, guards

VIEWS = (("/", "Fleet", "f"), ("/alerts", "Alerts", "a"), ("/system", "System", "s"))


def shell(view: str, title: str, site: str, data: Mapping[str, Any], *, operate: bool, who: str, tokens: bool) -> str:
    """A whole page.

    Args:
        view: name of the script that draws it.
        title: of the window.
        site: of the daemon.
        data: answers of the API the view starts with, by address.
        operate: whether this visitor may give commands.
        who: name of the visitor, empty where there are no tokens.
        tokens: whether one can log out.
    """
    about = {
        "view": view, "site": site, "operate": operate, "who": who,
        "plotly": address(PLOTLY), "guards": guards(), "data": data,
    }  # fmt: skip
    links = "".join(
        f'<a href="{path}" accesskey="{key}" data-key="{key}"{_current(path, view)}>{name}</a>'
        for path, name, key in VIEWS
    )
    leave = '<a href="/logout" class="quiet">Log out</a>' if tokens else ""
    body = (
        '<a class="skip" href="#main">Skip to the numbers</a>'
        f'<header class="top"><a class="brand" href="/">tribowatch</a><span class="site">{html.escape(site)}</span>'
        f'<nav aria-label="Views">{links}</nav><span class="state" id="live" role="status"></span>'
        f'<button type="button" id="theme" class="quiet" aria-label="Light or dark">◐</button>{leave}</header>'
        '<main id="main" tabindex="-1"><noscript><p class="empty">This page draws with JavaScript, which is '
        "switched off. The same answers as JSON: <code>/api/v1/fleet</code>; on a terminal: <code>tribowatch axes"
        "</code>.</p></noscript></main>"
        f'<script type="application/json" id="about">{inline(about)}</script>'
    )
    return _document(title, body, [f"{view}.js"])


def login_page(site: str, following: str, problem: str) -> str:
    """Asks for a token; works without JavaScript."""
    said = f'<p class="problem" role="alert">{html.escape(problem)}</p>' if problem else ""
    body = (
        f'<main id="main" class="login"><h1>tribowatch <small>{html.escape(site)}</small></h1>{said}'
        '<form method="post" action="/login"><label for="token">Your token</label>'
        '<input id="token" name="token" type="password" autocomplete="current-password" required autofocus>'
        f'<input type="hidden" name="next" value="{html.escape(following)}">'
        '<button class="primary">Enter</button></form>'
        '<p class="soft">Who runs the daemon makes one: <code>tribowatch token add NAME --role view</code></p></main>'
    )
    return _document("Log in", body, [])


def inline(content: Any) -> str:
    """JSON that can stand inside a script element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _current(path: str, view: str) -> str:
    home = {"/": "fleet", "/alerts": "alerts", "/system": "system"}[path]
    return ' aria-current="page"' if home == view else ""


def _document(title: str, body: str, scripts: Sequence[str]) -> str:
    modules = "".join(f'<script type="module" src="{address(name)}"></script>' for name in scripts)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark"><meta name="robots" content="noindex">'
        f"<title>{html.escape(title)} · tribowatch</title>"
        f'<script src="{address("theme.js")}"></script>'
        f'<link rel="stylesheet" href="{address("style.css")}">'
        f'<link rel="icon" href="{address("icon.svg")}" type="image/svg+xml">{modules}</head>\n'
        f"<body>{body}</body></html>\n"
    )
