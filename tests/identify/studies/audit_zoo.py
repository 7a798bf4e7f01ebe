"""`make audit-zoo`: which mistakes at the edge the audit refuses, which it only warns of, which it misses.

`python -m tests.identify.studies.audit_zoo [--axes 200] [--seeds 101,102,103]`. The healthy machines are drawn from
seeds that the tests do not use; a mistake is done to all of them that it can be done to. The last rows are what no
physics of a rough model can tell well: small factors, and a tenth where the inertia is but a guess.
"""

import argparse
import math
import sys

from identify.audit import audit_recording, worst
from tests.identify.healthy_axes import healthy_axes
from tests.identify.mistakes import ZOO, scaled


def healthy(count: int, seeds: list[int]) -> dict[str, int]:
    """How often healthy machines are refused and warned of."""
    verdicts = [worst(audit_recording(m.recording, m.axis)) for seed in seeds for m in healthy_axes(count, seed)]
    return {"machines": len(verdicts), "refused": verdicts.count("refuse"), "warned": verdicts.count("warn")}


HARD = {
    **{
        f"force x {factor:.3g}, inertia known": (
            scaled("force", factor), lambda axis: axis.mechanics.inertia_known, "", 0.0
        )
        for factor in (1 / 2.5, 1 / 2, 1 / 1.5, 1.5, 2.0, 2.5)
    },
    "percent as per mille, inertia a guess": (
        scaled("force", 0.1), lambda axis: not axis.mechanics.inertia_known, "", 0.0
    ),
}  # fmt: skip


def caught(mistake, machines) -> dict[str, int]:
    """What the audit says of one mistake."""
    break_it, concerns, word, _ = mistake
    row = {"machines": 0, "refused": 0, "warned": 0, "missed": 0, "named": 0}
    for machine in machines:
        if not concerns(machine.axis):
            continue
        findings = audit_recording(break_it(machine.recording, machine.axis), machine.axis)
        verdict = worst(findings)
        row["machines"] += 1
        row[{"refuse": "refused", "warn": "warned", "ok": "missed"}[verdict]] += 1
        row["named"] += bool(word) and any(word in (one.likely or "") for one in findings if one.severity == "refuse")
    return row


def upper(count: int, of: int) -> float:
    """Upper end of the 95 % interval of a rate (rule of three where none was seen). [1]"""
    return 3 / of if count == 0 else (count + 1.96 * math.sqrt(count)) / of


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--axes", type=int, default=200)
    options.add_argument("--seeds", default="401,402,403,404,405")
    chosen = options.parse_args()
    seeds = [int(seed) for seed in chosen.seeds.split(",")]
    clean = healthy(chosen.axes, seeds)
    write = sys.stdout.write
    most = 100 * upper(clean["refused"], clean["machines"])
    write(f"healthy machines: {clean['machines']}, refused {clean['refused']} (at most {most:.2g} %), ")
    write(f"warned of {clean['warned']}\n\n")
    write("| mistake | machines | refused | only warned | missed | called by its name |\n|---|---|---|---|---|---|\n")
    machines = healthy_axes(chosen.axes, seeds[0])
    for name, mistake in (ZOO | HARD).items():
        row = caught(mistake, machines)
        named = f"{row['named']}" if mistake[2] else "–"
        write(f"| {name} | {row['machines']} | {row['refused']} | {row['warned']} | {row['missed']} | {named} |\n")
    return 1 if clean["refused"] else 0


if __name__ == "__main__":
    sys.exit(main())
