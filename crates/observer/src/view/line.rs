//! An event on one line: time, place, event, reason.

use std::collections::BTreeMap;

use vocabulary::words::{Tone, identified, phase_in_words, phase_tone, printable};
use vocabulary::{ComponentPath, Identification, ModuleName, PhaseChange, Step, StructureName};

use super::news::{News, ObservedEvent};

/// What is not news but was so before.
pub(super) const FOUND: &str = "when this view connected or before";

/// An event, or an entry of a journal, in words.
#[derive(Debug, Clone, PartialEq)]
pub struct EventLine {
    /// The time of publishing or, for an event without one, of arrival \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The structure.
    pub structure: Option<StructureName>,
    /// The module, if the event is about one.
    pub module: Option<ModuleName>,
    /// The component, if the event is about one.
    pub component: Option<ComponentPath>,
    /// The component, the module or the plant; otherwise the view itself.
    pub who: String,
    /// The event in a word or two.
    pub what: String,
    /// The reason; may be empty.
    pub why: String,
    /// Its colour.
    pub tone: Tone,
    /// The name of its sign.
    pub sign: &'static str,
    /// The step as of which it was found.
    pub step: Option<Step>,
}

impl EventLine {
    /// The line of an event.
    #[must_use]
    pub fn of(event: &ObservedEvent) -> Self {
        let line = match &event.news {
            News::Fault(transition) => return Self::of_transition(transition),
            News::Present(state) => return Self::of_present(state),
            News::Identification(found) => return Self::of_kind(found),
            News::Phase(change) => return Self::of_phase(change),
            News::Presence { structure, who, there, at_start } => {
                let (what, tone) =
                    if *there { ("there", Tone::Calm) } else { ("GONE", Tone::Alarm) };
                let why = if *at_start { FOUND } else { "" };
                let line = Self::new(printable(who), what, tone).because(why);
                match who.parse::<ModuleName>() {
                    Ok(module) if who != vocabulary::keys::PLANT => {
                        line.of_module(structure, &module)
                    }
                    _ => Self { structure: Some(structure.clone()), ..line },
                }
            }
            News::SeveralProcesses { structure, module } => {
                Self::new(module, "SEVERAL", Tone::Doubt)
                    .because("duplicate diagnosers for this module: stop all but one")
                    .of_module(structure, module)
            }
            News::Missed { structure, module, from, to, reason } => {
                let reason = printable(reason);
                Self::new(module, "MISSED", Tone::Alarm)
                    .because(format!("transitions {from} to {to} could not be fetched: {reason}"))
                    .of_module(structure, module)
            }
            News::Unreadable { key, problem } => {
                Self::new("this view", "not understood", Tone::Doubt)
                    .because(printable(&format!("{key}: {problem}")))
            }
            News::Connection { connected: true } => Self::new("this view", "connected", Tone::Calm)
                .because("an entry point answers again"),
            News::Connection { connected: false } => Self::new("this view", "CUT OFF", Tone::Alarm)
                .because("no entry point answers: nothing is known of any module until one does"),
            News::Lost { count } => {
                let why = format!("{count} events dropped: receive queue full");
                Self::new("this view", "LOST", Tone::Alarm).because(why)
            }
        };
        let time_unix_ns =
            if line.time_unix_ns == 0 { event.time_unix_ns } else { line.time_unix_ns };
        Self { time_unix_ns, ..line }
    }

    /// The line of a change of the phase, or of the monitored components.
    #[must_use]
    pub fn of_phase(change: &PhaseChange) -> Self {
        let (what, tone) = if change.not_monitored.is_empty() {
            (phase_in_words(change.phase), phase_tone(change.phase))
        } else {
            ("not monitored", Tone::Doubt)
        };
        Self {
            time_unix_ns: change.time_unix_ns,
            step: change.step,
            ..Self::new(&change.module, what, tone)
                .because(printable(&change.reason))
                .of_module(&change.structure, &change.module)
        }
    }

    /// The line of an identification.
    #[must_use]
    pub fn of_identification(found: &Identification) -> Self {
        let what = if found.decided { "identified" } else { "not identified" };
        Self {
            time_unix_ns: found.time_unix_ns,
            component: Some(found.component.clone()),
            step: Some(found.as_of_step),
            ..Self::new(&found.component, what, Tone::Calm)
                .because(identified(found))
                .of_module(&found.structure, &found.module)
        }
    }

    /// The line of a kind that was identified, by the time when it first was. The step is that of the latest size.
    fn of_kind(found: &Identification) -> Self {
        let line = Self::of_identification(found);
        match found.since_unix_ns {
            Some(time_unix_ns) => Self { time_unix_ns, step: None, ..line },
            None => line,
        }
    }

    fn new(who: impl ToString, what: &str, tone: Tone) -> Self {
        Self {
            time_unix_ns: 0,
            structure: None,
            module: None,
            component: None,
            who: who.to_string(),
            what: what.to_owned(),
            why: String::new(),
            tone,
            sign: sign(tone),
            step: None,
        }
    }

    fn because(self, why: impl Into<String>) -> Self {
        Self { why: why.into(), ..self }
    }

    fn of_module(self, structure: &StructureName, module: &ModuleName) -> Self {
        Self { structure: Some(structure.clone()), module: Some(module.clone()), ..self }
    }
}

/// Events that repeat within this time share one line \[ns\].
const CHATTER_NS: u64 = 600_000_000_000;

/// A line that stands for an event and for those like it shortly before.
#[derive(Debug, Clone, PartialEq)]
pub struct CountedLine {
    /// The latest of them.
    pub line: EventLine,
    /// How many they are.
    pub times: u32,
    /// The time of the first \[ns since 1970\].
    pub first_unix_ns: u64,
}

/// The lines of events, which come latest first. What comes and goes, such as a change that is explained over and over,
/// or a process that restarts, is one line with a count. Faults and orders have each their own.
#[must_use]
pub fn counted<'a>(events: impl IntoIterator<Item = &'a ObservedEvent>) -> Vec<CountedLine> {
    let mut lines: Vec<CountedLine> = Vec::new();
    let mut latest: BTreeMap<(Option<StructureName>, String, String), usize> = BTreeMap::new();
    for event in events {
        let line = EventLine::of(event);
        let first_unix_ns = line.time_unix_ns;
        let chatters = match &event.news {
            News::Fault(transition) => !transition.state().is_fault() && transition.order.is_none(),
            News::Phase(_) | News::Presence { .. } | News::Connection { .. } => true,
            _ => false,
        };
        if chatters {
            let key = (line.structure.clone(), line.who.clone(), line.what.clone());
            if let Some(known) = latest.get(&key).and_then(|place| lines.get_mut(*place))
                && known.first_unix_ns.saturating_sub(first_unix_ns) <= CHATTER_NS
            {
                known.times += 1;
                known.first_unix_ns = first_unix_ns.min(known.first_unix_ns);
                continue;
            }
            latest.insert(key, lines.len());
        }
        lines.push(CountedLine { line, times: 1, first_unix_ns });
    }
    lines
}

/// The name of the sign for a module or a remark.
#[must_use]
pub fn sign(tone: Tone) -> &'static str {
    match tone {
        Tone::Alarm => "latched",
        Tone::Doubt => "unknown",
        Tone::Explained => "explained",
        Tone::Calm => "normal",
    }
}
