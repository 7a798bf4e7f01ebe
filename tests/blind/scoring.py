"""Score one answer against its sealed label. Pure: dictionaries in, a flat `Score` out.

Severity. The goal's measure is the ratio of the baseline's to the *true model's* held-out criterion. The true model of
the reference simulator (other shapes, unrepeatable forces) is not among the models the tool can fit, so the ratio
baseline / extended *of the answer* stands in for it where the answer names the truth; where it does not, the class
follows from the drawn size of the effect. Right and wrong cases are therefore classed by different measures, and a
severity class is not an unbiased sample: `size`, drawn before anything was recorded, is. Both tables are printed.
A constant force is part of the baseline already, so a right `force_offset` alone has the ratio 1 ("hidden").
"""

from __future__ import annotations

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
        at_least_one: pair of which the answer (or an alternative) holds at least one.
        located: outside: coordinate among those of the list; strictly: the first coordinate given.
        interval: outside with a known interval: right or not.
        ratio: held-out criterion, baseline over extended, None without an extended model.
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
    severity: str = ""
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


def score(case: str, label: dict, reply: dict) -> Score:
    """Score the reply of `diagnosing.ask` to a case against its label."""
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
    severity = BY_SIZE[size]
    if ratio is not None and outcome in ("right", "accepted", "both"):
        severity = next(name for name, end in SEVERITIES.items() if ratio < end)
    if answer is not None:
        values["errors"], values["covered"] = _parameters(label, answer)
    return Score(
        case=case, kind=kind, truth=truth or ((label["outside"]["name"],) if label["outside"] else ()), said=said,
        verdict=verdict, outcome=outcome, good=outcome in ("right", "accepted", "both", "as_expected"),
        false_name=outcome in ("wrong", "extra", "one_and_wrong"), ratio=ratio, severity=severity, size=size,
        excitation=spec["excitation"], loop="closed" if spec["excitation"].startswith("loop") else "open",
        noise=spec["noise"], period=spec["period"], orientation=spec["orientation"], shapes=spec["shapes"],
        seconds=reply["seconds"], cpu=reply["cpu"], **values,
    )  # fmt: skip


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
