//! Something that may happen to a diagnoser.

use diagnosis::{GivenOrderKind, Span};
use proptest::prelude::*;

/// What a peer answers; steps are shares of the stretch that it was asked about.
#[derive(Debug, Clone)]
pub struct Said {
    /// Which peer.
    pub peer: usize,
    /// As it comes, or put right so that it fits the question.
    pub fits: bool,
    pub watching_since: Option<u64>,
    pub changes: Vec<(f64, f64)>,
    pub actuator_faults: Vec<f64>,
}

/// Something that may happen.
#[derive(Debug, Clone)]
pub enum Happening {
    Samples(u8),
    Fault {
        gage: usize,
        offset_m: f64,
    },
    Pressure {
        actuator: usize,
        offset_pa: f64,
    },
    Gap(u16),
    Repeat,
    NotANumber,
    NewRun,
    Asked {
        from: u64,
        ahead: i64,
        run: u64,
    },
    Withdrawn {
        back: u64,
    },
    Answered(Said),
    /// An answer to a question that is no longer under way.
    Stale(Said),
    Unanswered {
        peer: usize,
    },
    Returned {
        peer: usize,
    },
    Ordered {
        component: usize,
        kind: GivenOrderKind,
    },
    /// The process restarts; `missed` samples are lost meanwhile, then the latest `again` of them are
    /// replayed.
    Restart {
        missed: u16,
        again: u16,
    },
}

fn said() -> impl Strategy<Value = Said> {
    let watching_since = prop_oneof![
        6 => Just(Some(0)),
        1 => Just(None),
        1 => (0..3000_u64).prop_map(Some),
    ];
    let changes = prop::collection::vec((0.0..1.0_f64, 0.5..1e3_f64), 0..3);
    let faults = prop::collection::vec(0.0..1.2_f64, 0..2);
    (0..2_usize, prop::bool::weighted(0.8), watching_since, changes, faults).prop_map(
        |(peer, fits, watching_since, changes, actuator_faults)| Said {
            peer,
            fits,
            watching_since,
            changes,
            actuator_faults,
        },
    )
}

fn order() -> impl Strategy<Value = GivenOrderKind> {
    prop_oneof![
        3 => Just(GivenOrderKind::Acknowledge),
        3 => Just(GivenOrderKind::Reset { force: false }),
        2 => Just(GivenOrderKind::Reset { force: true }),
        1 => Just(GivenOrderKind::ReTare),
        1 => Just(GivenOrderKind::Declare),
        1 => Just(GivenOrderKind::ShutOff { since_unix_ns: 5 }),
        1 => Just(GivenOrderKind::PutBack),
    ]
}

fn span() -> impl Strategy<Value = Span> {
    let at = 0..1000_u64;
    (at.clone(), at).prop_map(|(since_unix_ns, length)| Span {
        since_unix_ns,
        until_unix_ns: since_unix_ns + length,
    })
}

/// An order that no verdict depends on.
pub fn shelving() -> impl Strategy<Value = Happening> {
    let kind = prop_oneof![
        3 => span().prop_map(GivenOrderKind::Shelve),
        2 => span().prop_map(GivenOrderKind::Suppress),
        1 => Just(GivenOrderKind::Unshelve),
        1 => Just(GivenOrderKind::Unsuppress),
        1 => (0..2000_u64).prop_map(|now_unix_ns| GivenOrderKind::Lapse { now_unix_ns }),
    ];
    (0..6_usize, kind).prop_map(|(component, kind)| Happening::Ordered { component, kind })
}

/// Anything.
pub fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        8 => (1..40_u8).prop_map(Happening::Samples),
        3 => (0..3_usize, -1e-4..1e-4_f64)
            .prop_map(|(gage, offset_m)| Happening::Fault { gage, offset_m }),
        2 => (0..2_usize, -2e6..2e6_f64)
            .prop_map(|(actuator, offset_pa)| Happening::Pressure { actuator, offset_pa }),
        1 => prop_oneof![4 => 1..20_u16, 1 => 9_990..10_010_u16].prop_map(Happening::Gap),
        1 => Just(Happening::Repeat),
        1 => Just(Happening::NotANumber),
        1 => Just(Happening::NewRun),
        3 => (0..2000_u64, -600..100_i64, 1..4_u64)
            .prop_map(|(from, ahead, run)| Happening::Asked { from, ahead, run }),
        1 => (0..4_u64).prop_map(|back| Happening::Withdrawn { back }),
        8 => said().prop_map(Happening::Answered),
        1 => said().prop_map(Happening::Stale),
        2 => (0..2_usize).prop_map(|peer| Happening::Unanswered { peer }),
        1 => (0..3_usize).prop_map(|peer| Happening::Returned { peer }),
        3 => (0..6_usize, order())
            .prop_map(|(component, kind)| Happening::Ordered { component, kind }),
        1 => shelving(),
        2 => (prop_oneof![3 => Just(0), 2 => 1..50_u16], prop_oneof![1 => Just(0), 3 => 1..900_u16])
            .prop_map(|(missed, again)| Happening::Restart { missed, again }),
    ]
}
