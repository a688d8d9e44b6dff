"""A short part of what `./dev soak` does for as long as one likes: the same faults, by fixed seeds."""
import itertools
import random
import time
import types

import chaos
import pytest


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_lost_or_doubled_while_everything_breaks(tmp_path, seed):
    site = chaos.Site(tmp_path)
    try:
        chaos.play(site, random.Random(seed), 60)
    finally:
        site.close()
    assert site.findings.broken == []
    assert {"calls", "answers inside", "packets", "packets of the reference", "events", "values", "locks"} <= set(site.findings.counts)


def test_each_soak_has_seeds_that_it_had_before_and_new_ones():
    assert list(itertools.islice(chaos.seeds_of_rounds(7), 3)) == [7, 8, 9]
    runs = [list(itertools.islice(chaos.seeds_of_rounds(), 6)) for _ in range(2)]
    assert [run[::2] for run in runs] == [[1, 2, 3], [1, 2, 3]]
    assert len({seed for run in runs for seed in run[1::2]}) == 6


def test_the_oracle_sees_what_must_not_be(tmp_path):
    findings = chaos.Findings()
    findings.answer("caller", 1, 2)
    assert findings.broken == ["caller: call 1 was given the answer 2"]
    journal = tmp_path / "journal"
    journal.write_text("1\n2\n2\n3\n")
    assert chaos.faults_of_calls(chaos.ran(journal), {1, 4}) == ["ran twice: [2]", "were answered and never ran: [4]"]


def test_the_oracle_sees_who_is_inside_and_waits():
    site = types.SimpleNamespace(was_away_since=lambda moment: False, is_recovering=False)
    insider = chaos.Insider.__new__(chaos.Insider)
    insider.name, insider.site, insider.findings, insider.times = "insider", site, chaos.Findings(), []
    now = time.monotonic()
    insider.judge(now, 200, b"")
    site.was_away_since = lambda moment: True
    insider.judge(now, 503, b"")
    site.was_away_since = lambda moment: False
    site.is_recovering = True
    insider.judge(now, 503, b"its device is not there yet")
    assert insider.findings.broken == [] and insider.findings.counts == {"answers inside": 1}
    insider.judge(now, 200, b"")
    insider.judge(now, 503, b"no")
    insider.judge(now - 3, 200, b"")
    assert [words.split(" for")[0] for words in insider.findings.broken] == \
        ["insider: was answered with 503: b'no'", "insider: waited 3.00 s"]
