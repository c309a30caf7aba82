"""Statistics against a recomputation by hand, and against what must hold."""

from __future__ import annotations

import numpy as np
import pytest

from trainer.experiments.statistics import bootstrap_interval, interquartile_mean, paired_difference


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end() -> None:
    assert interquartile_mean(np.array([1.0, 100.0, 2.0, 3.0, 4.0, -50.0, 5.0, 6.0])) == pytest.approx(3.5)
    assert interquartile_mean(np.array([1.0, 2.0, 9.0])) == pytest.approx(4.0)
    rows = np.array([[1.0, 2.0, 3.0, 4.0], [10.0, 0.0, 0.0, 20.0]])
    np.testing.assert_allclose(interquartile_mean(rows), [2.5, 5.0])


def test_a_bootstrap_interval_holds_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    held = 0
    for trial in range(200):
        low, high = bootstrap_interval(rng.normal(3, 1, size=(1, 30)), seed=trial)
        held += bool(low[0] <= 3 <= high[0])
    assert 170 <= held <= 200


def test_an_interval_is_given_for_every_row() -> None:
    values = np.random.default_rng(0).normal(size=(7, 5))
    low, high = bootstrap_interval(values)
    assert low.shape == high.shape == (7,)
    assert (low <= interquartile_mean(values)).all()
    assert (interquartile_mean(values) <= high).all()


def test_one_or_two_runs_have_no_interval() -> None:
    for runs in (1, 2):
        assert np.isnan(bootstrap_interval(np.ones((4, runs)))).all()
    assert not np.isnan(bootstrap_interval(np.ones((4, 3)))).any()


def test_a_paired_difference_is_students() -> None:
    """By hand: differences 1, 2, 3; t(0.975, 2) = 4.3027; standard error 1/√3."""
    found = paired_difference({1: 11.0, 2: 22.0, 3: 33.0, 9: 0.0}, {1: 10.0, 2: 20.0, 3: 30.0})
    assert found.mean == pytest.approx(2.0)
    assert (found.low, found.high) == pytest.approx((2 - 4.3027 / 3**0.5, 2 + 4.3027 / 3**0.5), abs=1e-3)
    assert (found.seeds, found.verdict) == ([1, 2, 3], "undecided")


@pytest.mark.parametrize(("shift", "verdict"), [(5.0, "higher"), (-5.0, "lower"), (0.0, "undecided")])
def test_a_claim_is_shown_only_where_the_interval_excludes_zero(shift: float, verdict: str) -> None:
    noise = {1: 0.3, 2: -0.2, 3: 0.1, 4: -0.3, 5: 0.2}
    found = paired_difference({seed: 10 + shift + e for seed, e in noise.items()}, dict.fromkeys(noise, 10.0))
    assert found.verdict == verdict


def test_one_seed_says_nothing() -> None:
    with pytest.raises(ValueError, match="needs two seeds that both methods have, not 1"):
        paired_difference({1: 1.0, 2: 2.0}, {1: 1.0})
