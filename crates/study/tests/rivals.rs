//! The comparison with other detectors, on short runs of the tower.

use study::Campaign;
use study::rivals::{DetectorName, RivalCampaign, RivalSummary};
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use vocabulary::fault::FaultKind;

use crate::tower;

fn campaign() -> RivalCampaign {
    let system = tower::system(0.1, 20_261_130);
    let ranges = ScenarioRanges {
        length_s: 7.0,
        nominal_s: 5.0,
        onset_s: [3.5, 4.0],
        ..ScenarioRanges::default().across_the_limit()
    };
    let of = ScenarioCampaign { system: system.clone(), ranges, scenarios: 7, nominal: 4 };
    RivalCampaign::new(of, system, 0.0)
}

#[test]
fn all_detectors_are_judged_alike_whatever_the_number_of_jobs() {
    let campaign = campaign();
    let rows = tower::rows(&campaign, 0..campaign.cases(), 2);
    let again = tower::rows(&campaign, 6..8, 1);
    assert!(again.iter().all(|(case, row)| rows[case] == *row));
    let summary = campaign.summarize(&rows);
    let RivalSummary { faults, rows: judged, calibration_hours, test_hours, .. } = &summary;
    assert_eq!((*faults, judged.len()), (7, DetectorName::ALL.len() + 2));
    assert!(*test_hours > 0.0 && (calibration_hours - test_hours).abs() < 1e-9);
    for row in judged {
        let of_kinds: u64 = row.kinds.values().map(|kind| kind.right).sum();
        assert!((row.right * 7.0 - of_kinds as f64).abs() < 1e-9, "{row:?}");
        // What is right has been found.
        assert!(
            row.kinds.values().all(|kind| kind.right <= kind.found && kind.found <= kind.faults)
        );
        assert!(row.right_95.0 <= row.right && row.right <= row.right_95.1);
        assert_eq!(row.median_delay_ms.is_some(), row.right > 0.0);
        let sized: u64 = row.curves.values().flatten().map(|point| point.faults).sum();
        assert_eq!((row.curves.len(), sized), (3, 5), "three leaks, a bias and a random walk");
    }
    // The divergence with its limit is compared with itself; the two systems are one here.
    assert_eq!((judged[0].p, judged[0].better_and_worse), (None, [0, 0]));
    let own = &judged[judged.len() - 2..];
    assert_eq!((own[0].right, own[0].found), (own[1].right, own[1].found));
    let hard_over = judged[0].kinds[&FaultKind::HardOver];
    assert_eq!((hard_over.faults, hard_over.right), (1, 1));
    // Who always alarms finds everything, knows nothing, and alarms in each of the two runs.
    let always =
        judged.iter().find(|row| row.detector == DetectorName::AlwaysAlarm.title()).unwrap();
    assert_eq!((always.found, always.right), (1.0, 0.0));
    assert!((always.false_alarms_per_hour * test_hours - 2.0).abs() < 1e-9);
    let figures = campaign.figures(&summary).unwrap();
    let svg = roxmltree::Document::parse(&figures[0].svg).unwrap();
    let words: String = svg.descendants().filter_map(|node| node.text()).collect();
    assert!(words.to_lowercase().contains("random walk"), "{words}");
    let (tables, notes) = campaign.tables(&rows, &summary);
    assert_eq!((tables.len(), tables[0].rows.len(), notes.len()), (2, judged.len(), 1));
}
