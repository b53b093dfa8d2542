//! From windows to transitions: what the comparison with the reference finds, beside what has changed.
//!
//! | change detector | departs from the reference | verdict |
//! |---|---|---|
//! | root | – | faulty since its onset; its condition tells whether it has returned |
//! | explained | no | explained while the change goes on, then closed |
//! | explained | yes | a fault of its own |
//! | none | yes | faulty; it says when it last agreed, or that it was so before service |

use vocabulary::{ComponentPath, ModuleName, Step};

use crate::channels::Channels;
use crate::event::{Action, Handling};
use crate::judging::Judging;
use crate::ledger::{Detection, Ledger, is_open};
use crate::question::PeerFailure;
use crate::settings::ModuleSetup;
use crate::state::{
    Conclusion, Condition, Departed, Detectors, Reaction, Shares, WindowFinding, WindowLength,
};
use vocabulary::{Doubt, Evidence, StateAnswer, StateQuestion, Symptom, Verdict};

/// Windows in which one of several suspects has to agree before it is cleared.
const CLEARED: u32 = 10;

/// The comparison with the reference, if there is one.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Comparing {
    detectors: Option<Detectors>,
    /// Steps of a long window.
    long_steps: u64,
}

impl Comparing {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        let detectors = setup.reference.as_ref().map(|known| Detectors::new(known, setup));
        let long_steps = setup.sampling().steps(WindowLength::Long.seconds());
        Self { detectors, long_steps }
    }

    /// A run begins: nothing has been compared yet.
    pub(crate) fn restart(&mut self) {
        self.detectors.iter_mut().for_each(Detectors::restart);
    }

    /// An operator has reset a component.
    pub(crate) fn forgive(&mut self, channel: usize) {
        self.detectors.iter_mut().for_each(|detectors| detectors.forgive(channel));
    }

    /// By how much a component was off in the latest long window \[m\], \[Pa\]: a gage's mean, a cylinder's oil content.
    pub(crate) fn departure(&self, channel: usize) -> Option<f64> {
        self.detectors.as_ref()?.departure(channel)
    }

    /// How a component departed in the latest long window, if it did.
    pub(crate) fn departed(&self, channel: usize) -> Option<&Departed> {
        self.detectors.as_ref()?.departed(channel)
    }

    /// The end of the last window that a component agreed in before it began to depart, if it departs in the latest long one.
    pub(crate) fn agreed_before(&self, channel: usize) -> Option<Step> {
        self.detectors.as_ref()?.agreed_before(channel)
    }

    /// How near a component is to its limits.
    pub(crate) fn shares(&self, channel: usize) -> Shares {
        self.detectors.as_ref().map(|known| known.shares(channel)).unwrap_or_default()
    }

    pub(crate) fn condition(&self, channel: usize) -> &Condition {
        let detectors = self.detectors.as_ref();
        detectors.map_or(&Condition::NotVerified, |known| known.condition(channel))
    }

    /// Compares the windows that ended at this step.
    pub(crate) fn compare(&mut self, judging: &mut Judging, handling: &mut Handling<'_>) {
        let Handling { run, now, channels, .. } = *handling;
        for window in WindowLength::ALL.into_iter().filter_map(|length| channels.window(length)) {
            let calm = self.is_calm(now, channels, &judging.ledger);
            let Some(detectors) = &mut self.detectors else { return };
            let known =
                judging.ledger.verdicts().map(|(_, verdict)| verdict.is_latched()).collect();
            let (late, reaction) = detectors.take(window, known, calm);
            let concluded = match reaction {
                Some(Reaction::Ask(peers)) => {
                    let as_of = window.until;
                    let question =
                        StateQuestion { run, from: as_of, as_of, window: Some(window.length) };
                    handling.counters.questions_asked += peers.len() as u64;
                    let asked = peers.into_iter().map(|peer| Action::Ask { peer, question });
                    handling.actions.extend(asked);
                    None
                }
                Some(Reaction::Concluded(conclusion)) => Some(conclusion),
                None => None,
            };
            for conclusion in late.into_iter().chain(concluded) {
                self.enter(conclusion, judging, handling);
            }
        }
    }

    /// Has nothing changed for a second, and does nothing wait for a judgement?
    fn is_calm(&self, now: Step, channels: &Channels, ledger: &Ledger) -> bool {
        let quiet = |channel: usize| {
            let changed = channels.monitor(channel).changed_until();
            let verdict = ledger.verdict(channel);
            changed.is_none_or(|changed| changed.plus(self.long_steps) <= now)
                && (*verdict == Verdict::Normal || verdict.is_latched())
        };
        (0..channels.components().len()).all(quiet)
    }

    /// Handles a peer's answer; `None` if the peer did not answer.
    pub(crate) fn answered(
        &mut self,
        (peer, question, answer): (&ModuleName, StateQuestion, Option<StateAnswer>),
        judging: &mut Judging,
        handling: &mut Handling<'_>,
    ) {
        let detectors = self.detectors.as_mut().filter(|_| question.run == handling.run);
        let Some((detectors, length)) = detectors.zip(question.window) else { return };
        let (conclusion, fits) = detectors.answered(peer, (length, question.as_of), answer);
        if let Err(reason) = fits {
            handling.counters.answers_malformed += 1;
            let (peer, failure) = (peer.clone(), PeerFailure::Malformed(reason));
            handling.actions.push(Action::AnswerRejected { peer, failure });
        }
        if let Some(conclusion) = conclusion {
            self.enter(conclusion, judging, handling);
        }
    }

    fn enter(&self, conclusion: Conclusion, judging: &mut Judging, handling: &mut Handling<'_>) {
        let Conclusion { until, findings } = conclusion;
        for (channel, finding) in findings {
            match finding {
                WindowFinding::Agrees { windows } => {
                    self.agree((channel, windows), until, judging, handling);
                }
                WindowFinding::Departed { departed, onset, before_service } => {
                    if is_open(judging.ledger.verdict(channel)) {
                        continue;
                    }
                    let evidence = evidence_of(&departed, until);
                    let departure = Detection {
                        before_service,
                        ..Detection::new(departed.symptom, onset, evidence)
                    };
                    judging.depart(channel, Verdict::Latched, departure, handling);
                }
                WindowFinding::OneOf { components, onset } => {
                    // A conclusion that waited for answers does not know what has been declared since.
                    let ledger = &judging.ledger;
                    let is_known = ledger.is_accounted_for((handling.run, until), &components);
                    let verdict = ledger.verdict(channel);
                    if is_open(verdict) || is_known || !narrows(verdict, &components) {
                        continue;
                    }
                    let evidence =
                        Evidence { step: until, ..handling.channels.evidence()[channel] };
                    let departure = Detection::new(Symptom::Departure, onset, evidence);
                    let verdict = Verdict::Unconfirmed { doubt: Doubt::OneOf(components) };
                    judging.depart(channel, verdict, departure, handling);
                }
            }
        }
    }

    /// What is healthy now, and was explained by another fault or one of several suspects, is normal again.
    fn agree(
        &self,
        (channel, windows): (usize, u32),
        until: Step,
        judging: &mut Judging,
        handling: &mut Handling<'_>,
    ) {
        // After a restart, samples from before the change may be compared again.
        let latest = judging.ledger.latest(&handling.channels.components()[channel]);
        let detected =
            latest.filter(|latest| latest.is_of(handling.run)).map(|latest| latest.detection);
        let changed = handling.channels.monitor(channel).changed_until().max(detected);
        let over = changed.is_none_or(|changed| changed.plus(self.long_steps) <= until);
        match judging.ledger.verdict(channel) {
            Verdict::Explained { .. } if over => judging.close_explained(channel, until, handling),
            Verdict::Unconfirmed { doubt: Doubt::OneOf(_) } if windows >= CLEARED => {
                handling.publish(judging.ledger.clear(channel, until));
            }
            _ => {}
        }
    }
}

/// As evidence of a channel: what was measured, where it should be, and the statistic in place of the divergence.
fn evidence_of(departed: &Departed, step: Step) -> Evidence {
    Evidence {
        step,
        residual: departed.measured,
        level: departed.expected,
        divergence: Some(departed.statistic),
        threshold: departed.threshold,
    }
}

/// Do these suspects tell more than what is known?
fn narrows(known: &Verdict, components: &[ComponentPath]) -> bool {
    match known {
        Verdict::Unconfirmed { doubt: Doubt::OneOf(known) } => {
            components.len() < known.len() && components.iter().all(|path| known.contains(path))
        }
        Verdict::Unconfirmed { .. } => false,
        verdict => !verdict.is_latched(),
    }
}
