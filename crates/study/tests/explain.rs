//! Scenarios in words.

use crate::tower;
use diagnosis::Rule;
use study::scenarios::{ScenarioCampaign, ScenarioRow};
use study::{CaseExplanation, LineKind};

type Explained = CaseExplanation<ScenarioRow>;

fn explain(campaign: &ScenarioCampaign, number: u64) -> Explained {
    study::explain(campaign, number, &tower::engine(2)).unwrap()
}

const HARD_OVER: u64 = 3;
const ZERO_OUTPUT: u64 = 6;

fn with_thresholds(factor: f64, rule: Rule) -> ScenarioCampaign {
    let mut campaign = tower::campaign(rule);
    for setup in &mut campaign.system.setups {
        setup.thresholds.iter_mut().for_each(|threshold| *threshold *= factor);
    }
    campaign
}

fn texts(explanation: &Explained, kind: LineKind) -> Vec<&str> {
    let lines = explanation.lines.iter().filter(|line| line.kind == kind);
    lines.map(|line| line.text.as_str()).collect()
}

fn has(explanation: &Explained, kind: LineKind, said: &str) -> bool {
    texts(explanation, kind).iter().any(|text| text.contains(said))
}

#[test]
fn every_kind_of_fault_is_reported_in_order_and_as_it_came_out() {
    for rule in [Rule::FirstChange, Rule::Paper] {
        let campaign = tower::campaign(rule);
        for number in 0..7 {
            let story = explain(&campaign, number);
            assert_eq!(story.row, tower::row(&campaign, number));
            assert!(story.lines.is_sorted_by_key(|line| line.step), "{story}");
            assert!(story.lines.iter().all(|line| !line.text.contains('\n')), "{story}");
            let injected = texts(&story, LineKind::Injected);
            assert_eq!(injected.len(), 1);
            assert!(
                injected[0]
                    .starts_with(&format!("{}: ", story.row.injection.as_ref().unwrap().component))
            );
            let faults = texts(&story, LineKind::Fault);
            assert_eq!(faults.len(), story.row.diagnosed.len(), "{story}");
            for (text, diagnosed) in faults.iter().zip(&story.row.diagnosed) {
                assert!(text.starts_with(&format!("{}: ", diagnosed.component)), "{story}");
            }
            let exact = has(&story, LineKind::Outcome, "exact: ")
                && !has(&story, LineKind::Outcome, "not exact: ");
            assert_eq!(exact, story.row.is_exact(), "{story}");
        }
    }
}

#[test]
fn a_verdict_rests_on_a_question_that_is_shown_and_on_the_rule() {
    let first = explain(&tower::campaign(Rule::FirstChange), HARD_OVER);
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
    let paper = explain(&tower::campaign(Rule::Paper), HARD_OVER);
    assert!(has(&paper, LineKind::Fault, "by the paper's rule an actuator"), "{paper}");
    assert_eq!(paper.lines[4].kind, LineKind::Fault, "an actuator needs no peer: {paper}");
}

#[test]
fn what_follows_a_fault_is_explained_once_and_then_summarised() {
    for rule in [Rule::FirstChange, Rule::Paper] {
        let campaign = with_thresholds(0.15, rule);
        let story = explain(&campaign, HARD_OVER + 7);
        assert!(story.row.conversation.explained > 10, "{story}");
        assert!(story.lines.len() < 120, "{} lines", story.lines.len());
        assert!(has(&story, LineKind::More, "further changes from"), "{story}");
        assert!(has(&story, LineKind::More, "named already, changed again"), "{story}");
        let explained = texts(&story, LineKind::Explained);
        let reason = match rule {
            Rule::FirstChange => " earlier",
            Rule::Paper => "by the paper's rule explains",
        };
        assert!(explained.iter().any(|text| text.contains(reason)), "{story}");
    }
}

#[test]
fn the_ratios_of_a_tie_are_reported() {
    let campaign = with_thresholds(0.1, Rule::FirstChange);
    let story = explain(&campaign, HARD_OVER + 28);
    assert!(has(&story, LineKind::Explained, ": a tie, and it rose to "), "{story}");
    assert!(has(&story, LineKind::Fault, "it rose highest, to "), "{story}");
}

#[test]
fn a_missed_fault_is_reported_with_how_near_it_came() {
    for rule in [Rule::FirstChange, Rule::Paper] {
        let campaign = with_thresholds(1e6, rule);
        for number in [HARD_OVER, ZERO_OUTPUT] {
            let story = explain(&campaign, number);
            assert!(has(&story, LineKind::Outcome, "missed: "), "{story}");
            assert!(has(&story, LineKind::Because, "never reached its threshold"), "{story}");
            let zero_output = number == ZERO_OUTPUT;
            assert_eq!(has(&story, LineKind::Injected, "times its noise"), zero_output, "{story}");
        }
    }
}
