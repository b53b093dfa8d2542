//! From changes to judgements: what is pending, which peers to ask, when enough is known.

use names::{Component, ComponentPath, ModuleName, RunId, Step};

use super::causes::Causes;
use super::first_change::FirstChange;
use super::judgement::Judgement;
use super::knowledge::{KnownChange, PeerKnowledge};
use super::paper::judge as judge_by_the_paper;
use crate::change::{Change, LoggedChange};
use crate::change_log::ChangeLog;
use crate::coverage::Coverage;
use crate::evidence::Evidence;
use crate::question::{Answer, PeerFailure, Question};
use crate::settings::{IsolationSettings, ModuleSetup, Rule};
use crate::verdict::{Doubt, Transition, Verdict};

/// Most changes of one channel that await their judgement. Reached only while peers stay silent for long; then
/// the smallest of the later ones is given up, and counted.
const MAX_PENDING: usize = 8;

/// Steps without divergences after which the models are as good as before, for a change that began meanwhile: a
/// gap that the force loops are stepped through, and the window after it.
const SHORT_GAP: u64 = 40;

/// A change that awaits its judgement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Case {
    /// Number of the channel.
    pub(crate) channel: usize,
    /// The step of the change.
    pub(crate) change: Step,
    /// Since when the residual had been changing.
    pub(crate) onset: Step,
    /// The channel at the change.
    pub(crate) evidence: Evidence,
    /// As of which step it is judged.
    pub(crate) decide_at: Step,
    /// Not yet published as tentative.
    new: bool,
    /// The peers that were last reported as silent.
    reported: Vec<ModuleName>,
    /// Taken up after a restart: it is not certain what the module itself saw meanwhile.
    recalled: bool,
}

/// What was found about a case.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    /// It is judged, and closed.
    Judged(Judgement),
    /// These peers' answers are missing; it stays open.
    Silent(Vec<ModuleName>),
    /// These modules were not watching then; it is closed without a judgement.
    Unknowing(Vec<ModuleName>),
}

/// The part of a diagnoser that judges its changes.
#[derive(Debug, Clone)]
pub(crate) struct Isolator {
    module: ModuleName,
    components: Vec<Component>,
    settings: IsolationSettings,
    rule: FirstChange,
    log: ChangeLog,
    peers: Vec<PeerKnowledge>,
    cases: Vec<Case>,
    /// Changes given up without a judgement.
    unjudged: u64,
    /// What the changes up to some step come to that bears on later ones. They are over, and forgotten.
    causes: Causes,
    taken_until: Option<Step>,
}

impl Isolator {
    pub(crate) fn new(setup: &ModuleSetup, components: Vec<Component>) -> Self {
        Self {
            module: setup.module.clone(),
            components,
            settings: setup.isolation,
            rule: FirstChange::new(&setup.isolation, &setup.detection.divergence),
            log: ChangeLog::default(),
            peers: setup.peers.iter().cloned().map(PeerKnowledge::new).collect(),
            cases: Vec::new(),
            unjudged: 0,
            causes: Causes::default(),
            taken_until: None,
        }
    }

    /// Forgets everything; steps restart.
    pub(crate) fn restart(&mut self) {
        self.log.clear();
        self.cases.clear();
        self.causes = Causes::default();
        self.taken_until = None;
        for peer in &mut self.peers {
            *peer = PeerKnowledge::new(peer.name.clone());
        }
    }

    /// The module's own changes.
    pub(crate) fn log(&self) -> &ChangeLog {
        &self.log
    }

    /// Takes the ratios of this step into account.
    pub(crate) fn follow(&mut self, step: Step, ratio: impl Fn(usize) -> f64) {
        self.log.follow(step, self.settings.tie_steps, ratio);
    }

    /// A channel is still changing at this step.
    pub(crate) fn prolong(&mut self, channel: usize, step: Step, ratio: f64) {
        self.log.prolong(channel, step, ratio, self.settings.quiet_steps);
    }

    /// The next change that has ended by now, and when.
    pub(crate) fn end(&mut self, now: Step) -> Option<(&LoggedChange, Step)> {
        self.log.end(now, self.settings.quiet_steps)
    }

    /// The module's changes that had begun by `as_of` and were not over before `from`, as they stood then.
    pub(crate) fn changes_as_of(&self, from: Step, as_of: Step) -> impl Iterator<Item = Change> {
        let quiet = self.settings.quiet_steps;
        self.log.overlapping(from, as_of, quiet).map(move |change| Change {
            component: self.components[change.channel].clone(),
            onset: change.onset,
            step: change.step,
            ratio: change.ratio_as_of(as_of),
            until: change.ended_as_of(as_of, quiet),
        })
    }

    /// Logs a change of a channel's own; `judge` says whether its verdict is open.
    pub(crate) fn change(&mut self, channel: usize, onset: Step, evidence: Evidence, judge: bool) {
        let step = evidence.step;
        self.log.push(LoggedChange::new(channel, onset, step, evidence.ratio()));
        if judge {
            let decide_at = step.plus(self.hold(channel));
            self.cases.push(Case {
                channel,
                change: step,
                onset,
                evidence,
                decide_at,
                new: true,
                reported: Vec::new(),
                recalled: false,
            });
            self.give_up_smallest(channel);
        }
    }

    /// The first open change of a channel stays: it tells when the fault began.
    fn give_up_smallest(&mut self, channel: usize) {
        let open = || self.cases.iter().enumerate().filter(|(_, case)| case.channel == channel);
        if open().count() <= MAX_PENDING {
            return;
        }
        let first = open().min_by_key(|(_, case)| case.change).map(|(place, _)| place);
        let later = open().filter(|(place, _)| Some(*place) != first);
        let ratio = |case: &Case| case.evidence.ratio();
        let smallest = later.min_by(|(_, a), (_, b)| ratio(a).total_cmp(&ratio(b)));
        if let Some((place, _)) = smallest {
            self.cases.remove(place);
            self.unjudged += 1;
        }
    }

    /// How many changes were given up without a judgement.
    pub(crate) fn unjudged(&self) -> u64 {
        self.unjudged
    }

    /// Takes up, after a restart, a change whose verdict is still open.
    pub(crate) fn recall_case(&mut self, channel: usize, open: &Transition) {
        let Transition { onset, detection, evidence, .. } = *open;
        let reported = match &open.verdict {
            Verdict::Unconfirmed { doubt: Doubt::Silent(silent) } => silent.clone(),
            _ => Vec::new(),
        };
        let decide_at = detection.plus(self.hold(channel));
        self.cases.push(Case {
            channel,
            change: detection,
            onset,
            evidence,
            decide_at,
            new: false,
            reported,
            recalled: true,
        });
    }

    /// Takes up, after a restart, the changes known before, oldest first.
    pub(crate) fn recall_changes(&mut self, changes: impl IntoIterator<Item = LoggedChange>) {
        self.log.recall(changes);
    }

    /// Was this change seen before the restart? Its ratio is then raised to this one.
    pub(crate) fn merge_repeat(&mut self, channel: usize, step: Step, ratio: f64) -> bool {
        self.log.merge_repeat(channel, step, self.settings.tie_steps, ratio)
    }

    /// The next change whose ratio has become final.
    pub(crate) fn settle(&mut self, now: Step) -> Option<&LoggedChange> {
        self.log.settle(now, self.settings.tie_steps)
    }

    /// Drops the open cases of a channel: an operator has decided.
    pub(crate) fn drop_cases(&mut self, channel: usize) {
        self.cases.retain(|case| case.channel != channel);
    }

    /// Steps from a change of this channel to its judgement. By the paper an actuator fault is found
    /// at once.
    fn hold(&self, channel: usize) -> u64 {
        let alone = self.settings.rule == Rule::Paper && self.is_actuator(channel);
        if alone { 0 } else { self.settings.hold_steps }
    }

    fn is_actuator(&self, channel: usize) -> bool {
        matches!(self.components[channel], Component::Actuator(_))
    }

    /// Needs the case no peer? By the paper an actuator fault is found alone, and explains the
    /// sensors of its own module.
    fn is_at_home(&self, case: &Case, latched: &[(ComponentPath, Step)]) -> bool {
        self.settings.rule == Rule::Paper
            && (self.is_actuator(case.channel)
                || latched.iter().any(|(_, since)| *since <= case.decide_at))
    }

    /// Judges every case that can be judged at step `now`. Returns the findings in the order of the
    /// changes. `latched` lists the module's own actuators that are declared faulty, `coverage` what
    /// the module itself has watched.
    pub(crate) fn findings(
        &mut self,
        now: Step,
        latched: &[(ComponentPath, Step)],
        coverage: &Coverage,
    ) -> Vec<(Case, Finding)> {
        let mut findings = Vec::new();
        let mut latched = latched.to_vec();
        self.cases.sort_by_key(|case| (case.decide_at, case.channel));
        for mut case in std::mem::take(&mut self.cases) {
            if now < case.decide_at {
                self.cases.push(case);
                continue;
            }
            let at_home = self.is_at_home(&case, &latched);
            let own = self.own_knowledge(&case, coverage);
            let unknowing = self.unknowing(&case, own);
            let silent = self.silent_peers(&case);
            if own.is_none() {
                self.cases.push(case);
            } else if !at_home && !unknowing.is_empty() {
                findings.push((case, Finding::Unknowing(unknowing)));
            } else if !at_home && !silent.is_empty() {
                if case.reported != silent {
                    case.reported.clone_from(&silent);
                    findings.push((case.clone(), Finding::Silent(silent)));
                }
                self.cases.push(case);
            } else if at_home || self.is_known(&case) {
                let judgement = self.judge(&case, &latched);
                let blind = self.blind_before(&case, coverage);
                if judgement == Judgement::First && !blind.is_empty() {
                    findings.push((case, Finding::Unknowing(blind)));
                    continue;
                }
                if judgement == Judgement::Root && self.is_actuator(case.channel) {
                    latched.push((self.path(case.channel), case.change));
                }
                findings.push((case, Finding::Judged(judgement)));
            } else {
                self.cases.push(case);
            }
        }
        self.forget_what_is_over(now);
        findings
    }

    /// The open cases that were not returned here before.
    pub(crate) fn new_cases(&mut self) -> Vec<Case> {
        let new = self.cases.iter_mut().filter(|case| case.new);
        new.map(|case| {
            case.new = false;
            case.clone()
        })
        .collect()
    }

    /// Which questions must be put at step `now`? They count as put.
    pub(crate) fn questions(&mut self, run: RunId, now: Step) -> Vec<(ModuleName, Question)> {
        let due = self.cases.iter().filter(|case| case.decide_at <= now);
        let Some(as_of) = due.map(|case| case.decide_at).max() else {
            return Vec::new();
        };
        let tie = self.settings.tie_steps;
        let cases = &self.cases;
        let lacking = |peer: &PeerKnowledge| {
            let due = cases.iter().filter(|case| case.decide_at <= now);
            due.into_iter().any(|case| {
                !peer.suffices(case.change, case.decide_at)
                    && !peer.cannot_know(case.change, case.decide_at)
            })
        };
        let mut questions = Vec::new();
        for index in 0..self.peers.len() {
            let peer = &self.peers[index];
            if peer.may_be_asked(now) && lacking(peer) {
                let question = Question { run, from: peer.unknown_from(tie), as_of };
                questions.push((peer.name.clone(), question));
                self.peers[index].outstanding = Some(question);
            }
        }
        questions
    }

    /// A peer answered.
    ///
    /// # Errors
    /// An answer that does not fit: it counts as none.
    pub(crate) fn answered(
        &mut self,
        peer: &ModuleName,
        answer: Answer,
        now: Step,
    ) -> Result<(), PeerFailure> {
        let Some(peer) = self.peers.iter_mut().find(|p| p.name == *peer) else {
            return Err(PeerFailure::Malformed(format!("`{peer}` is not a peer")));
        };
        if peer.outstanding.is_none() {
            return Err(PeerFailure::Malformed("nothing was asked".into()));
        }
        let quiet = self.settings.quiet_steps;
        peer.take(answer, quiet).inspect_err(|_| peer.fail(now))
    }

    /// A peer did not answer. Returns whether it had been asked this.
    pub(crate) fn unanswered(&mut self, peer: &ModuleName, question: Question, now: Step) -> bool {
        let asked = |p: &&mut PeerKnowledge| p.name == *peer && p.outstanding == Some(question);
        match self.peers.iter_mut().find(asked) {
            Some(peer) => {
                peer.fail(now);
                true
            }
            None => false,
        }
    }

    /// The peers whose failure to answer keeps the case open.
    fn silent_peers(&self, case: &Case) -> Vec<ModuleName> {
        let silent = self
            .peers
            .iter()
            .filter(|peer| peer.is_silent() && !peer.suffices(case.change, case.decide_at));
        silent.map(|peer| peer.name.clone()).collect()
    }

    /// Did this module itself see everything that the case depends on? `None`: not known yet.
    fn own_knowledge(&self, case: &Case, coverage: &Coverage) -> Option<bool> {
        if case.recalled { coverage.knows(case.change, case.decide_at) } else { Some(true) }
    }

    /// The modules that have answered, but were not watching then.
    fn unknowing(&self, case: &Case, own: Option<bool>) -> Vec<ModuleName> {
        let itself = (own == Some(false)).then(|| self.module.clone());
        let peers = self.peers.iter().filter(|p| p.cannot_know(case.change, case.decide_at));
        itself.into_iter().chain(peers.map(|peer| peer.name.clone())).collect()
    }

    /// The modules that were not watching at some time in which something may have happened that explains the
    /// case. What may have begun in a short gap of this module's own is judged: it is the first that shows after it,
    /// and the models have crossed the gap.
    fn blind_before(&self, case: &Case, coverage: &Coverage) -> Vec<ModuleName> {
        let from = case.onset.minus(self.settings.effect_steps);
        let watched = coverage.since(case.decide_at).is_some_and(|since| {
            let begun_in_gap = coverage.since(case.onset).is_none();
            since <= from || begun_in_gap && since.since(case.onset) <= SHORT_GAP
        });
        let itself = (!watched).then(|| self.module.clone());
        let peers = self.peers.iter().filter(|peer| !peer.suffices(from, case.decide_at));
        itself.into_iter().chain(peers.map(|peer| peer.name.clone())).collect()
    }

    /// A peer is back: what it failed to answer may be asked at once.
    pub(crate) fn returned(&mut self, peer: &ModuleName, now: Step) {
        if let Some(peer) = self.peers.iter_mut().find(|p| p.name == *peer) {
            peer.retry_now(now);
        }
    }

    fn is_known(&self, case: &Case) -> bool {
        self.peers.iter().all(|peer| peer.suffices(case.change, case.decide_at))
    }

    fn judge(&self, case: &Case, latched: &[(ComponentPath, Step)]) -> Judgement {
        let path = self.path(case.channel);
        match self.settings.rule {
            Rule::FirstChange => {
                let changes = self.changes_until(case.decide_at);
                self.rule.judge(&self.causes, &changes, &path, case.change)
            }
            Rule::Paper => {
                let of_peers = self.peers.iter().flat_map(|peer| &peer.actuator_faults);
                let known = latched.iter().chain(of_peers);
                let in_time = known.filter(|(_, step)| *step <= case.decide_at);
                judge_by_the_paper(&path.component, in_time.map(|(path, step)| (path, *step)))
            }
        }
    }

    /// Every known change that bears on a judgement as of `until` and has not been taken yet, sorted by step.
    fn changes_until(&self, until: Step) -> Vec<KnownChange> {
        let from = self.taken_until.map_or(Step(0), |taken| taken.plus(1));
        let own = self.log.between(from, until).map(|change| KnownChange {
            path: self.path(change.channel),
            onset: change.onset,
            step: change.step,
            ratio: change.ratio_as_of(until),
            until: change.ended_as_of(until, self.settings.quiet_steps),
        });
        let of_peers = self.peers.iter().flat_map(|peer| &peer.changes);
        let in_time = of_peers.filter(|change| (from..=until).contains(&change.step));
        let as_of_then = in_time.map(|change| KnownChange {
            until: change.until.filter(|end| end.plus(self.settings.quiet_steps) <= until),
            ..change.clone()
        });
        let mut changes: Vec<_> = own.chain(as_of_then).collect();
        changes.sort_by(|a, b| a.step.cmp(&b.step).then_with(|| a.path.cmp(&b.path)));
        changes
    }

    /// Keeps of the changes that are over what bears on later ones. No pending or future change can be a rival
    /// of theirs.
    fn forget_what_is_over(&mut self, now: Step) {
        let IsolationSettings { rule, hold_steps, tie_steps, quiet_steps, .. } = self.settings;
        if rule == Rule::Paper {
            return;
        }
        let answered = self.peers.iter().map(|peer| peer.answered_until.unwrap_or(Step(0)));
        let pending = self.cases.iter().map(|case| case.change);
        let known = answered.chain(pending).chain([now]).min().unwrap_or(now);
        let known_until = known.minus(hold_steps + tie_steps);
        let changes = self.changes_until(known_until);
        let is_over = |change: &&KnownChange| {
            change.until.is_some() && change.step.plus(quiet_steps.max(tie_steps)) <= known_until
        };
        let over = changes.iter().take_while(is_over).count();
        let (mut causes, mut taken) = (self.causes.clone(), 0);
        while taken < over {
            taken += self.rule.take(&mut causes, &changes[taken..]).len();
            let last = changes[taken - 1].step;
            if taken <= over && changes.get(taken).is_none_or(|next| next.step > last) {
                self.causes = causes.clone();
                self.taken_until = Some(last);
            }
        }
        let Some(taken_until) = self.taken_until else { return };
        for peer in &mut self.peers {
            peer.changes.retain(|change| change.step > taken_until);
        }
    }

    fn path(&self, channel: usize) -> ComponentPath {
        ComponentPath { module: self.module.clone(), component: self.components[channel].clone() }
    }

    /// Is any change awaiting its judgement?
    pub(crate) fn is_idle(&self) -> bool {
        self.cases.is_empty()
    }
}
