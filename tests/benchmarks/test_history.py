"""The benchmark of the history on a small one: every question is answered, in at most 500 points a parameter."""

from tests.benchmarks.bench_history import run


def test_every_question_is_answered(tmp_path):
    report = run(tmp_path / "history.db", axes=2, answers=3000, parameters=2, padding=0)
    assert report["rows"] == 12_000
    points = {name: one["points"] for name, one in report["queries"].items()}
    for name, count in points.items():
        if "500 points" in name:
            assert 250 <= count / (2 if "all parameters" in name else 1) <= 500, name
    assert points["latest of all axes (tribowatch axes)"] == 2
