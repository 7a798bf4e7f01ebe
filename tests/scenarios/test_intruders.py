"""Strangers stay out: a real daemon with certificates, roles and tokens; everybody who should not get in, tried.

Each is refused, and the daemon's log says so.
"""

import itertools
import re
import shutil
import socket
import subprocess
import time

import httpx
import pytest

from monitor.config_page import ADDRESS_FILE
from monitor.queries import Reader
from monitor.token_files import add_token
from monitor.tokens import Role
from plant import keys
from plant.errors import ParameterError, ReachError
from plant.publisher import SamplePublisher
from plant.zenoh_session import open_session
from tests.scenarios.harness import ROOT, SITE, START_NS, Ear, Plant, blocks_of, burst, wait_for

SCRIPT = ROOT / "deploy" / "security" / "private-ca.sh"
pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="the private authority needs openssl")


def authority(folder, *names):
    """A private authority and identities, made by the script people are told to use."""
    subprocess.run([SCRIPT, "init", folder], check=True, capture_output=True)
    for name in names:
        subprocess.run([SCRIPT, "issue", folder, name, "127.0.0.1", "localhost"], check=True, capture_output=True)
    return folder


def expire(folder, name):
    """An identity of the authority in `folder` that was good until yesterday."""
    subprocess.run([SCRIPT, "issue", folder, name, "127.0.0.1"], check=True, capture_output=True)
    here = folder / name
    request = ["openssl", "req", "-new", "-key", here / "key.pem", "-subj", f"/CN={name}", "-out", here / "csr"]
    subprocess.run(request, check=True, capture_output=True)
    (here / "index").write_text("")
    (here / "serial").write_text("99")
    (here / "ca.cnf").write_text(
        f"[ca]\ndefault_ca=d\n[d]\ndatabase={here}/index\nserial={here}/serial\nnew_certs_dir={here}\n"
        "default_md=sha256\npolicy=p\nx509_extensions=e\n[p]\ncommonName=supplied\n"
        "[e]\nbasicConstraints=critical,CA:false\nextendedKeyUsage=clientAuth\n"
    )
    sign = ["openssl", "ca", "-batch", "-config", here / "ca.cnf", "-cert", folder / "ca.pem"]
    sign += ["-keyfile", folder / "ca.key", "-startdate", "20200101000000Z", "-enddate", "20200201000000Z"]
    sign += ["-in", here / "csr", "-out", here / "certificate.pem", "-notext"]
    subprocess.run(sign, check=True, capture_output=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A daemon that asks for certificates; folders of everybody's identity."""
    folder = tmp_path_factory.mktemp("secured")
    pki = authority(folder / "pki", "daemon", "gateway", "office", "shift", "logger", "stranger")
    expire(pki, "late")
    authority(folder / "foreign", "gateway")
    roles = '[security]\nidentity = "pki/daemon"\nviewers = ["office"]\noperators = ["shift"]\nrecorders = ["logger"]\n'
    roles += 'publishers = { gateway = ["axis-1"] }\n'
    tokens = folder / "tokens.toml"
    page = f'[page]\nlisten = "127.0.0.1:0"\ntoken_file = "{tokens}"\n'
    may = {"operator": add_token(tokens, "olga", Role.OPERATE), "viewer": add_token(tokens, "vera", Role.VIEW)}
    with Plant(folder, settings=roles + page) as plant:
        plant.tokens = may
        plant.endpoint = plant.endpoint.replace("tcp/", "tls/")
        plant.config.write_text(plant.config.read_text().replace("tcp/", "tls/"))
        plant.start()
        yield plant


def session(site, who, authority="pki", timeout=20.0):
    return open_session("client", connect=[site.endpoint], identity=site.folder / authority / who, timeout=timeout)


def logged(site, *words, once=lambda: None):
    """The daemon's log comes to hold a line with all of `words`, after what is done `once` more each time."""

    def found():
        once()
        return any(all(word in line for word in words) for line in site.log.splitlines())

    wait_for(found, 20, f"a line of the log with {words}")


def samples_of(site, axis="axis-1"):
    with Reader(site.url) as reader:
        return next((one.samples for one in reader.axes() if one.name == axis), 0)


def send(site, link, axis="axis-1", epoch=1):
    torque, position = burst(site.axis)
    with SamplePublisher(link, SITE, axis, epoch=epoch) as publisher:
        for block in blocks_of(axis, epoch, 0, START_NS, torque, position):
            publisher.put(block)
        time.sleep(1.0)  # long enough for what must not arrive; what must is waited for


def test_each_role_can_do_its_own_and_no_more(site):
    with session(site, "gateway") as gateway, session(site, "office") as office:
        ear, raw = Ear(office), []
        spy = office.declare_subscriber(keys.samples_pattern(SITE), raw.append)
        at_gateway = Ear(gateway)
        send(site, gateway)
        wait_for(lambda: samples_of(site) == 2000, 30, "the gateway's samples in the history")
        wait_for(lambda: ear.heard["parameters"] and ear.heard["model"] and ear.heard["status"], 60, "answers")
        wait_for(lambda: at_gateway.committed() == 1999, 30, "the gateway reads its acknowledgement")
        assert not raw, "a viewer never gets raw samples"
        assert not at_gateway.heard["parameters"], "a publisher reads the status of its axes and nothing else"
        asked = keys.history_key(SITE, "axis-1", "parameters")
        replies = list(office.get(f"{asked}?parameter=coulomb_force", timeout=20.0))
        assert replies, "a viewer asks the history"
        assert replies[0].ok is not None
        assert not list(gateway.get(f"{asked}?parameter=coulomb_force", timeout=2.0)), "a publisher does not"
        spy.undeclare()
        ear.close()
        at_gateway.close()


def test_a_recorder_gets_raw_samples_and_a_bridge_tells_what_it_counts(site):
    with session(site, "gateway") as gateway, session(site, "logger") as logger, session(site, "office") as office:
        raw, told, answers = [], [], Ear(logger)
        ear = logger.declare_subscriber(keys.samples_pattern(SITE), raw.append)
        desk = office.declare_subscriber(f"tribowatch/{SITE}/*/{keys.BRIDGE}", told.append)

        def tell():
            for name in ("other", "gateway"):
                gateway.put(keys.bridge_key(SITE, name), b"{}")
            return told

        wait_for(tell, 30, "the status of the bridge at the office")  # again until the links know each other
        assert {str(one.key_expr) for one in told} == {keys.bridge_key(SITE, "gateway")}
        epochs = itertools.count(3)
        wait_for(lambda: send(site, gateway, epoch=next(epochs)) or len(raw) >= 20, 60, "raw samples at the recorder")
        assert not answers.heard["parameters"], "a recorder reads no answers"
        ear.undeclare()
        desk.undeclare()
        answers.close()


@pytest.mark.parametrize(
    ("who", "axis"),
    [("office", "axis-1"), ("shift", "axis-1"), ("logger", "axis-1"), ("stranger", "axis-1"), ("gateway", "axis-2")],
    ids=["viewer", "operator", "recorder", "no role", "somebody else's axis"],
)
def test_nobody_else_can_publish(site, who, axis):
    before = samples_of(site, axis)

    def try_it():
        with session(site, who) as link:
            link.put(keys.samples_key(SITE, axis), b"")  # at once: later Zenoh knows no taker here and keeps silent

    if who == "stranger":
        logged(site, "link without a role", "certificate=stranger", once=try_it)
    else:
        logged(site, "message refused", f"certificate={who}", f"/{axis}/samples", "what=put", once=try_it)
    with session(site, who) as link:
        send(site, link, axis, epoch=100)
    assert samples_of(site, axis) == before


def test_a_stranger_with_a_good_certificate_reads_nothing(site):
    with session(site, "stranger") as link:
        ear, before = Ear(link), samples_of(site)
        with session(site, "gateway") as gateway:
            send(site, gateway, epoch=50)
        wait_for(lambda: samples_of(site) >= before + 2000, 30, "samples that the stranger must not see answered")
        assert not any(ear.heard.values())
        assert not list(link.get(keys.history_key(SITE, "axis-1", "parameters"), timeout=2.0))
        ear.close()
    logged(site, "link without a role", "certificate=stranger", "client=127.0.0.1:")


def command(site, who):
    """What the daemon answers to a note about axis-1 by `who`: True done, None no answer."""
    asked = f"{keys.command_key(SITE, 'axis-1')}?do=event;kind=note;text=hello;author={who}"
    with session(site, who) as link:
        replies = list(link.get(asked, timeout=3.0))
    return replies[0].ok is not None if replies and replies[0].err is None else None


@pytest.mark.parametrize("who", ["office", "gateway", "stranger"])
def test_only_an_operator_commands(site, who):
    wait_for(lambda: command(site, "shift"), 30, "the operator's command is taken")

    def asked():
        """Again, as long as it takes: a link that has just been opened may not know of the daemon yet."""
        assert command(site, who) is None

    asked()
    if who == "stranger":
        logged(site, "link without a role", f"certificate={who}")
    else:
        logged(site, "message refused", f"certificate={who}", "axis-1/command", "what=query", once=asked)


@pytest.mark.parametrize(
    ("who", "authority", "why"),
    [
        ("gateway", "foreign", "invalid peer certificate: BadSignature"),
        ("late", "pki", "certificate: certificate expired"),
    ],
    ids=["foreign", "expired"],
)
def test_a_bad_certificate_gets_no_link(site, who, authority, why):
    with pytest.raises(ReachError, match="certificates"):
        session(site, who, authority, timeout=2.0)
    here = site.folder / authority / who
    knock(site, "-cert", here / "certificate.pem", "-key", here / "key.pem")  # one that trusts whomever it meets
    logged(site, "link refused", why)


def knock(site, *words):
    """A TLS client that does not look at the daemon's certificate."""
    command = ["openssl", "s_client", "-connect", site.endpoint.removeprefix("tls/"), *words]
    subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=20)


def test_without_a_certificate_there_is_no_link(site, monkeypatch):
    monkeypatch.delenv("TRIBOWATCH_IDENTITY", raising=False)
    with pytest.raises(ParameterError, match="TRIBOWATCH_IDENTITY"):
        open_session("client", connect=[site.endpoint])
    with pytest.raises(ReachError):
        open_session("client", connect=[site.endpoint.replace("tls/", "tcp/")], timeout=1.0)
    logged(site, "link refused", "corrupt message")
    knock(site)
    logged(site, "link refused", "peer sent no certificates")


def test_a_key_that_others_can_read_is_refused(site):
    shutil.copytree(site.folder / "pki" / "office", site.folder / "open")
    (site.folder / "open" / "key.pem").chmod(0o644)
    with pytest.raises(ParameterError, match="chmod 600"):
        open_session("client", connect=[site.endpoint], identity=site.folder / "open")


@pytest.mark.parametrize("size", [1_100_000, 6_000_000], ids=["beyond a payload", "beyond a message"])
def test_what_is_too_large_is_not_taken_and_the_link_goes_on(site, size):
    before = samples_of(site)
    with session(site, "gateway") as link:
        link.put(keys.samples_key(SITE, "axis-1"), bytes(size), encoding="application/cbor")
        if size < 4 << 20:  # beyond that it is the link that drops it, without a word
            logged(site, "payload refused", "axis=axis-1", "too_large")
        send(site, link, epoch=200 + size)
    wait_for(lambda: samples_of(site) == before + 2000, 30, "the samples after it")


@pytest.fixture
def door(site):
    """A client of the page."""
    address = (site.folder / "var" / ADDRESS_FILE).read_text().strip()
    with httpx.Client(base_url=re.search(r"https?://[^\s\"]+", address)[0], timeout=30) as client:
        yield client


COMMAND = "/api/v1/axes/axis-1/commands/acknowledge"


@pytest.mark.parametrize(
    ("token", "path", "body", "status"),
    [
        (None, "/api/v1/fleet", None, 401),
        ("tw_wrong", "/api/v1/status", None, 401),
        (None, COMMAND, {"kind": "wear"}, 401),
        ("viewer", COMMAND, {"kind": "wear"}, 403),
        ("operator", "/api/v1/axes/axis-1/commands/event", {"text": "x" * 100_000}, 413),
    ],
    ids=["no token", "wrong token", "no token, command", "viewer acknowledges", "oversize request"],
)
def test_the_page_opens_to_nobody_without_the_right_token(site, door, token, path, body, status):
    headers = {"authorization": f"Bearer {site.tokens.get(token, token)}"} if token else {}
    answer = door.request("POST" if body else "GET", path, json=body, headers=headers)
    assert answer.status_code == status
    logged(site, "page: refused", f"path={path}", f"status={status}")


@pytest.mark.parametrize("path", ["/static/../../../etc/passwd", "/static/%2e%2e/%2e%2e/tokens.toml", "/..%5c..%5cx"])
def test_no_path_leads_out_of_the_page(site, door, path):
    with socket.create_connection((door.base_url.host, door.base_url.port), timeout=30) as line:
        head = f"GET {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {site.tokens['operator']}\r\n\r\n"
        line.sendall(head.encode())  # by hand: a client would tidy the path up
        assert line.recv(4096).startswith(b"HTTP/1.1 404")
    logged(site, "page: refused", "..", "status=404")
