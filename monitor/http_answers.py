"""What each address of the HTTP API answers, as values: the same reader as the command line and Zenoh, so the same answers.

No server in here: every answer is one function of a reader, the parts of the path and the words of the query.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from monitor import questions
from monitor.queries_page import PageReader
from monitor.questions import POINTS, RANGE, SCHEMA_VERSION

Words = Mapping[str, str]
Answer = Callable[[PageReader, Words, Words], dict[str, Any]]


def fleet(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
    """Every axis, the most urgent first."""
    questions.refuse_unknown("fleet", asked, ())
    return {"axes": reader.fleet()}


def axes(reader: PageReader, path: Words, asked: Words) -> dict[str, Any]:
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


ANSWERS: dict[str, Answer] = {
    "/fleet": fleet,
    "/axes": axes,
    "/axes/{axis}": axis,
    "/axes/{axis}/history": history,
    "/axes/{axis}/alerts": alerts,
    "/axes/{axis}/watch": watch,
    "/axes/{axis}/curves": curves,
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
