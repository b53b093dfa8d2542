//! Scenarios in words.

#![allow(clippy::unwrap_used, clippy::panic, reason = "test code")]

use diagnosis::Rule;
use study::{Campaign, Explanation, LineKind, explain};

mod tower;

const HARD_OVER: u64 = 3;
const ZERO_OUTPUT: u64 = 6;

fn with_thresholds(factor: f64, rule: Rule) -> Campaign {
    let mut campaign = tower::campaign(rule);
    for setup in &mut campaign.setups {
        setup.thresholds.iter_mut().for_each(|threshold| *threshold *= factor);
    }
    campaign
}

fn texts(explanation: &Explanation, kind: LineKind) -> Vec<&str> {
    let lines = explanation.lines.iter().filter(|line| line.kind == kind);
    lines.map(|line| line.text.as_str()).collect()
}

fn has(explanation: &Explanation, kind: LineKind, said: &str) -> bool {
    texts(explanation, kind).iter().any(|text| text.contains(said))
}

#[test]
fn every_kind_of_fault_is_told_in_order_and_as_it_came_out() {
    for rule in [Rule::FirstChange, Rule::Paper] {
        let campaign = tower::campaign(rule);
        for number in 0..7 {
            let told = explain(&campaign, number).unwrap();
            assert_eq!(told.record, campaign.run_scenario(number).unwrap());
            assert!(told.lines.is_sorted_by_key(|line| line.step), "{told}");
            assert!(told.lines.iter().all(|line| !line.text.contains('\n')), "{told}");
            let injected = texts(&told, LineKind::Injected);
            assert_eq!(injected.len(), 1);
            assert!(injected[0].starts_with(&format!("{}: ", told.record.component)));
            let faults = texts(&told, LineKind::Fault);
            assert_eq!(faults.len(), told.record.diagnosed.len(), "{told}");
            for (text, diagnosed) in faults.iter().zip(&told.record.diagnosed) {
                assert!(text.starts_with(&format!("{}: ", diagnosed.component)), "{told}");
            }
            let exact = has(&told, LineKind::Outcome, "exact: ")
                && !has(&told, LineKind::Outcome, "not exact: ");
            assert_eq!(exact, told.record.is_exact(), "{told}");
        }
    }
}

#[test]
fn a_verdict_rests_on_a_question_that_is_told_and_on_the_rule() {
    let first = explain(&tower::campaign(Rule::FirstChange), HARD_OVER).unwrap();
    let order: Vec<LineKind> = first.lines.iter().map(|line| line.kind).collect();
    let expected = [
        LineKind::Setting,
        LineKind::Watching,
        LineKind::Injected,
        LineKind::Change,
        LineKind::Asked,
        LineKind::Answered,
        LineKind::Fault,
    ];
    assert_eq!(order[..expected.len()], expected, "{first}");
    assert!(has(&first, LineKind::Fault, "this first change names the fault"), "{first}");
    let paper = explain(&tower::campaign(Rule::Paper), HARD_OVER).unwrap();
    assert!(has(&paper, LineKind::Fault, "by the paper's rule an actuator"), "{paper}");
    assert_eq!(paper.lines[4].kind, LineKind::Fault, "an actuator needs no peer: {paper}");
}

#[test]
fn what_follows_a_fault_is_explained_once_and_then_summarised() {
    for rule in [Rule::FirstChange, Rule::Paper] {
        let campaign = with_thresholds(0.1, rule);
        let told = explain(&campaign, HARD_OVER + 7).unwrap();
        assert!(told.record.conversation.explained > 10, "{told}");
        assert!(told.lines.len() < 120, "{} lines", told.lines.len());
        assert!(has(&told, LineKind::More, "further changes from"), "{told}");
        assert!(has(&told, LineKind::More, "named already, changed again"), "{told}");
        let explained = texts(&told, LineKind::Explained);
        let reason = match rule {
            Rule::FirstChange => " earlier",
            Rule::Paper => "by the paper's rule explains",
        };
        assert!(explained.iter().any(|text| text.contains(reason)), "{told}");
    }
}

#[test]
fn of_a_tie_the_ratios_are_told() {
    let campaign = with_thresholds(0.02, Rule::FirstChange);
    let told = explain(&campaign, HARD_OVER).unwrap();
    assert!(has(&told, LineKind::Explained, ": a tie, and it rose to "), "{told}");
    assert!(has(&told, LineKind::Fault, "it rose highest, to "), "{told}");
}

#[test]
fn a_fault_that_was_not_seen_is_told_with_how_near_it_came() {
    for rule in [Rule::FirstChange, Rule::Paper] {
        let campaign = with_thresholds(1e6, rule);
        for number in [HARD_OVER, ZERO_OUTPUT] {
            let told = explain(&campaign, number).unwrap();
            assert!(has(&told, LineKind::Outcome, "missed: "), "{told}");
            assert!(has(&told, LineKind::Because, "never reached its threshold"), "{told}");
            let zero_output = number == ZERO_OUTPUT;
            assert_eq!(has(&told, LineKind::Injected, "times its noise"), zero_output, "{told}");
        }
    }
}
