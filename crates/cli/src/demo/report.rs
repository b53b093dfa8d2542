//! The events reported by the demo: a line each for people, or a JSON object each for programs.

use std::collections::BTreeSet;
use std::io::{self, Write};

use observer::{EventLine, explained_by};
use serde::Serialize;
use serde_json::json;
use vocabulary::{
    Candidate, ComponentPath, FaultState, FaultTransition, Identification, ModuleName, Step,
    fault::Fault,
};

use super::story::Act;
use crate::output;
use crate::paint::{Colour, Paint, tone_colour};
use crate::table::{table, terminal_width};
use vocabulary::words::{NOTHING, brief, or_nothing, printable};

/// A process of the demo.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct ChildProcess {
    pub(super) name: String,
    pub(super) pid: u32,
}

/// An event to report.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub(super) enum DemoEvent {
    /// The processes were started.
    Started { structure: String, processes: Vec<ChildProcess>, endpoint: String },
    /// A process appeared.
    Ready { process: String },
    /// Some channels are not monitored yet.
    WarmingUp { step: Step, of_step: Step },
    /// Every channel of a module is monitored.
    InService { module: ModuleName, since_step: Step },
    /// Every module has compared its components with their references; this many agree.
    Compared { step: Step, agree: u64, of: u64 },
    /// A fault was injected into a component.
    Injected { step: Step, component: ComponentPath, fault: Fault, story: &'static str },
    /// A component was repaired.
    Repaired { step: Step, component: ComponentPath },
    /// A module published a verdict on a component.
    Verdict {
        step: Step,
        #[serde(flatten)]
        transition: Box<FaultTransition>,
    },
    /// A module identified the kind of a component's fault.
    Identified {
        step: Step,
        #[serde(flatten)]
        identification: Box<Identification>,
    },
    /// An unexpected event.
    Trouble { text: String },
    /// The result.
    Summary(DemoSummary),
}

/// A comparison of injected with diagnosed faults.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DemoSummary {
    pub(super) injected: Vec<Act>,
    pub(super) diagnosed: Vec<DiagnosedFault>,
    /// Every injected fault was named in time, and no other component was.
    pub(super) exact: bool,
    /// The process ids of the plant and the diagnosers.
    pub(super) pids: Vec<u32>,
}

/// A fault that was diagnosed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DiagnosedFault {
    pub(super) component: ComponentPath,
    pub(super) onset_step: Option<Step>,
    pub(super) detection_step: Option<Step>,
    pub(super) decided_step: Option<Step>,
    /// From the injection to the detection; `null` without an earlier injection \[ms\].
    pub(super) delay_ms: Option<f64>,
    /// From the injection to the verdict \[ms\].
    pub(super) verdict_delay_ms: Option<f64>,
    /// Its kind and size, if decided before the repair.
    pub(super) identified: Option<Candidate>,
}

/// Prints events on standard output.
pub(super) struct Printer {
    json: bool,
    paint: Paint,
    step_s: f64,
    /// Changes and explanations of the present story that were already printed for people.
    read: BTreeSet<String>,
}

impl Printer {
    pub(super) fn new(json: bool, step_s: f64) -> Printer {
        let paint = Paint::of_stdout();
        Printer { json, paint, step_s, read: BTreeSet::new() }
    }

    /// Prints an event immediately.
    pub(super) fn print(&mut self, event: &DemoEvent) -> io::Result<()> {
        let mut out = output::stdout();
        let time_s = step(event).map(|step| step.0 as f64 * self.step_s);
        if self.json {
            let time = time_s.map_or(json!({}), |time_s| json!({ "time_s": time_s }));
            write!(out, "{}", output::line(&output::with(event, time))?)?;
        } else if matches!(event, DemoEvent::Started { .. } | DemoEvent::Summary(_)) {
            writeln!(out, "{}", self.text(event))?;
        } else if self.is_new(event) {
            let time = time_s.map_or_else(String::new, |time_s| format!("{time_s:.3} s"));
            for line in self.text(event).lines() {
                let time = if line.is_empty() { "" } else { &time };
                writeln!(out, "{}", format!("{time:>10}  {line}").trim_end())?;
            }
        }
        out.flush()
    }

    /// False for a change or an explanation that was already printed in this story: while a disturbance decays,
    /// channels repeatedly exceed their thresholds.
    fn is_new(&mut self, event: &DemoEvent) -> bool {
        match event {
            DemoEvent::Verdict { transition, .. }
                if matches!(transition.state(), FaultState::Tentative | FaultState::Explained) =>
            {
                let (component, root) = (&transition.component, explained_by(transition));
                self.read.insert(format!("{component} {}", or_nothing(root)))
            }
            DemoEvent::Injected { .. } => {
                self.read.clear();
                true
            }
            _ => true,
        }
    }

    fn text(&self, event: &DemoEvent) -> String {
        let paint = &self.paint;
        match event {
            DemoEvent::Started { structure, processes, endpoint } => {
                started(structure, processes, endpoint)
            }
            DemoEvent::Ready { process } => format!("ready        {process}"),
            DemoEvent::WarmingUp { step, of_step } => {
                format!("warming up   step {step} of {of_step}")
            }
            DemoEvent::InService { module, .. } => format!("in service   {module}"),
            DemoEvent::Compared { agree, of, .. } => {
                format!("compared     {agree} of {of} components agree with their references")
            }
            DemoEvent::Injected { component, fault, story, .. } => {
                let what = format!("INJECT       {component}: {fault}");
                format!("\n{}\n{story}", paint.bold(&what))
            }
            DemoEvent::Repaired { component, .. } => format!("repair       {component}"),
            DemoEvent::Verdict { transition, .. } => {
                self.line(&EventLine::of_transition(transition))
            }
            DemoEvent::Identified { identification, .. } => {
                self.line(&EventLine::of_identification(identification))
            }
            DemoEvent::Trouble { text } => {
                paint.in_colour(Colour::Yellow, &format!("trouble      {}", printable(text)))
            }
            DemoEvent::Summary(summary) => self.summary(summary),
        }
    }

    fn line(&self, line: &EventLine) -> String {
        let EventLine { who, what, why, tone, .. } = line;
        let text = format!("{what:<12} {who:<20} {why}");
        let colour = tone_colour(*tone);
        colour.map_or_else(|| text.clone(), |colour| self.paint.in_colour(colour, &text))
    }

    fn summary(&self, summary: &DemoSummary) -> String {
        let heading =
            ["fault", "component", "injected", "diagnosed", "identified", "delay", "verdict after"];
        let mut table = table(&heading);
        let ms = |ms: Option<f64>| or_nothing(ms.map(|ms| format!("{ms:.0} ms")));
        for injected in &summary.injected {
            let named = summary.diagnosed.iter().find(|d| d.component == injected.component);
            table.add_row([
                injected.fault.kind().to_string(),
                injected.component.to_string(),
                format!("step {}", injected.injected),
                named.map_or_else(|| "NOT NAMED".to_owned(), |named| named.component.to_string()),
                named.map_or_else(|| NOTHING.to_owned(), identified),
                ms(named.and_then(|named| named.delay_ms)),
                ms(named.and_then(|named| named.verdict_delay_ms)),
            ]);
        }
        let is_injected = |named: &DiagnosedFault| {
            summary.injected.iter().any(|i| i.component == named.component)
        };
        for named in summary.diagnosed.iter().filter(|named| !is_injected(named)) {
            let at = or_nothing(named.detection_step.map(|step| format!("step {step}")));
            let none = || NOTHING.to_owned();
            let name = named.component.to_string();
            table.add_row([none(), none(), none(), name, identified(named), at, none()]);
        }
        table.align_right(5..7);
        table.stack(&[&[0, 4], &[1, 3], &[2], &[5, 6]]);
        let (colour, verdict) = if summary.exact {
            (Colour::Green, "exact: every injected fault was named, and nothing else")
        } else {
            (Colour::Red, "not exact: injected and diagnosed faults differ")
        };
        let verdict = self.paint.in_colour(colour, verdict);
        format!("\n{}\n\n{verdict}", table.text(terminal_width()))
    }
}

/// The step of the event.
fn step(event: &DemoEvent) -> Option<Step> {
    match event {
        DemoEvent::WarmingUp { step, .. }
        | DemoEvent::InService { since_step: step, .. }
        | DemoEvent::Compared { step, .. }
        | DemoEvent::Injected { step, .. }
        | DemoEvent::Repaired { step, .. }
        | DemoEvent::Verdict { step, .. }
        | DemoEvent::Identified { step, .. } => Some(*step),
        DemoEvent::Started { .. }
        | DemoEvent::Ready { .. }
        | DemoEvent::Trouble { .. }
        | DemoEvent::Summary(_) => None,
    }
}

/// The identified kind, with its size but without the interval.
fn identified(named: &DiagnosedFault) -> String {
    named.identified.as_ref().map_or_else(|| "not decided".to_owned(), brief)
}

fn started(structure: &str, processes: &[ChildProcess], endpoint: &str) -> String {
    let processes: Vec<_> =
        processes.iter().map(|process| format!("{} ({})", process.name, process.pid)).collect();
    // The command that shows the faults in another terminal.
    format!(
        "{structure}: {}\nwatch it:\n  \
         zenoh --mode client --connect {endpoint} --cfg scouting/multicast/enabled:false \
         subscribe -k 'trusswatch/*/*/fault/**' --decoder json --line '{{key}} {{value}}'\n",
        processes.join(", ")
    )
}
