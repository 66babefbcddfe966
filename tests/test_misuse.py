"""Arguments of the wrong kind: ``tests/long_misuse.py`` makes many more such calls."""

import long_misuse


def test_whatever_comes_is_answered_or_refused_in_one_sentence():
    done = long_misuse.attack(1500, seed=2)
    assert done["something else"] == 0
    assert min(done["answered"], done["refused"]) > 100
