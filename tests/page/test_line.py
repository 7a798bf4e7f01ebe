"""The line to the page: encrypted where it is told to be, and nobody holds it by talking slowly."""

import socket
import ssl
import subprocess
import time
from shutil import which

import httpx
import pytest

from monitor import http_guard, http_server
from monitor.token_files import add_token
from monitor.tokens import Role

SOON = 0.3  # s; stands for the 10 s that a client really has
needs_openssl = pytest.mark.skipif(which("openssl") is None, reason="needs openssl to make a certificate")


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    """A self-made certificate for this computer, and its key."""
    folder = tmp_path_factory.mktemp("tls")
    names = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"]
    made = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    files = ["-keyout", folder / "page.key", "-out", folder / "page.pem", "-days", "2"]
    subprocess.run([*made, *files, *names], check=True, capture_output=True, timeout=60)
    return {"certificate": str(folder / "page.pem"), "private_key": str(folder / "page.key")}


@needs_openssl
def test_over_tls_the_whole_page_works_and_the_cookie_is_kept_to_it(serve, certificate, tmp_path):
    token = add_token(tmp_path / "tokens.toml", "olga", Role.OPERATE)
    page = serve(**certificate, token_file=str(tmp_path / "tokens.toml"))
    assert page.url.startswith("https://127.0.0.1:")
    trusting = ssl.create_default_context(cafile=certificate["certificate"])
    with httpx.Client(base_url=page.url, verify=trusting, timeout=30) as client:
        assert client.get("/api/v1/fleet").status_code == 401
        welcome = client.post("/login", data={"token": token, "next": "/"})
        assert "secure" in welcome.headers["set-cookie"].lower()
        fleet = client.get("/api/v1/fleet")
        assert fleet.json()["axes"]
        assert "max-age" in fleet.headers["strict-transport-security"]
        with client.stream("GET", "/api/v1/events") as events:
            assert any("hello" in line for line in events.iter_lines())


@needs_openssl
def test_strangers_to_the_certificate_and_plain_speakers_get_nothing(serve, certificate):
    page = serve(**certificate)
    with pytest.raises(httpx.ConnectError, match="certificate"):
        httpx.get(page.url + "/api/v1/fleet", timeout=30)
    with pytest.raises(httpx.HTTPError):
        httpx.get(page.url.replace("https", "http") + "/api/v1/fleet", timeout=30)


def talk(page, *parts):
    """A connection that has said `parts` so far."""
    line = socket.create_connection(("127.0.0.1", page.server.address.port), timeout=30)
    for part in parts:
        line.sendall(part)
    return line


def heard(line):
    """All that comes until the other side hangs up."""
    found = b""
    while part := line.recv(65536):
        found += part
    return found


HALF = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "
WHOLE = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


@pytest.mark.parametrize("said", [b"", b"GET /he", HALF], ids=["nothing", "half a line", "half a head"])
def test_who_does_not_say_what_he_wants_is_hung_up_on(serve, monkeypatch, capfd, said):
    monkeypatch.setattr(http_server, "HEAD_SECONDS", SOON)
    page = serve()
    with talk(page, said) as line:
        assert page.get("/healthz").status_code == 200  # others are answered meanwhile
        assert heard(line) == b""
    told = "".join(capfd.readouterr())
    assert ("page: refused" in told and "408" in told) == bool(said)  # browsers open lines and say nothing


def test_a_good_first_request_buys_no_time_for_a_slow_second(serve, monkeypatch):
    monkeypatch.setattr(http_server, "HEAD_SECONDS", SOON)
    page = serve()
    with talk(page, WHOLE) as line:
        assert line.recv(65536).startswith(b"HTTP/1.1 200")
        line.sendall(HALF)
        heard(line)  # ends: we are hung up on


def test_a_body_that_does_not_come_is_not_waited_for(serve, monkeypatch, capfd):
    monkeypatch.setattr(http_guard, "BODY_SECONDS", SOON)
    page = serve()
    head = b"POST /api/v1/axes/axis-1/commands/relearn HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
    with talk(page, head + b'Content-Type: application/json\r\nContent-Length: 40\r\n\r\n{"text"') as line:
        answer = heard(line)
    assert answer.startswith(b"HTTP/1.1 408")
    assert b"did not arrive within 0.3 s" in answer
    assert "page: refused" in "".join(capfd.readouterr())


def test_an_answer_that_takes_its_time_is_not_cut_off(serve, monkeypatch):
    """Who has said all that he wants may listen for as long as he likes."""
    monkeypatch.setattr(http_server, "HEAD_SECONDS", SOON)
    page = serve(requests_per_minute=100_000)
    with page.client.stream("GET", "/api/v1/events") as events:
        lines = events.iter_lines()
        assert any("hello" in line for line in lines)
        end = time.monotonic() + 3 * SOON
        while time.monotonic() < end:  # longer than a head may take
            assert page.get("/healthz").status_code == 200
            time.sleep(0.3 * SOON)  # not so often that the page calls it too many
        page.server.hear("alerts", "axis-1", {"kind": "wear", "transition": {"id": 1, "after": "unacknowledged"}})
        assert any("wear" in line for line in lines)
