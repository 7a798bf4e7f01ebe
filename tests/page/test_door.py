"""Who comes in: tokens, roles, rates, sizes, other sites' pages; what every answer says to the browser."""

import socket
import stat
import time
from concurrent.futures import Future

import httpx
import pytest

from monitor.config_page import PageSection
from monitor.errors import ConfigError, PageError, TokenError
from monitor.http_address import Address, address_of, bind
from monitor.http_limits import RateLimit
from monitor.token_files import add_token, read_tokens, remove_token
from monitor.tokens import Role
from tests.contracts.command import complaint, tribowatch

HTML = {"accept": "text/html"}


@pytest.fixture
def tokens(tmp_path):
    """Token file, and the tokens of somebody who may operate and of somebody who may look."""
    path = tmp_path / "tokens.toml"
    return path, add_token(path, "olga", Role.OPERATE), add_token(path, "vera", Role.VIEW)


def bearer(token):
    return {"authorization": f"Bearer {token}"}


def test_every_answer_carries_the_policy(served):
    for path in ("/", "/api/v1/fleet", "/healthz", "/nowhere", "/api/v1/axes/nobody", "/favicon.ico"):
        headers = served.get(path, headers=HTML).headers
        policy = dict(part.strip().partition(" ")[::2] for part in headers["content-security-policy"].split(";"))
        assert policy["default-src"] == "'none'"
        assert policy["script-src"] == policy["connect-src"] == policy["style-src-elem"] == "'self'"
        assert "unsafe-eval" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert headers["referrer-policy"] == "no-referrer"
        assert "server" not in headers


def test_nothing_of_the_page_comes_from_elsewhere(served):
    text = served.get("/").text
    assert "http://" not in text.replace(served.url, "")
    assert "https://" not in text
    script = next(part for part in text.split('"') if part.endswith("fleet.js"))
    kept = served.get(script)
    assert "immutable" in kept.headers["cache-control"]
    assert kept.headers["content-encoding"] == "gzip"


def test_without_a_token_nobody_comes_in(serve, tokens):
    page = serve(token_file=str(tokens[0]))
    assert page.get("/healthz").status_code == 200
    assert page.get("/api/v1/fleet").status_code == 401
    assert page.get("/metrics").status_code == 401
    moved = page.get("/axes/axis-1?since=7d", headers=HTML)
    assert moved.status_code == 303
    assert moved.headers["location"] == "/login?next=%2Faxes%2Faxis-1%3Fsince%3D7d"
    assert page.get("/api/v1/fleet", headers=bearer("tw_wrong")).status_code == 401
    for token in tokens[1:]:
        assert page.get("/api/v1/fleet", headers=bearer(token)).status_code == 200


def test_the_form_gives_a_cookie_that_scripts_cannot_read(serve, tokens):
    page = serve(token_file=str(tokens[0]))
    wrong = page.client.post("/login", data={"token": "tw_nonsense", "next": "/"})
    assert wrong.status_code == 401
    assert "not known" in wrong.text
    right = page.client.post("/login", data={"token": tokens[2], "next": "/axes/axis-1?since=7d"})
    assert right.headers["location"] == "/axes/axis-1?since=7d"
    cookie = right.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert page.get("/api/v1/fleet").status_code == 200
    assert page.get("/logout").headers["location"] == "/login"
    elsewhere = page.client.post("/login", data={"token": tokens[2], "next": "//elsewhere.example/x"})
    assert elsewhere.headers["location"] == "/"


def test_who_may_look_may_not_operate(serve, tokens):
    page = serve(token_file=str(tokens[0]))
    path = "/api/v1/axes/axis-2/commands/acknowledge"
    assert page.client.post(path, json={"kind": "wear"}).status_code == 401
    refused = page.client.post(path, json={"kind": "wear"}, headers=bearer(tokens[2]))
    assert refused.status_code == 403
    assert "operate" in refused.json()["error"]
    assert page.box.take() == []


def command_while(page, send):
    """The response of `send()`, and the command it handed in, answered as the daemon would."""
    response: Future = Future()
    import threading

    threading.Thread(target=lambda: response.set_result(send()), daemon=True).start()
    until = time.monotonic() + 30
    while not (taken := page.box.take()):
        assert time.monotonic() < until
        time.sleep(0.01)
    [(command, answer)] = taken
    answer.set_result({"changed": True})
    return response.result(30), command


def test_the_author_of_a_command_is_the_holder_of_the_token(serve, tokens):
    page = serve(token_file=str(tokens[0]))
    path = "/api/v1/axes/axis-2/commands/shelve"
    body = {"kind": "wear", "for": "7d", "author": "somebody else"}
    done, command = command_while(page, lambda: page.client.post(path, json=body, headers=bearer(tokens[1])))
    assert done.json()["changed"] is True
    assert (command.action, command.axis, command.author) == ("shelve", "axis-2", "olga")
    assert command.arguments == {"kind": "wear", "for": "7d"}


def test_a_token_taken_back_stops_working(serve, tokens):
    page = serve(token_file=str(tokens[0]))
    assert page.get("/api/v1/fleet", headers=bearer(tokens[1])).status_code == 200
    remove_token(tokens[0], "olga")
    assert page.get("/api/v1/fleet", headers=bearer(tokens[1])).status_code == 401


def test_guessing_is_slowed_down(serve, tokens):
    page = serve(token_file=str(tokens[0]))
    codes = [page.get("/api/v1/fleet", headers=bearer(f"tw_{k}")).status_code for k in range(14)]
    assert codes[:10] == [401] * 10
    assert codes[-1] == 429
    assert page.get("/api/v1/fleet", headers=bearer(tokens[1])).status_code == 429  # the whole address waits


def test_too_often_is_refused_with_the_time_to_wait(serve):
    page = serve(requests_per_minute=1)
    codes = [page.get("/healthz").status_code for _ in range(130)]
    assert set(codes) == {200, 429}
    late = page.get("/healthz")
    assert int(late.headers["retry-after"]) >= 1
    assert page.get("/static/none/x.js").status_code == 404  # parts of a page are not counted


def test_too_much_and_not_json_are_refused(served):
    path = "/api/v1/axes/axis-2/commands/event"
    assert served.client.post(path, content=b"x" * 70_000).status_code == 413
    assert served.client.post(path, content=b"{}").status_code == 415
    for body in (b"{", b"[1]", b"[" * 5000):
        refused = served.client.post(path, content=body, headers={"content-type": "application/json"})
        assert refused.status_code == 400
        assert "JSON" in refused.json()["error"]


@pytest.mark.parametrize(
    "headers",
    [{"origin": "https://elsewhere.example"}, {"sec-fetch-site": "cross-site"}, {"origin": "null"}],
)
def test_another_sites_page_cannot_give_commands(served, headers):
    path = "/api/v1/axes/axis-2/commands/acknowledge"
    assert served.client.post(path, json={"kind": "wear"}, headers=headers).status_code == 403


def test_a_name_that_is_not_ours_is_not_answered(served, serve, tokens):
    assert served.get("/api/v1/fleet", headers={"host": "evil.example"}).status_code == 421
    behind = serve(token_file=str(tokens[0]), hosts=["watch.example"])
    for host in ("watch.example", "WATCH.example:443", "localhost:1", "127.0.0.1"):
        assert behind.get("/healthz", headers={"host": host}).status_code == 200
    assert behind.get("/healthz", headers={"host": "watch.example.evil"}).status_code == 421


def test_too_many_pages_at_once_are_told_so(serve):
    page = serve(viewers=1)
    with page.client.stream("GET", "/api/v1/events") as first:
        lines = first.iter_lines()  # kept: its end would be that of the connection
        assert next(lines)
        refused = httpx.get(f"{page.url}/api/v1/events")
    assert refused.status_code == 503
    assert "viewers" in refused.json()["error"]


# --- where it listens -----------------------------------------------------------------------------------------


def section(**page):
    return PageSection(**page)


@pytest.mark.parametrize(
    ("page", "said"),
    [
        ({"listen": "0.0.0.0:8447"}, "token_file"),
        ({"listen": "192.0.2.1:1"}, "token_file"),
        ({"hosts": ["x.example"]}, "token_file"),
        ({"listen": "8447"}, "HOST:PORT"),
        ({"listen": "127.0.0.1:99999"}, "HOST:PORT"),
        ({"certificate": "c.pem"}, "private_key"),
    ],
)
def test_an_address_that_cannot_be_is_said(page, said):
    with pytest.raises(ConfigError, match=said):
        address_of(section(**page))


def test_addresses_that_can():
    assert address_of(section(listen="")) is None
    assert address_of(section(listen="[::1]:80")) == Address("::1", 80)
    assert Address("::1", 80).url(secure=True) == "https://[::1]:80/"
    assert not address_of(section(listen="0.0.0.0:1", token_file="t")).loopback


def test_a_used_port_is_one_line(tmp_path, served):
    with pytest.raises(PageError, match="in use"):
        bind(Address("127.0.0.1", int(served.url.rsplit(":", 1)[1])))


def test_the_daemon_says_in_one_line_that_the_port_is_used(tmp_path, monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        monkeypatch.setenv("TRIBOWATCH_PAGE__LISTEN", f"127.0.0.1:{taken.getsockname()[1]}")
        monkeypatch.setenv("TRIBOWATCH_ZENOH__LISTEN", "[]")
        config = tmp_path / "t.toml"
        config.write_text('site = "s"\n')
        done = tribowatch("run", "--config", config)
    assert done.returncode == 3
    assert done.stdout == ""
    assert "in use" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


# --- the command, the file ------------------------------------------------------------------------------------


def test_tokens_by_command(tmp_path):
    path = tmp_path / "tokens.toml"
    made = tribowatch("token", "add", "anna", "--role", "operate", "--file", path)
    assert made.returncode == 0, made.stderr
    token = made.stdout.strip()
    assert token.startswith("tw_")
    assert token not in path.read_text()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert "anna" in complaint(tribowatch("token", "add", "anna", "--file", path), 2)
    assert "view or operate" in complaint(tribowatch("token", "add", "b", "--role", "root", "--file", path), 2)
    listed = tribowatch("token", "list", "--file", path).stdout
    assert "anna" in listed
    assert "operate" in listed
    assert tribowatch("token", "remove", "anna", "--file", path).returncode == 0
    assert read_tokens(path) == ()


ODD = ("nonsense = 1", "token = 5", "[[token]]\nname = 'a'", "[[token]]\nname='a'\nrole='view'\nsha256='1'")


@pytest.mark.parametrize("text", ODD)
def test_a_file_that_is_no_token_file(tmp_path, text):
    path = tmp_path / "t.toml"
    path.write_text(text)
    with pytest.raises(TokenError, match="not a token file"):
        read_tokens(path)


def test_the_rate_limit_fills_again_and_forgets():
    limit = RateLimit(per_minute=60, burst=2)
    assert [limit.wait("a", 0.0) > 0 for _ in range(3)] == [False, False, True]
    assert limit.wait("b", 0.0) == 0
    assert limit.wait("a", 1.0) == 0
    assert limit.wait("a", 1.0) == pytest.approx(1.0)
    for k in range(5000):
        limit.wait(f"c{k}", 2.0)
    assert len(limit._buckets) <= 4096
