//! What would have been named with other settings, beside what was.

use std::collections::BTreeMap;
use std::fmt::Write;

use ::replay::{
    Beginnings, ModuleRecord, ProcessCourse, ReplayPart, ReplaySettings, ReplayedTransition,
    courses, latest_setup, together,
};
use diagnosis::ModuleSetup;
use diagnosis::messages::Speaker;
use serde::Serialize;
use vocabulary::{Component, ComponentPath, FaultState, FaultTransition, ModuleName};

use super::reading::RecordingContents;
use crate::failure::Failure;
use crate::output;
use crate::table::table;
use vocabulary::words::{NOTHING, reason};

/// What became of a component.
#[derive(Debug, Clone, Serialize)]
struct ComponentFate {
    state: FaultState,
    onset_step: Option<u64>,
    detection_step: Option<u64>,
    decided_step: Option<u64>,
    why: String,
}

/// A component, then and now; nothing if it never had a verdict.
#[derive(Debug, Serialize)]
struct ReplayedComponent {
    component: ComponentPath,
    was: Option<ComponentFate>,
    would_be: Option<ComponentFate>,
    #[serde(skip)]
    step_s: f64,
}

/// Both side by side.
#[derive(Debug, Serialize)]
pub(super) struct SideBySide {
    components: Vec<ReplayedComponent>,
    /// Not all that the modules took is recorded: what is not named may have begun before.
    is_part: bool,
    notes: Vec<String>,
}

/// Runs all modules together.
pub(super) fn run(
    reading: &mut RecordingContents,
    settings: &ReplaySettings,
) -> Result<SideBySide, Failure> {
    for record in &mut reading.records {
        if let Some(setup) = settings.setups.get(&record.module) {
            select_readings(record, setup)?;
        }
    }
    let records = &reading.records;
    let is_unknown = |module: &&ModuleName| !records.iter().any(|r| r.module == **module);
    if let Some(module) = settings.setups.keys().find(is_unknown) {
        let problem = format!("`--config` has `{module}`, of which the recording has nothing");
        return Err(Failure::usage(problem));
    }
    let runs = Beginnings::of(records);
    let (mut notes, mut is_part) = (Vec::new(), false);
    let (mut modules, mut parts) = (Vec::new(), Vec::new());
    for record in records {
        let (known, is_whole) = courses_of(record, &mut notes);
        is_part |= !is_whole;
        let recorded = latest_setup(record);
        let own = settings.setups.get(&record.module).cloned();
        let recorded = own.map_or(recorded, Ok);
        let setup = recorded.map_err(|why| {
            Failure::input(format!("{}: {why}; give it with `--config`", record.module))
        })?;
        modules.push((record, setup.step_s));
        parts.push(ReplayPart::new(record, &known, settings.applied_to(setup), &runs));
    }
    let mut rows = BTreeMap::new();
    let verdicts = together(&parts).map_err(|error| Failure::input(error.to_string()))?;
    for ((record, step_s), verdicts) in modules.into_iter().zip(verdicts) {
        enter(&mut rows, record, step_s, &verdicts);
    }
    let mut components: Vec<_> = rows.into_values().collect();
    if is_part {
        // The peers of a module of which a part is missing would have been answered otherwise.
        components.iter_mut().for_each(ReplayedComponent::doubt);
    }
    Ok(SideBySide { components, is_part, notes })
}

/// Brings recorded readings into the order of a learned module, by their names.
fn select_readings(record: &mut ModuleRecord, setup: &ModuleSetup) -> Result<(), Failure> {
    let recorded = latest_setup(record).ok().filter(ModuleSetup::measures_readings);
    let Some(recorded) = recorded.filter(|_| setup.measures_readings()) else { return Ok(()) };
    let known = recorded.components();
    let place = |own: Component| {
        let found = known.iter().position(|component| *component == own);
        found.ok_or_else(|| {
            let module = &record.module;
            Failure::input(format!("{module}: the recording has no `{own}`"))
        })
    };
    let places: Vec<usize> = setup.components().into_iter().map(place).collect::<Result<_, _>>()?;
    if !places.iter().copied().eq(0..known.len()) {
        record.samples.select(&places);
    }
    Ok(())
}

/// What its processes took, as far as it is known, and whether that is all.
fn courses_of(record: &ModuleRecord, notes: &mut Vec<String>) -> (Vec<ProcessCourse>, bool) {
    let module = &record.module;
    let all = courses(record);
    let processes = all.len();
    let known: Vec<ProcessCourse> = all.into_iter().filter_map(|(_, c)| c.ok()).collect();
    let remembers_faults = known.first().is_some_and(|first| {
        first.memory.latest.iter().any(|transition| transition.verdict.is_latched())
    });
    let is_cut = known.iter().any(|course| course.shortfall.is_some());
    let after = known.first().and_then(|first| first.state.as_ref()?.position);
    let begins_later = known.iter().any(|course| course.state.is_some());
    let is_whole = !known.is_empty()
        && known.len() == processes
        && !(is_cut || remembers_faults || begins_later);
    notes.extend(after.map(|(run, step)| {
        format!("{module}: the recording begins at step {step} of run {run}; other settings may have changed what was before")
    }));
    if remembers_faults && !begins_later {
        notes.push(format!(
            "{module}: it was started with faults that are older than the recording"
        ));
    }
    if known.is_empty() {
        notes.push(format!(
            "{module}: which samples it took is not in the recording: all that are there, in order"
        ));
    }
    let restarts = known.windows(2).filter(|pair| pair[0].process != pair[1].process).count();
    if restarts > 0 {
        notes.push(format!("{module}: it was restarted {restarts} times, which is left out"));
    }
    let cut = known.iter().filter_map(|course| course.shortfall.as_ref());
    notes.extend(cut.map(|why| format!("{module}: {why}")));
    (known, is_whole)
}

fn enter(
    rows: &mut BTreeMap<ComponentPath, ReplayedComponent>,
    record: &ModuleRecord,
    step_s: f64,
    verdicts: &[ReplayedTransition],
) {
    let speaker = Speaker::of(record.structure.clone(), record.module.clone());
    let row = |component: &ComponentPath| ReplayedComponent {
        component: component.clone(),
        was: None,
        would_be: None,
        step_s,
    };
    for message in &record.transitions {
        let row = rows.entry(message.component.clone()).or_insert_with(|| row(&message.component));
        take(&mut row.was, message);
    }
    for verdict in verdicts {
        let message = speaker.transition(verdict.transition.clone(), verdict.time_unix_ns);
        let row = rows.entry(message.component.clone()).or_insert_with(|| row(&message.component));
        take(&mut row.would_be, &message);
    }
}

/// The first time that it was named counts, else its latest state.
fn take(fate: &mut Option<ComponentFate>, message: &FaultTransition) {
    if fate.as_ref().is_some_and(|fate| fate.state == FaultState::Latched) {
        return;
    }
    *fate = Some(ComponentFate {
        state: message.state(),
        onset_step: message.onset_step.map(|step| step.0),
        detection_step: message.detection_step.map(|step| step.0),
        decided_step: message.decided_step.map(|step| step.0),
        why: reason(message),
    });
}

impl ReplayedComponent {
    /// A partial recording proves the faults that it shows, and never that there was none.
    fn doubt(&mut self) {
        if self.would_be.as_ref().is_none_or(|fate| fate.state != FaultState::Latched) {
            self.would_be = Some(ComponentFate {
                state: FaultState::Unknown,
                onset_step: None,
                detection_step: None,
                decided_step: None,
                why: "only a part is recorded".to_owned(),
            });
        }
    }
}

impl SideBySide {
    /// What would have been is known of every component.
    pub(super) fn complete(&self) -> Result<(), Failure> {
        if !self.is_part {
            return Ok(());
        }
        let mut problems =
            vec!["what would have been named is not known of every component".to_owned()];
        problems.extend(self.notes.iter().cloned());
        Err(Failure::not_compared(problems))
    }

    pub(super) fn written(&self, json: bool, width: Option<u16>) -> Result<String, Failure> {
        if json {
            return Ok(output::text(self)?);
        }
        let mut table =
            table(&["component", "was", "detected s", "why", "would be", "detected s", "why"]);
        for row in &self.components {
            let cells =
                [fate(row.was.as_ref(), row.step_s), fate(row.would_be.as_ref(), row.step_s)];
            table.add_row(
                [row.component.to_string()].into_iter().chain(cells.into_iter().flatten()),
            );
        }
        table.align_right([2, 5]);
        table.stack(&[&[0], &[1, 2], &[3], &[4, 5], &[6]]);
        let mut text = String::new();
        // Writing to a string does not fail.
        if self.components.is_empty() && self.is_part {
            text.push_str(
                "nothing was named; what would have been is unknown: only a part is recorded\n",
            );
        } else if self.components.is_empty() {
            text.push_str("nothing was named, nor would anything have been\n");
        } else {
            let _ = writeln!(text, "{}", table.text(width));
        }
        for note in &self.notes {
            let _ = writeln!(text, "note: {note}");
        }
        Ok(text)
    }
}

fn fate(fate: Option<&ComponentFate>, step_s: f64) -> [String; 3] {
    let nothing = || NOTHING.to_owned();
    let Some(fate) = fate else { return [nothing(), nothing(), nothing()] };
    let detected = fate.detection_step.map(|step| format!("{:.3}", step as f64 * step_s));
    let why = if fate.why.is_empty() { nothing() } else { fate.why.clone() };
    [fate.state.to_string(), detected.unwrap_or_else(nothing), why]
}
