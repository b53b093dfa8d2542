//! Every target with its name.

mod configuration;
mod journal;
mod key;
mod message;
mod module;
mod question;
mod state;
mod structure;

/// A promise about any bytes.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// The name: of its corpus, and on the fuzzer's command line.
    pub name: &'static str,
    /// Panics unless the promise holds.
    pub check: fn(&[u8]),
}

impl Target {
    /// The target of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Target> {
        TARGETS.iter().copied().find(|target| target.name == name)
    }
}

const fn target(name: &'static str, check: fn(&[u8])) -> Target {
    Target { name, check }
}

/// All of them.
pub const TARGETS: &[Target] = &[
    target("message_change", message::check::<vocabulary::ChangeReport>),
    target("message_configuration", message::check::<vocabulary::ModuleConfiguration>),
    target("message_capability", message::check::<vocabulary::Capability>),
    target("message_corrected", message::check::<vocabulary::Corrected>),
    target("message_divergences", message::check::<vocabulary::Divergences>),
    target("message_fault_transition", message::check::<vocabulary::FaultTransition>),
    target("message_freeze_frame", message::check::<vocabulary::FreezeFrame>),
    target("message_history_page", message::check::<vocabulary::HistoryPage>),
    target("message_identification", message::check::<vocabulary::Identification>),
    target("message_injected", message::check::<vocabulary::Injected>),
    target("message_injection", message::check::<vocabulary::Injection>),
    target("message_input", message::check::<vocabulary::Input>),
    target("message_module_status", message::check::<vocabulary::ModuleStatus>),
    target("message_obeyed", message::check::<vocabulary::Obeyed>),
    target("message_order", message::check::<vocabulary::Order>),
    target("message_phase_change", message::check::<vocabulary::PhaseChange>),
    target("message_plant_status", message::check::<vocabulary::PlantStatus>),
    target("message_progress", message::check::<vocabulary::Progress>),
    target("message_refused", message::check::<vocabulary::Refused>),
    target("message_sample", message::check::<vocabulary::Sample>),
    target("message_sample_cbor", message::check_cbor),
    target("message_state_answer", message::check::<vocabulary::StateAnswer>),
    target("message_stroke", message::check::<vocabulary::Stroke>),
    target("message_stroke_begun", message::check::<vocabulary::StrokeBegun>),
    target("key", key::check),
    target("question", question::check),
    target("journal", journal::check),
    target("state", state::check),
    target("structure", structure::check),
    target("diagnoser_configuration", configuration::check_diagnoser),
    target("thresholds", configuration::check_thresholds),
    target("plant_configuration", configuration::check_plant),
    target("schedule", configuration::check_schedule),
];
