"""A short part of what `./dev soak` does for as long as one likes: the same faults, by fixed seeds."""
import random

import chaos
import pytest


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_lost_or_doubled_while_everything_breaks(tmp_path, seed):
    site = chaos.Site(tmp_path)
    try:
        chaos.play(site, random.Random(seed), 20)
    finally:
        site.close()
    assert site.findings.broken == []
    assert {"calls", "packets", "packets of the reference", "events", "values", "locks"} <= set(site.findings.counts)


def test_the_oracle_sees_what_must_not_be(tmp_path):
    findings = chaos.Findings()
    findings.answer("caller", 1, 2)
    assert findings.broken == ["caller: call 1 was given the answer 2"]
    journal = tmp_path / "journal"
    journal.write_text("1\n2\n2\n3\n")
    assert chaos.faults_of_calls(chaos.ran(journal), {1, 4}) == ["ran twice: [2]", "were answered and never ran: [4]"]
