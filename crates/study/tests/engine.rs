//! The engine: shards, resuming, and journals, whatever the campaign.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::tower;
use serde_json::json;
use study::conditions::{ConditionCampaign, HiddenFaults, Situation};
use study::identification::{IdentificationCampaign, IdentificationCases};
use study::journal::{self, CampaignHeader, CampaignJournal};
use study::limits::{LimitCampaign, LimitDetector, LimitQuestion, SizedKind};
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use study::{Campaign, Done, Engine, Shard};

fn scenarios() -> ScenarioCampaign {
    let ranges = ScenarioRanges {
        length_s: 4.0,
        nominal_s: 3.0,
        onset_s: [3.0, 3.2],
        ..ScenarioRanges::default()
    };
    ScenarioCampaign { scenarios: 5, nominal: 2, ..tower::scenarios(tower::system(0.1, 5), ranges) }
}

fn histories() -> ConditionCampaign {
    ConditionCampaign {
        system: tower::system(0.0, 6),
        situations: vec![Situation::Repaired],
        hidden: HiddenFaults::default(),
        plants: 1,
        cases: 4,
        alone: false,
    }
}

fn limits() -> LimitCampaign {
    let question = |size| LimitQuestion {
        system: 0,
        detector: LimitDetector::Isolation,
        kind: SizedKind::BiasInNoise,
        size,
    };
    let questions = [1.0, 20.0].map(question).to_vec();
    LimitCampaign { questions, ..LimitCampaign::new(vec![tower::system(0.0, 7)], 1, 3, true) }
}

fn identifications() -> IdentificationCampaign {
    IdentificationCampaign {
        system: tower::system(0.1, 8),
        of: IdentificationCases::default(),
        without: None,
        plants: 1,
        cases: 3,
    }
}

fn header(campaign: &impl Campaign, shard: Option<Shard>) -> CampaignHeader {
    CampaignHeader::new(json!({"seed": 5}), campaign, shard.map(|shard| shard.to_string()))
}

/// Runs what is missing of these cases with a journal, and stops after so many. A shard has one job, other runs have two.
fn run<C: Campaign>(campaign: &C, directory: &Path, shard: Option<Shard>, stop_after: u64) -> u64 {
    let (mut journal, mut done) =
        CampaignJournal::open::<C::Row>(directory, &header(campaign, shard)).unwrap();
    let (before, all) = (done.rows.len() as u64, campaign.cases());
    let cases = shard.map_or(0..all, |shard| shard.cases(all));
    let stop_at = cases.start.saturating_add(before).saturating_add(stop_after);
    let cases = cases.start..cases.end.min(stop_at);
    let jobs = if shard.is_some() { 1 } else { 2 };
    tower::engine(jobs).run(campaign, cases, &mut done, Some(&mut journal)).unwrap();
    done.rows.len() as u64 - before
}

/// The whole journal in these directories, and what the campaign comes to.
fn outcome<C: Campaign>(campaign: &C, directories: &[PathBuf]) -> (String, String) {
    let header = header(campaign, None);
    let done: Done<C::Row> = journal::read_all(directories, &header).unwrap();
    let summary = serde_json::to_string(&campaign.summarize(&done.rows)).unwrap();
    (journal::text(&header, &done).unwrap(), summary)
}

/// One run, three shards, and a run that was killed in the middle of a line are the same byte for byte.
fn is_the_same_however_it_is_run<C: Campaign>(campaign: &C) {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    assert_eq!(run(campaign, &at("one"), None, u64::MAX), campaign.cases());
    let one = outcome(campaign, &[at("one")]);
    let shards = (0..3).map(|number| {
        let place = at(&number.to_string());
        run(campaign, &place, Some(Shard { number, of: 3 }), u64::MAX);
        place
    });
    assert_eq!(outcome(campaign, &shards.collect::<Vec<_>>()), one);
    assert_eq!(run(campaign, &at("killed"), None, 2), 2);
    let file = at("killed").join(journal::FILE);
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, &text[..text.len() - 9]).unwrap();
    assert_eq!(run(campaign, &at("killed"), None, u64::MAX), campaign.cases() - 1);
    assert_eq!(outcome(campaign, &[at("killed")]), one);
}

#[test]
fn scenarios_are_the_same_in_one_run_in_shards_and_after_a_kill() {
    is_the_same_however_it_is_run(&scenarios());
}

#[test]
fn histories_are_the_same_in_one_run_in_shards_and_after_a_kill() {
    is_the_same_however_it_is_run(&histories());
}

#[test]
fn limits_are_the_same_in_one_run_in_shards_and_after_a_kill() {
    is_the_same_however_it_is_run(&limits());
}

/// Its plants are commissioned first, which two jobs share.
#[test]
fn identifications_are_the_same_with_one_job_and_with_two() {
    let campaign = identifications();
    let rows = |jobs| serde_json::to_string(&tower::rows(&campaign, 0..3, jobs)).unwrap();
    assert_eq!(rows(1), rows(2));
}

#[test]
fn a_journal_of_another_request_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let mine = scenarios();
    run(&mine, directory.path(), None, 0);
    let refused = |header: &CampaignHeader| {
        CampaignJournal::open::<<ScenarioCampaign as Campaign>::Row>(directory.path(), header)
            .unwrap_err()
            .to_string()
    };
    let other = refused(&CampaignHeader::new(json!({"seed": 6}), &mine, None));
    assert!(other.ends_with("cases.jsonl` holds another request: seed 5, not 6"), "{other}");
    let shard = refused(&header(&mine, Some(Shard { number: 1, of: 2 })));
    assert!(shard.ends_with("holds another request: shard none, not 1/2"), "{shard}");
    let mut changed = scenarios();
    changed.system.setups[0].thresholds[0] *= 1.1;
    let changed = refused(&header(&changed, None));
    assert!(changed.contains("another plant, other diagnosers or thresholds"), "{changed}");
}

#[test]
fn nothing_new_is_begun_once_stopped() {
    let (campaign, stop) = (limits(), AtomicBool::new(false));
    let stopping = |_, _| -> Box<dyn Fn() + Sync> {
        stop.store(true, Ordering::Relaxed);
        Box::new(|| ())
    };
    let mut done = Done::default();
    let engine = Engine { jobs: 1, stop: &stop, begin: &stopping };
    engine.run(&campaign, 0..campaign.cases(), &mut done, None).unwrap();
    assert!(done.rows.is_empty());
}
