"""What each address of the HTTP API answers, as values; the command line and Zenoh ask the same reader.

No server in here: every answer is one function of a reader, the parts of the path and the words of the query.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from monitor import questions
from monitor.query_page import PageReader
from monitor.questions import POINTS, RANGE, SCHEMA_VERSION

Words = Mapping[str, str]
Answer = Callable[[PageReader, Words, Words], dict[str, Any]]


def fleet(reader: PageReader, _path: Words, asked: Words) -> dict[str, Any]:
    """Every axis, the most urgent first."""
    questions.refuse_unknown("fleet", asked, ())
    return {"axes": reader.fleet()}


def axes(reader: PageReader, _path: Words, asked: Words) -> dict[str, Any]:
    """Every axis in full, by name: what `tribowatch axes --json` prints."""
    questions.refuse_unknown("axes", asked, ())
    return {"axes": [one.to_dict() for one in reader.axes()]}


def axis(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """One axis in full."""
    questions.refuse_unknown("axis", asked, ())
    return reader.axis(path["axis"]).to_dict()


def history(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Trend of the parameters: what `tribowatch history --json` prints."""
    return questions.parameters(reader, path["axis"], asked)


def alerts(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Alerts and their audit, of one axis or of all: what `tribowatch alerts --json` prints."""
    return questions.alerts(reader, path.get("axis"), asked)


def watch(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Charts, operating point and verdicts over time."""
    questions.refuse_unknown("watch", asked, (*RANGE, "points"))
    return reader.watched(path["axis"], points=questions.whole(asked, "points", POINTS), **questions.span_of(asked))


def curves(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Friction against speed, now and when healthy."""
    questions.refuse_unknown("curves", asked, ())
    return reader.curves(path["axis"])


def events(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """What was done to the axis: maintenance, repairs, new baselines."""
    questions.refuse_unknown("events", asked, ("limit",))
    return {"axis": path["axis"], "events": reader.events(path["axis"], limit=questions.whole(asked, "limit", POINTS))}


def versions(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Constants and promoted effects of the axis' model, version by version."""
    questions.refuse_unknown("versions", asked, ())
    return {"axis": path["axis"], "versions": reader.versions(path["axis"])}


def diagnoses(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Diagnoses of the axis, oldest first, each with what `tribowatch diagnose --json` prints."""
    questions.refuse_unknown("diagnoses", asked, ("limit",))
    limit = questions.whole(asked, "limit", POINTS)
    found = reader.diagnoses(path["axis"], limit=limit)
    for one in found:  # the pictures come with the single one, as figures
        one["result"] = {name: value for name, value in one["result"].items() if name != "pictures"}
    return {"axis": path["axis"], "diagnoses": found}


def diagnosis(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """One diagnosis with its figures, where they were kept."""
    questions.refuse_unknown("diagnosis", asked, ())
    return reader.diagnosis(path["axis"], questions.whole(path, "number", 1))


def evidence(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Bundles of evidence kept for the axis; each is at /evidence/NUMBER."""
    questions.refuse_unknown("evidence", asked, ("limit",))
    limit = questions.whole(asked, "limit", POINTS)
    return {"axis": path["axis"], "evidence": reader.evidence_list(path["axis"], limit=limit)}


ANSWERS: dict[str, Answer] = {
    "/fleet": fleet,
    "/axes": axes,
    "/axes/{axis}": axis,
    "/axes/{axis}/history": history,
    "/axes/{axis}/alerts": alerts,
    "/axes/{axis}/watch": watch,
    "/axes/{axis}/curves": curves,
    "/axes/{axis}/events": events,
    "/axes/{axis}/versions": versions,
    "/axes/{axis}/diagnoses": diagnoses,
    "/axes/{axis}/diagnoses/{number}": diagnosis,
    "/axes/{axis}/evidence": evidence,
    "/alerts": alerts,
}


def answer(route: str, reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """The answer of `route`, with the version of its fields.

    Raises:
        QueryError: what is asked is not understood.
        UnknownError: it is not there.
        DatabaseError: the history cannot be read.
    """
    return {"schema_version": SCHEMA_VERSION, **ANSWERS[route](reader, path, asked)}
