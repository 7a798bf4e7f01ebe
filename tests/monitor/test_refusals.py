"""What Zenoh says of refusals, as its version here says it, and what is made of it."""

import os
import subprocess
import sys

import pytest

from monitor.refusals import FORGOTTEN, MOST, Refusals

WHO = "a8980c001e0f"
SUBJECT = f"{WHO} on Interface(lo)+CertCommonName(office)+Transport(Tls)+{WHO}"
KEY = "tribowatch/plant-1/axis-1/samples"
PUT = f"Using cached result: {WHO} is unauthorized to Put (ingress) on {KEY}"
MET = "Msg intercepted!"


def line(said, thread=16, where="net::routing::interceptor::access_control"):
    where = "net::routing::interceptor" if said == MET else where
    stamp = "2026-11-22T11:19:06.509296Z"
    return f"\x1b[2m{stamp}\x1b[0m TRACE  rx-0 ThreadId({thread}) \x1b[2mzenoh::{where}\x1b[0m\x1b[2m:\x1b[0m {said}"


def read(*lines, now=0.0, refusals=None):
    refusals = refusals or Refusals()
    return [found for one in lines if (found := refusals.read(one, now))]


def test_a_message_that_was_refused_is_told_with_the_certificate():
    known = line(f"{SUBJECT} is authorized to Query (ingress) on tribowatch/plant-1/axis-1/status")
    [found] = read(known, line(PUT), line(MET))
    assert found.event == "message refused"
    assert found.fields == {"certificate": "office", "what": "put", "key": KEY, "count": 1}


def test_what_is_decided_in_advance_or_met_on_another_thread_refuses_nothing():
    kinds = ("Query", "Reply", "Put", "Delete", "Declare/Undeclare Subscriber", "Declare/Undeclare Queryable",
             "Declare/Undeclare Liveliness Token", "Liveliness Query", "Declare Liveliness Subscriber")  # fmt: skip
    ahead = [line(f"ACL (ingress): caching permissions for `{KEY}` ...")]
    ahead += [line(f"{SUBJECT} is unauthorized to {kind} (ingress) on {KEY}") for kind in kinds]
    assert read(*ahead, line(MET)) == []
    assert read(line(PUT, 16), line(MET, 17)) == []
    assert read(line(PUT), line(PUT.replace("unauthorized", "authorized")), line(MET)) == []
    assert read(line(PUT.replace("ingress", "egress")), line(MET)) == []
    assert len(read(*ahead, line(PUT), line(MET))) == 1


def test_links_that_are_refused_or_have_no_role_are_told():
    why = "invalid peer certificate: certificate expired: verification time 1795350019 (UNIX), but not valid"
    no_link = line(f"{why}. Hint: increase the system open file limit.", where="link_tls::x")
    no_link = no_link.replace("zenoh::link_tls::x", "zenoh_link_tls::unicast")
    opened = line("Accepted TLS connection on 127.0.0.1:7447: 192.0.2.7:4711. Common Name: Jo Doe.", thread=5)
    no_role = line(f"{WHO} did not match any configured ACL subject. Default permission `Deny` will be", thread=5)
    assert [(one.event, one.fields) for one in read(no_link, opened, no_role)] == [
        ("link refused", {"why": "invalid peer certificate: certificate expired", "count": 1}),
        ("link without a role: all its messages are refused",
         {"certificate": "Jo Doe", "client": "192.0.2.7:4711", "count": 1}),
    ]  # fmt: skip


def test_a_flood_makes_few_lines_and_bounded_memory_and_is_told_anew_after_an_hour():
    refusals = Refusals()
    told = read(*[line(PUT), line(MET)] * 250, refusals=refusals)
    assert [one.fields["count"] for one in told] == [1, 10, 100]
    assert read(line(PUT), line(MET), now=FORGOTTEN + 1, refusals=refusals)[0].fields["count"] == 1
    for number in range(3 * MOST):
        read(line(PUT.replace(WHO, f"{number:x}").replace(KEY, f"k/{number}")), line(MET), refusals=refusals)
    assert len(refusals._counts) <= MOST + 1
    assert len(refusals._names) <= MOST


@pytest.mark.parametrize("text", ["", "ThreadId(", "ThreadId(1) " + "access_control: x is unauthorized to"])
def test_other_words_are_no_refusals(text):
    assert read(text, text + MET) == []


def test_what_others_print_comes_through_and_a_flood_of_zenohs_words_never_holds_it_up():
    program = (
        "import os, time\n"
        "from monitor import refusals_zenoh\n"
        "refusals_zenoh.PAUSE = 60.0\n"
        "log = refusals_zenoh.RefusalLog()\n"
        "log._closing.set()\n"
        "print('a word', flush=True)\n"
        "lost = 0\n"
        "for _ in range(30_000):\n"
        "    try:\n"
        "        os.write(1, b'ThreadId(1) ' + b'x' * 200 + b'\\n')\n"
        "    except BlockingIOError:\n"
        "        lost += 1\n"
        "log.close()\n"
        "print('after', lost > 0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, env=os.environ, check=True
    )
    assert done.stdout.split("\n")[:2] == ["a word", "after True"]
