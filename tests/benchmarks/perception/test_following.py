from __future__ import annotations

import numpy as np

from benchmarks.perception.following.doubt import StatedDoubt, fitted, reliability


def test_chains_are_grouped_by_their_stated_doubt() -> None:
    doubts = [StatedDoubt(p, wrong, (0.0, 0.0)) for p, wrong in ((0.001, False), (0.002, True))]
    doubts += [StatedDoubt(1.0, True, (0.0, 0.0))]
    low, high = reliability(doubts)
    assert (low["chains"], low["wrong, %"], low["mean stated, %"]) == (2, 50.0, 0.15)
    assert (high["stated, %"], high["chains"], high["wrong, %"]) == ("30 to 100", 1, 100.0)


def test_the_fit_recovers_the_odds_of_wrong_chains() -> None:
    random = np.random.default_rng(0)
    features = random.normal(size=(20_000, 2))
    wrong = random.random(20_000) < 1.0 / (1.0 + np.exp(0.4 - features @ [1.1, 0.6]))
    doubts = [StatedDoubt(0.0, bool(w), tuple(f)) for w, f in zip(wrong, features, strict=True)]
    np.testing.assert_allclose(fitted(doubts), [-0.4, 1.1, 0.6], atol=0.06)
