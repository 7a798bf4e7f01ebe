"""Score one answer against its sealed label. Pure: dictionaries in, a flat `Score` out.

Severity is the ratio of the baseline's held-out criterion (from the answer) to that of the true machine (`truth`, from
the label): hidden below 1.3, faint to 2.5, clear to 10, strong beyond. It does not depend on what was answered; where
there is no answer with a baseline it follows from the drawn size. A simulator that does not know the criterion of its
machine labels the ratio itself, of mean squares of forces (`severity_ratio`). A pair may show well while one of the two
hides behind the other: how well the lesser one shows (`truth.beside`, from the label) is told on the same scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

SIZES = {"small": 0.55, "medium": 0.95, "large": 9.9}  # upper ends of the drawn size, 1 = 8-15 % of dry friction
SEVERITIES = {"hidden": 1.3, "faint": 2.5, "clear": 10.0, "strong": 1e300}  # upper ends of the ratio
BY_SIZE = {"small": "faint", "medium": "clear", "large": "strong"}
PLACES = ("centre", "position", "rest_position", "time")  # parameters whose relative error means nothing


@dataclass(frozen=True)
class Score:
    """What an answer is worth.

    Attributes:
        outcome: single: right, accepted (truth is one of the alternatives), extra (truth and a false name), wrong,
            abstained (no_mismatch), unexplained, insufficient, failed. Pair: both, accepted, one (of the two, nothing
            false), one_and_wrong, ... as before. Outside, nothing hidden and still: the verdict, or wrong.
        good: the outcome a user wants.
        false_name: a name was given that is not true, and no alternative is the whole truth.
        lesser: severity of the effect of a pair that shows less beside the other; "" where the label does not tell.
        at_least_one: pair of which the answer (or an alternative) holds at least one.
        located: outside: coordinate among those of the list; strictly: the first coordinate given.
        interval: outside with a known interval: right or not.
        ratio: held-out criterion, baseline over extended, None without an extended model.
        over_true: held-out criterion of the answer's extended model over the true machine's, where the name is right.
        gained: share of what the true machine gains over the baseline, in logarithms, where the name is right.
        places: errors of places (centre, position) of effects named right, as shares of the travel.
        rivals: method -> outcome of the same case, and whether its first name is true.
        errors: relative error of each parameter of each effect named right, (name.parameter, error).
        covered: whether its interval held the truth, (name.parameter, hit); only of curves the catalogue has.
    """

    case: str
    kind: str
    truth: tuple[str, ...]
    said: tuple[str, ...]
    verdict: str
    outcome: str
    good: bool
    false_name: bool = False
    at_least_one: bool | None = None
    located: bool | None = None
    located_first: bool | None = None
    interval: bool | None = None
    coordinate: str | None = None
    ratio: float | None = None
    over_true: float | None = None
    gained: float | None = None
    severity: str = ""
    lesser: str = ""
    size: str = ""
    excitation: str = ""
    loop: str = ""
    noise: float = 0.0
    period: float = 0.0
    orientation: str = ""
    shapes: str = ""
    seconds: float = 0.0
    cpu: float = 0.0
    errors: list[tuple[str, float]] = field(default_factory=list)
    covered: list[tuple[str, bool]] = field(default_factory=list)
    places: list[tuple[str, float]] = field(default_factory=list)
    rivals: dict[str, dict] = field(default_factory=dict)


def score(case: str, label: dict, reply: dict, rivals: dict | None = None) -> Score:
    """Score the reply of `diagnosing.ask` to a case, and that of `ask_rivals`, against its label."""
    answer, spec, kind = reply["answer"], label["spec"], label["kind"]
    truth = tuple(sorted(label["effects"])) if kind != "still" else ()
    said: tuple[str, ...] = ()
    verdict, sets, values = "failed", [], {}
    if answer is not None:
        verdict = answer["verdict"]
        said = tuple(sorted(effect["name"] for effect in answer["effects"]))
        sets = [set(said), *(set(names) for names in answer["alternatives"])]
        if kind == "outside":
            values = _where(label["outside"], answer["location"])
    outcome = _outcome(kind, set(truth), verdict, sets)
    if kind == "pair":
        values["at_least_one"] = any(names & set(truth) for names in sets)
    ratio = _ratio(answer)
    size = next(name for name, end in SIZES.items() if spec["size"] < end)
    true = label.get("true_criterion")
    baseline = ((answer or {}).get("fit") or {}).get("baseline", {}).get("held_out")
    over_truth = baseline / true if true and baseline else label.get("severity_ratio")
    severity = _severity(over_truth) if over_truth else BY_SIZE[size]
    if label.get("beside"):
        values["lesser"] = _severity(min(label["beside"].values()))
    if answer is not None:
        values["errors"], values["covered"] = _parameters(label, answer)
        values["places"] = _place_errors(label, answer)
        if true and ratio is not None and outcome in ("right", "accepted", "both"):
            extended = answer["fit"]["extended"]["held_out"]
            values["over_true"] = extended / true
            if baseline / true > SEVERITIES["hidden"]:
                values["gained"] = math.log(baseline / extended) / math.log(baseline / true)
    values["rivals"] = {
        method: _rival(kind, truth, said_by["sets"]) for method, said_by in ((rivals or {}).get("rivals") or {}).items()
    }
    return Score(
        case=case, kind=kind, truth=truth or ((label["outside"]["name"],) if label["outside"] else ()), said=said,
        verdict=verdict, outcome=outcome, good=outcome in ("right", "accepted", "both", "as_expected"),
        false_name=outcome in ("wrong", "extra", "one_and_wrong"), ratio=ratio, severity=severity, size=size,
        excitation=spec["excitation"], loop="closed" if spec["excitation"].startswith("loop") else "open",
        noise=spec["noise"], period=spec["period"], orientation=spec["orientation"], shapes=spec["shapes"],
        seconds=reply["seconds"], cpu=reply["cpu"], **values,
    )  # fmt: skip


def _severity(ratio: float) -> str:
    return next(name for name, end in SEVERITIES.items() if ratio < end)


def _rival(kind: str, truth: tuple[str, ...], sets: list[list[str]] | None) -> dict:
    """The outcome of a rival method, which knows only names; None: it failed."""
    if sets is None:
        return {"outcome": "failed", "good": False, "false_name": False, "first": False, "at_least_one": False}
    outcome = _outcome(kind, set(truth), "explained" if sets else "no_mismatch", [set(names) for names in sets])
    return {
        "outcome": outcome,
        "good": outcome in ("right", "accepted", "both", "as_expected"),
        "false_name": outcome in ("wrong", "extra", "one_and_wrong"),
        "first": bool(sets) and any(names[0] in truth for names in sets),
        "at_least_one": any(set(names) & set(truth) for names in sets),
    }


def _place_errors(label: dict, answer: dict) -> list[tuple[str, float]]:
    """Errors of the places of effects named right, over the travel."""
    travel = label.get("travel")
    return [
        (f"{effect['name']}.{key}", abs(effect["parameters"][key]["value"] - true) / travel)
        for effect in answer["effects"]
        for key, true in label["effects"].get(effect["name"], {}).items()
        if travel and key in ("centre", "position") and key in effect["parameters"]
    ]


def _outcome(kind: str, truth: set[str], verdict: str, sets: list[set[str]]) -> str:
    if verdict == "failed":
        return "failed"
    if kind in ("outside", "smooth", "rough", "still"):
        expected = {"outside": "unexplained", "still": "insufficient_data"}.get(kind, "no_mismatch")
        return "as_expected" if verdict == expected else "wrong" if verdict == "explained" else verdict
    if verdict != "explained":
        return {"no_mismatch": "abstained", "insufficient_data": "insufficient"}.get(verdict, verdict)
    said = sets[0]
    if said == truth:
        return "both" if kind == "pair" else "right"
    if truth in sets:
        return "accepted"
    if kind == "pair" and said & truth:
        return "one_and_wrong" if said - truth else "one"
    return "extra" if said > truth else "wrong"


def _ratio(answer: dict | None) -> float | None:
    fits = (answer or {}).get("fit", {})
    if "extended" not in fits or not answer["effects"]:
        return None
    before, after = fits["baseline"]["held_out"], fits["extended"]["held_out"]
    return before / after if before and after else None


def _where(outside: dict, location: dict | None) -> dict:
    """Whether coordinate and interval of an answer are those of what is outside the catalogue."""
    known = outside["interval"] is not None
    if location is None:
        return {"located": False, "located_first": False, "interval": False if known else None}
    given, right = [location["coordinate"], *location.get("alternatives", [])], outside["coordinates"]
    first = location["coordinate"] in right
    values = {"located": any(name in right for name in given), "located_first": first, "coordinate": given[0]}
    if known:
        values["interval"] = first and _overlap(location["interval"], outside["interval"])
    return values


def _overlap(given: list[float], true: list[float]) -> bool:
    """A frequency within 10 %; otherwise at least half of the shorter interval shared, and not thrice as long."""
    low, high = sorted(given)
    if true[0] == true[1]:
        return 0.9 * true[0] <= high and low <= 1.1 * true[0] and high - low <= 0.5 * true[0]
    shared = min(high, true[1]) - max(low, true[0])
    return shared >= 0.5 * min(high - low, true[1] - true[0]) and high - low <= 3.0 * (true[1] - true[0])


def _parameters(label: dict, answer: dict) -> tuple[list[tuple[str, float]], list[tuple[str, bool]]]:
    errors, covered = [], []
    for effect in answer["effects"]:
        name, found = effect["name"], effect["parameters"]
        for parameter, true in label["effects"].get(name, {}).items():
            if parameter not in found or label["kind"] == "still":
                continue
            key, given = f"{name}.{parameter}", found[parameter]
            if parameter not in PLACES and true:
                errors.append((key, abs(given["value"] - true) / abs(true)))
            if given["ci95"] is not None and name not in label["shapes"]:
                covered.append((key, given["ci95"][0] <= true <= given["ci95"][1]))
    return errors, covered
