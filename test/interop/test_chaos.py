"""That the oracle of chaos.py, which `./dev soak` runs, sees what must not be."""
import chaos


def test_the_oracle_sees_what_must_not_be(tmp_path):
    findings = chaos.Findings()
    findings.answer("caller", 1, 2)
    assert findings.broken == ["caller: call 1 was given the answer 2"]
    journal = tmp_path / "journal"
    journal.write_text("1\n2\n2\n3\n")
    assert chaos.faults_of_calls(chaos.ran(journal), {1, 4}) == ["ran twice: [2]", "were answered and never ran: [4]"]
