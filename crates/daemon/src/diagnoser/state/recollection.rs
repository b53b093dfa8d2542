//! From the records of a journal back to what the diagnoser knew.

use std::collections::BTreeMap;

use diagnosis::{Change, MAX_CHANGES_IN_ANSWER, Memory, PastWatch};
use vocabulary::{Component, FaultTransition, Identification, ModuleName, RunId, Step};

use super::record::Record;
use super::watch_file::Watch;
use crate::diagnoser::identification::PresentFault;
use diagnosis::messages::from_transition;

/// What the journal and the watch file say together.
#[derive(Debug, Default)]
pub(crate) struct Recollection {
    /// The latest transition of each component that had one.
    pub(crate) latest: Vec<FaultTransition>,
    /// The present fault of each component with what was published of it.
    pub(crate) faults: BTreeMap<Component, PresentFault>,
    /// The changes of the latest run that any are known of.
    changes: Vec<(RunId, Change)>,
    sequence: u64,
}

impl Recollection {
    /// Reads records, oldest first; those of other modules are passed over.
    pub(crate) fn of(records: &[String], module: &ModuleName) -> Self {
        let mut recollection = Self::default();
        for record in records.iter().filter_map(|text| Record::from_text(text)) {
            match record {
                Record::Transition(transition) if transition.module == *module => {
                    recollection.sequence = recollection.sequence.max(transition.sequence);
                    recollection.enter(*transition);
                }
                Record::Identification(found) if found.module == *module => {
                    let component = found.component.component.clone();
                    recollection.faults.entry(component).or_default().recall(*found);
                }
                Record::Change { run, change } => {
                    recollection.changes.push((run, change));
                }
                Record::RunEnded => {
                    recollection.changes.clear();
                    recollection.latest.iter_mut().for_each(|latest| latest.run_ended = true);
                }
                Record::Transition(_) | Record::Identification(_) | Record::Start { .. } => {}
            }
        }
        recollection
    }

    fn enter(&mut self, transition: FaultTransition) {
        let component = transition.component.component.clone();
        self.faults.entry(component).or_default().enter(&transition);
        put_latest(&mut self.latest, transition);
    }

    /// What the diagnoser receives. `watch` names the run.
    pub(crate) fn memory(&self, watch: Option<Watch>) -> Memory {
        let latest = self.latest.iter().cloned().filter_map(from_transition).collect();
        let watch = watch.map(|Watch { run, watched }| {
            let own = self.changes.iter().filter(|(of, _)| *of == run);
            // A change is written again when it is over, and repeated in a new file: the latest counts.
            let mut latest = BTreeMap::new();
            for (_, change) in own {
                latest.insert((change.step, change.component.clone()), change.clone());
            }
            let mut changes: Vec<Change> = latest.into_values().collect();
            changes.drain(..changes.len().saturating_sub(MAX_CHANGES_IN_ANSWER));
            PastWatch { run, watched, changes }
        });
        Memory { sequence: self.sequence, latest, watch }
    }
}

/// The number decides which transition of a component is the latest.
fn put_latest(all: &mut Vec<FaultTransition>, transition: FaultTransition) {
    match all.iter_mut().find(|known| known.component == transition.component) {
        Some(known) if known.sequence > transition.sequence => {}
        Some(known) => *known = transition,
        None => all.push(transition),
    }
}

/// What a page of history shows of a journal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Entry {
    /// A transition.
    Transition(Box<FaultTransition>),
    /// What was published of a fault.
    Identification(Box<Identification>),
}

/// Of records, read one by one, the entries of a module, each once.
#[derive(Debug)]
pub(crate) struct Entries {
    module: ModuleName,
    seen: Seen,
}

impl Entries {
    pub(crate) fn of(module: &ModuleName) -> Self {
        Self { module: module.clone(), seen: Seen::default() }
    }

    /// The entry that the next record is, if it is one.
    pub(crate) fn read(&mut self, text: &str) -> Option<Entry> {
        let entry = match Record::from_text(text)? {
            Record::Transition(transition) if transition.module == self.module => {
                Entry::Transition(transition)
            }
            Record::Identification(found) if found.module == self.module => {
                Entry::Identification(found)
            }
            _ => return None,
        };
        self.seen.is_new(&entry).then_some(entry)
    }
}

/// What was there already: a new file begins with the present state once more.
#[derive(Debug, Default)]
struct Seen {
    sequence: u64,
    /// Of each component, the fault last identified and as of when.
    identified: BTreeMap<Component, (u64, Step)>,
}

impl Seen {
    fn is_new(&mut self, entry: &Entry) -> bool {
        match entry {
            Entry::Transition(transition) => {
                let new = transition.sequence > self.sequence;
                self.sequence = self.sequence.max(transition.sequence);
                new
            }
            Entry::Identification(found) => {
                let at = (found.sequence, found.as_of_step);
                let known = self.identified.entry(found.component.component.clone());
                let known = known.or_default();
                let new = at > *known;
                *known = at.max(*known);
                new
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::Verdict;
    use diagnosis::messages::Speaker;
    use vocabulary::{FaultState, Step};

    fn transition(component: &str, sequence: u64, state: FaultState) -> String {
        let speaker = Speaker::of("t".parse().unwrap(), "m1".parse().unwrap());
        let mut message = speaker.untouched(&component.parse().unwrap(), 5);
        message.sequence = sequence;
        message.verdict = vocabulary::Verdict::example(state);
        message.run = Some(RunId(1));
        let step = Some(Step(sequence));
        (message.onset_step, message.detection_step, message.decided_step) = (step, step, step);
        message.evidence = Some(vocabulary::Evidence {
            step: Step(1),
            residual: 1.0,
            level: 0.5,
            divergence: Some(2.0),
            threshold: 1.0,
        });
        Record::Transition(Box::new(message)).to_text().unwrap()
    }

    fn change(run: u64, step: u64) -> String {
        let component = "sensor/g1".parse().unwrap();
        let change = vocabulary::Change::at(component, Step(step), 2.0);
        Record::Change { run: RunId(run), change }.to_text().unwrap()
    }

    #[test]
    fn the_latest_of_each_component_the_sequence_and_the_runs_changes_come_back() {
        let records = [
            transition("sensor/g1", 1, FaultState::Tentative),
            change(1, 7),
            transition("sensor/g1", 2, FaultState::Latched),
            transition("actuator/a1", 3, FaultState::Normal),
            change(2, 9),
            change(2, 9),
        ];
        let recollection = Recollection::of(&records, &"m1".parse().unwrap());
        let watch = Watch { run: RunId(2), watched: Some((Step(1), Step(20))) };
        let memory = recollection.memory(Some(watch));
        assert_eq!(memory.sequence, 3);
        let verdicts: Vec<_> = memory.latest.iter().map(|t| t.verdict.clone()).collect();
        assert_eq!(verdicts, [Verdict::Latched, Verdict::Normal]);
        let watch = memory.watch.unwrap();
        assert_eq!(watch.changes.iter().map(|c| c.step.0).collect::<Vec<_>>(), [9]);
        assert_eq!(watch.watched, Some((Step(1), Step(20))));
    }

    #[test]
    fn after_the_end_of_a_run_its_faults_are_left_and_its_changes_are_not() {
        let latched = |sequence| transition("sensor/g1", sequence, FaultState::Latched);
        let ended = Record::RunEnded.to_text().unwrap();
        let mut records = vec![latched(1), change(1, 7), ended, change(1, 2)];
        let module = "m1".parse().unwrap();
        let recalled = |records: &[String]| {
            let watch = Watch { run: RunId(1), watched: None };
            let memory = Recollection::of(records, &module).memory(Some(watch));
            let changes: Vec<u64> =
                memory.watch.unwrap().changes.iter().map(|c| c.step.0).collect();
            (memory.latest.iter().map(|latest| latest.run_ended).collect::<Vec<_>>(), changes)
        };
        assert_eq!(recalled(&records), (vec![true], vec![2]));
        let mut snapshot = super::super::snapshot::Snapshot::default();
        snapshot.note_texts(records.clone());
        let texts: Vec<String> = snapshot.texts().map(str::to_owned).collect();
        // Whatever stands before it in an older file, and on its own.
        assert_eq!(recalled(&[&records[..2], &texts].concat()), (vec![true], vec![2]));
        assert_eq!(recalled(&texts), (vec![true], vec![2]));
        records.push(latched(2));
        assert_eq!(recalled(&records), (vec![false], vec![2]));
    }

    #[test]
    fn changes_of_one_step_are_returned_once_though_a_snapshot_repeats_them() {
        let change = |component: &str| {
            let component = component.parse().unwrap();
            let change = vocabulary::Change::at(component, Step(9), 2.0);
            Record::Change { run: RunId(2), change }.to_text().unwrap()
        };
        let records = ["actuator/a1", "sensor/g1", "actuator/a1", "sensor/g1"].map(change);
        let recollection = Recollection::of(&records, &"m1".parse().unwrap());
        let memory = recollection.memory(Some(Watch { run: RunId(2), watched: None }));
        let changes = memory.watch.unwrap().changes;
        let names: Vec<_> = changes.iter().map(|change| change.component.to_string()).collect();
        assert_eq!(names, ["actuator/a1", "sensor/g1"]);
    }

    #[test]
    fn another_modules_journal_is_not_accepted() {
        let records = [transition("sensor/g1", 1, FaultState::Latched)];
        let recollection = Recollection::of(&records, &"m2".parse().unwrap());
        assert_eq!(recollection.memory(None), Memory::default());
    }

    fn identification(component: &str, sequence: u64, as_of: u64) -> String {
        let speaker = Speaker::of("t".parse().unwrap(), "m1".parse().unwrap());
        let found = diagnosis::identification::Identification {
            run: RunId(1),
            sequence,
            component: component.parse().unwrap(),
            as_of: Step(as_of),
            candidates: Vec::new(),
            signature: Vec::new(),
        };
        let message = speaker.identification(found, 0);
        Record::Identification(Box::new(message)).to_text().unwrap()
    }

    #[test]
    fn entries_are_returned_once_though_a_snapshot_repeats_them() {
        let transition = |sequence| transition("sensor/g1", sequence, FaultState::Latched);
        let found = |as_of| identification("sensor/g1", 2, as_of);
        let other = identification("sensor/g2", 1, 5);
        let texts = [
            transition(1),
            transition(2),
            found(10),
            other,
            found(20),
            transition(3),
            transition(2),
            transition(3),
            found(20),
            transition(4),
            found(30),
        ];
        let mut entries = Entries::of(&"m1".parse().unwrap());
        let entries = texts.iter().filter_map(|text| entries.read(text)).map(|entry| match entry {
            Entry::Transition(transition) => format!("{}", transition.sequence),
            Entry::Identification(found) => format!("{}@{}", found.sequence, found.as_of_step),
        });
        let entries: Vec<String> = entries.collect();
        assert_eq!(entries, ["1", "2", "2@10", "1@5", "2@20", "3", "4", "2@30"]);
    }

    fn recalled(records: &[String]) -> Vec<(String, u64)> {
        let faults = Recollection::of(records, &"m1".parse().unwrap()).faults;
        let published = faults.iter().filter_map(|(component, fault)| {
            Some((component.to_string(), fault.published()?.as_of_step.0))
        });
        published.collect()
    }

    #[test]
    fn the_latest_word_on_each_present_fault_comes_back() {
        let latched = |component, sequence| transition(component, sequence, FaultState::Latched);
        let mut records = vec![
            latched("sensor/g1", 1),
            identification("sensor/g1", 1, 10),
            latched("sensor/g2", 2),
            identification("sensor/g2", 2, 11),
            identification("sensor/g1", 1, 20),
            transition("sensor/g1", 3, FaultState::Acknowledged),
            transition("sensor/g2", 4, FaultState::Normal),
        ];
        assert_eq!(recalled(&records), [("sensor/g1".to_owned(), 20)]);
        // The same from a new file, which begins with the latest of each.
        let shorter = [&records[5..7], &records[4..5], &records[3..4]].concat();
        assert_eq!(recalled(&shorter), [("sensor/g1".to_owned(), 20)]);
        let foreign = records[4].replace(r#""module":"m1""#, r#""module":"m2""#);
        records.push(foreign.replace("m1/sensor", "m2/sensor").replace("20", "30"));
        assert_eq!(recalled(&records), [("sensor/g1".to_owned(), 20)]);
    }
}
