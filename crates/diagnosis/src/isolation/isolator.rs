//! From changes to judgements: what is pending, which peers to ask, when enough is known.

use vocabulary::{Component, ComponentPath, ModuleName, RunId, Step, delivery::Backoff};

use super::case::{Case, Finding, Judgement};
use super::causes::Causes;
use super::claims::{Claims, Word};
use super::first_change::FirstChange;
use super::knowledge::{KnownChange, PeerKnowledge};
use crate::change::LoggedChange;
use crate::change_log::ChangeLog;
use crate::coverage::Coverage;
use crate::question::PeerFailure;
use crate::residual::longest_gap_of_loops;
use crate::settings::{IsolationSettings, ModuleSetup, Rule};
use crate::verdict::Transition;
use vocabulary::{Change, Evidence, StateAnswer, StateQuestion};

/// The first and the longest pause before an unanswered question is put again \[s\]. After the first, a peer is asked
/// whether it stands by its word.
const PAUSES_S: [f64; 2] = [0.25, 1.0];

/// Most changes of one channel that await their judgement. Reached only while peers stay silent for long; then
/// the smallest of the later ones is given up, and counted.
const MAX_PENDING: usize = 8;

/// The part of a diagnoser that judges its changes.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Isolator {
    module: ModuleName,
    components: Vec<Component>,
    settings: IsolationSettings,
    /// Before an unanswered question is put again \[steps\].
    pauses: Backoff<u64>,
    /// Steps without divergences after which the models are as good as before, for a change that began meanwhile: a
    /// gap that the force loops are stepped through, the window after it and a tie.
    short_gap: u64,
    rule: FirstChange,
    /// The module's own changes.
    pub(crate) log: ChangeLog,
    peers: Vec<PeerKnowledge>,
    /// The changes that await their judgement.
    pub(crate) cases: Vec<Case>,
    /// How many changes were given up without a judgement.
    pub(crate) given_up: u64,
    /// The verdicts that rest on a peer's word.
    pub(crate) claims: Claims,
    /// What the changes up to some step come to that bears on later ones. They are over, and forgotten.
    causes: Causes,
    taken_until: Option<Step>,
}

impl Isolator {
    pub(crate) fn new(setup: &ModuleSetup, components: Vec<Component>) -> Self {
        let of_loops = longest_gap_of_loops(setup.hydraulics.as_ref(), setup.step_s);
        let divergence = &setup.detection.divergence;
        let window = (divergence.window + divergence.lag) as u64;
        let [first, longest] = PAUSES_S.map(|pause| setup.sampling().steps(pause));
        Self {
            module: setup.module.clone(),
            components,
            settings: setup.isolation,
            claims: Claims::new(first),
            pauses: Backoff::new(first, longest),
            short_gap: of_loops + window + setup.isolation.tie_steps,
            rule: FirstChange::new(&setup.isolation, &setup.detection.divergence),
            log: ChangeLog::new(setup.isolation.tie_steps, setup.isolation.quiet_steps),
            peers: setup.peers.iter().cloned().map(PeerKnowledge::new).collect(),
            cases: Vec::new(),
            given_up: 0,
            causes: Causes::default(),
            taken_until: None,
        }
    }

    /// Forgets everything; steps restart.
    pub(crate) fn restart(&mut self) {
        self.log.clear();
        self.cases.clear();
        self.claims.clear();
        self.causes = Causes::default();
        self.taken_until = None;
        for peer in &mut self.peers {
            *peer = PeerKnowledge::new(peer.name.clone());
        }
    }

    /// The module's changes that had begun by `as_of` and were not over before `from`, as they stood then.
    pub(crate) fn changes_as_of(&self, from: Step, as_of: Step) -> impl Iterator<Item = Change> {
        let quiet = self.settings.quiet_steps;
        let ended = move |change: &LoggedChange| change.ended_as_of(as_of, quiet);
        let known = self.log.overlapping(from, as_of);
        known.map(move |change| change.as_of(as_of, ended(change), &self.components))
    }

    /// Logs a change of a channel's own, with its onset and ratio; `judge` says whether its verdict is open, `of_gap`
    /// whether it may come of the models' ignorance of a gap, if it began in one.
    pub(crate) fn change(
        &mut self,
        (channel, onset, ratio): (usize, Step, f64),
        evidence: Evidence,
        judge: bool,
        of_gap: bool,
    ) {
        self.log.push(LoggedChange::new(channel, onset, evidence.step, ratio));
        if judge {
            self.cases.push(Case::new(channel, onset, evidence, self.hold(channel), of_gap));
            self.bound_cases_of(channel);
        }
    }

    /// If too many changes of a channel await their judgement, the smallest of the later ones is given up. The first
    /// one stays: it tells when the fault began.
    fn bound_cases_of(&mut self, channel: usize) {
        let of_channel =
            || self.cases.iter().enumerate().filter(|(_, case)| case.channel == channel);
        if of_channel().count() <= MAX_PENDING {
            return;
        }
        let first = of_channel().min_by_key(|(_, case)| case.change).map(|(place, _)| place);
        let later = of_channel().filter(|(place, _)| Some(*place) != first);
        let ratio = |case: &Case| case.evidence.ratio();
        let smallest = later.min_by(|(_, a), (_, b)| ratio(a).total_cmp(&ratio(b)));
        if let Some((place, _)) = smallest {
            self.cases.remove(place);
            self.given_up += 1;
        }
    }

    /// The case of a change from before a restart.
    pub(crate) fn recalled_case(&self, channel: usize, change: &Transition) -> Case {
        Case::recalled(channel, change, self.hold(channel))
    }

    /// Drops the open cases of a channel: an operator has decided.
    pub(crate) fn drop_cases(&mut self, channel: usize) {
        self.cases.retain(|case| case.channel != channel);
        self.claims.close_all_of(channel);
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
    /// changes. `faulty` lists the module's own components that are declared faulty, `coverage` what
    /// the module itself has watched.
    pub(crate) fn findings(
        &mut self,
        now: Step,
        faulty: Vec<(ComponentPath, Step)>,
        coverage: &Coverage,
    ) -> Vec<(Case, Finding)> {
        let mut findings = Vec::new();
        let is_actuator =
            |(path, _): &&(ComponentPath, Step)| matches!(path.component, Component::Actuator(_));
        let mut latched: Vec<_> = faulty.iter().filter(is_actuator).cloned().collect();
        let of_peers = self.peers.iter().flat_map(|peer| peer.faults.iter().cloned());
        self.causes.faulty = faulty.into_iter().chain(of_peers).collect();
        self.cases.sort_by_key(|case| (case.decide_at, case.channel));
        let due = self.cases.partition_point(|case| case.decide_at <= now);
        for mut case in self.cases.drain(..due).collect::<Vec<_>>() {
            match self.find(&case, &latched, coverage) {
                None => self.cases.push(case),
                Some(Finding::Silent(silent)) => {
                    if case.reported != silent {
                        case.reported.clone_from(&silent);
                        findings.push((case.clone(), Finding::Silent(silent)));
                    }
                    self.cases.push(case);
                }
                Some(finding) => {
                    let is_root = finding == Finding::Judged(Judgement::Root);
                    if is_root && self.is_actuator(case.channel) {
                        latched.push((self.path(case.channel), case.change));
                    }
                    findings.push((case, finding));
                }
            }
        }
        self.forget_what_is_over(now);
        findings
    }

    /// The finding on a case that is due; `None` while answers may still arrive. A jump cannot be an effect, so its
    /// finding does not depend on peers that do not answer or were not watching.
    fn find(
        &self,
        case: &Case,
        latched: &[(ComponentPath, Step)],
        coverage: &Coverage,
    ) -> Option<Finding> {
        let own = self.own_knowledge(case, coverage)?;
        if self.is_at_home(case, latched) {
            return Some(Finding::Judged(self.judge(case, latched)));
        }
        if !self.is_jump(case) {
            let (unknowing, silent) = (self.unknowing(case, own), self.silent_peers(case));
            if !unknowing.is_empty() {
                return Some(Finding::Unknowing(unknowing));
            }
            if !silent.is_empty() {
                return Some(Finding::Silent(silent));
            }
        }
        if self.peers.iter().any(|peer| !peer.has_answered(case.decide_at) && !peer.is_silent()) {
            return None;
        }
        let judgement = self.judge(case, latched);
        let blind = match judgement {
            Judgement::First => self.blind_before(case, coverage),
            _ => Vec::new(),
        };
        Some(if blind.is_empty() { Finding::Judged(judgement) } else { Finding::Unknowing(blind) })
    }

    /// Is the change that of no effect, by its ratio? What leaves the interval is as large as what entered it, and
    /// tells no more.
    fn is_jump(&self, case: &Case) -> bool {
        if self.settings.rule == Rule::Paper {
            return false;
        }
        let windows = self.rule.windows();
        let until = case.decide_at;
        let of_channel = self.log.between(Step(0), case.change);
        let of_channel = of_channel.filter(|change| change.channel == case.channel);
        let (mut is_jump, mut leaves) = (false, false);
        for change in of_channel.map(|change| self.known(change, until)) {
            match change.step == case.change {
                true => is_jump = windows.is_root_by_ratio(&change),
                false => leaves |= windows.leaves(change.period(), case.change),
            }
        }
        is_jump && !leaves
    }

    /// Which questions must be put at step `now`? They count as put.
    pub(crate) fn questions(&mut self, run: RunId, now: Step) -> Vec<(ModuleName, StateQuestion)> {
        let due = || self.cases.iter().map(|case| case.decide_at).filter(|step| *step <= now);
        let latest = due().max();
        let tie = self.settings.tie_steps;
        let mut questions = Vec::new();
        for peer in self.peers.iter_mut().filter(|peer| peer.may_be_asked(now)) {
            let of_cases = latest.filter(|_| due().any(|step| !peer.has_answered(step)));
            let of_claims = self.claims.due_of(&peer.name, now);
            let Some(as_of) = of_cases.max(of_claims) else { continue };
            let question = StateQuestion { run, from: peer.unknown_from(tie), as_of, window: None };
            questions.push((peer.name.clone(), question));
            peer.outstanding = Some(question);
        }
        questions
    }

    /// A case was judged an effect of the change of `by` at `since`. If `by` belongs to a peer, the judgement depends
    /// on that peer's confirmation.
    pub(crate) fn rest_on(&mut self, case: &Case, by: &ComponentPath, since: Step) {
        let peer = self.peers.iter().find(|peer| peer.name == by.module);
        let stands =
            peer.is_none_or(|peer| peer.has_answered(since) && peer.stands_by(&by.component));
        if self.settings.rule == Rule::FirstChange && !stands {
            self.claims.open(case.clone(), by.clone(), since);
        }
    }

    /// A peer answered. Returns the cases that rested on its word, with what has become of it. An answer to any question but
    /// the outstanding one is ignored: it may be late, and the proper answer is still to come.
    ///
    /// # Errors
    /// An answer that does not fit: it counts as none.
    pub(crate) fn answered(
        &mut self,
        answer: StateAnswer,
        now: Step,
    ) -> Result<Vec<(Case, Word)>, PeerFailure> {
        let Some(peer) = self.peers.iter_mut().find(|peer| peer.name == answer.module) else {
            return Err(PeerFailure::Malformed(format!("`{}` is not a peer", answer.module)));
        };
        if peer.outstanding != Some(answer.question) {
            return Ok(Vec::new());
        }
        let quiet = self.settings.quiet_steps;
        peer.take(answer.clone(), quiet).inspect_err(|_| peer.fail(now, self.pauses))?;
        Ok(self.claims.check(&answer))
    }

    /// A peer did not answer. Returns whether it had been asked this.
    pub(crate) fn unanswered(
        &mut self,
        peer: &ModuleName,
        question: StateQuestion,
        now: Step,
    ) -> bool {
        let asked = |p: &&mut PeerKnowledge| p.name == *peer && p.outstanding == Some(question);
        match self.peers.iter_mut().find(asked) {
            Some(peer) => {
                peer.fail(now, self.pauses);
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
    fn unknowing(&self, case: &Case, own: bool) -> Vec<ModuleName> {
        let itself = (!own).then(|| self.module.clone());
        let peers = self.peers.iter().filter(|p| p.cannot_know(case.change, case.decide_at));
        itself.into_iter().chain(peers.map(|peer| peer.name.clone())).collect()
    }

    /// The modules that were not watching at some time in which something may have happened that explains the
    /// case: right before it, or when that entered which leaves the interval with it. What may have begun in a short
    /// gap of this module's own is judged: it is the first that shows after it, and the models have crossed the gap,
    /// unless the demand has moved by as much meanwhile.
    fn blind_before(&self, case: &Case, coverage: &Coverage) -> Vec<ModuleName> {
        let from = case.onset.minus(self.settings.effect_steps);
        let watched = coverage.since(case.decide_at).is_some_and(|since| {
            let begun_in_gap = coverage.since(case.onset).is_none();
            let is_short = since.since(case.onset) <= self.short_gap;
            since <= from || begun_in_gap && is_short && !case.of_gap
        });
        let leaves = |(_, next)| self.rule.windows().forgets(Some(next)) >= Some(case.onset);
        let in_interval = |gap: (Step, Step)| gap.1 <= case.onset && leaves(gap);
        let gap =
            coverage.gaps().any(|gap| gap.1.since(gap.0) > self.short_gap && in_interval(gap));
        let itself = (!watched || gap).then(|| self.module.clone());
        let peers = self.peers.iter().filter(|peer| !peer.suffices(from, case.decide_at));
        itself.into_iter().chain(peers.map(|peer| peer.name.clone())).collect()
    }

    /// A peer is back: what it failed to answer may be asked at once.
    pub(crate) fn returned(&mut self, peer: &ModuleName, now: Step) {
        if let Some(peer) = self.peers.iter_mut().find(|p| p.name == *peer) {
            peer.retry_now(now, self.pauses);
        }
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

    /// One of the module's own changes, as it stood at `until`.
    fn known(&self, change: &LoggedChange, until: Step) -> KnownChange {
        KnownChange {
            path: self.path(change.channel),
            onset: change.onset,
            step: change.step,
            ratio: change.ratio_as_of(until),
            until: change.ended_as_of(until, self.settings.quiet_steps),
        }
    }

    /// Every known change that bears on a judgement as of `until` and has not been taken yet, sorted by step.
    fn changes_until(&self, until: Step) -> Vec<KnownChange> {
        let from = self.taken_until.map_or(Step(0), |taken| taken.plus(1));
        let own = self.log.between(from, until).map(|change| self.known(change, until));
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
            peer.forget_until(taken_until);
        }
    }

    pub(crate) fn path(&self, channel: usize) -> ComponentPath {
        ComponentPath { module: self.module.clone(), component: self.components[channel].clone() }
    }

    /// Whether no change awaits judgement and no query to a peer is due.
    pub(crate) fn is_idle(&self, now: Step) -> bool {
        self.cases.is_empty() && !self.claims.is_any_due(now)
    }
}

/// Algorithm 4.3 of the paper: only actuator faults explain, and permanently. An actuator's change is always its own fault; a sensor's is explained by the earliest
/// actuator fault anywhere, if there is one. `actuator_faults` are those known as of the judgement.
fn judge_by_the_paper<'a>(
    component: &Component,
    actuator_faults: impl Iterator<Item = (&'a ComponentPath, Step)>,
) -> Judgement {
    if matches!(component, Component::Actuator(_)) {
        return Judgement::Root;
    }
    let earliest = actuator_faults.min_by(|a, b| a.1.cmp(&b.1).then_with(|| a.0.cmp(b.0)));
    match earliest {
        Some((path, since)) => Judgement::Explained { by: path.clone(), since },
        None => Judgement::Root,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_actuator_fault_anywhere_explains_a_sensor_but_never_another_actuator() {
        let path: ComponentPath = "m2/actuator/a1".parse().unwrap();
        let faults = [(&path, Step(5))];
        let sensor: Component = "sensor/g1".parse().unwrap();
        let actuator: Component = "actuator/a2".parse().unwrap();
        let explained = Judgement::Explained { by: path.clone(), since: Step(5) };
        assert_eq!(judge_by_the_paper(&sensor, faults.into_iter()), explained);
        assert_eq!(judge_by_the_paper(&actuator, faults.into_iter()), Judgement::Root);
        assert_eq!(judge_by_the_paper(&sensor, std::iter::empty()), Judgement::Root);
    }
}
