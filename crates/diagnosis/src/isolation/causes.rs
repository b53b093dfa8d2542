//! The root causes so far and what they explain. Changes are taken in their order; each is judged once.

use names::{ComponentPath, Step};

use super::first_change::FirstChange;
use super::knowledge::KnownChange;

/// What leaves the interval looks like what entered it, up to this factor of its ratio.
const ALIKE: f64 = 3.0;

/// A root cause with so many changes in the interval comes and goes. The Gaussian has learnt that and may show no
/// more of them, so it explains for as long as the interval remembers.
const RESTLESS: usize = 4;

/// Why a change is a root cause or not.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// No root cause explained anything any more, and of the changes that are simultaneous with it, itself
    /// included, none outranks it.
    First {
        /// The changes that were considered.
        rivals: Vec<KnownChange>,
        /// The last step at which root causes before it explained anything.
        before: Option<Step>,
    },
    /// Its ratio is that of no effect.
    ByRatio,
    /// It was a root cause before: it is repaired, is back again, or its fault leaves the interval.
    Again,
    /// It is an effect.
    Effect {
        /// Of this component,
        by: ComponentPath,
        /// whose change was at this step.
        since: Step,
        /// How that is known.
        how: Explanation,
    },
}

/// How it is known that a change is an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Explanation {
    /// The root cause changed before.
    Earlier,
    /// An effect of the root cause was still changing, or had just been: that may be another fault, hidden
    /// behind the root cause, with effects of its own.
    ByEffect,
    /// They are simultaneous, and the root cause outranks it.
    Tie,
    /// What happened then leaves the interval.
    Leaving,
}

/// A change of a root cause: its step, and its last one; `None` while it goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) since: Step,
    pub(super) until: Option<Step>,
}

/// A component that is a root cause, with its changes.
#[derive(Debug, Clone, PartialEq)]
struct Root {
    path: ComponentPath,
    spans: Vec<Span>,
}

/// A change that is an effect.
#[derive(Debug, Clone, PartialEq)]
struct Effect {
    change: KnownChange,
    by: ComponentPath,
    since: Step,
    how: Explanation,
}

/// What explains changes, and for how long.
struct Explaining<'a> {
    root: &'a ComponentPath,
    since: Step,
    how: Explanation,
    /// From when, until when.
    from: Step,
    until: Option<Step>,
}

impl Explaining<'_> {
    fn covers(&self, onset: Step) -> bool {
        self.from <= onset && self.until.is_none_or(|until| onset <= until)
    }
}

/// The root causes and effects that bear on changes to come.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Causes {
    roots: Vec<Root>,
    effects: Vec<Effect>,
}

impl Causes {
    /// Judges the first of `changes`, which follow those that were taken before, and all that are judged with
    /// it: one reason for each, in their order.
    pub(super) fn take(&mut self, rule: &FirstChange, changes: &[KnownChange]) -> Vec<Reason> {
        let Some(first) = changes.first() else { return Vec::new() };
        self.forget(rule, first.step);
        if let Some(reason) = self.explain(rule, first) {
            return vec![reason];
        }
        self.begin(rule, rule.simultaneous(changes, first))
    }

    /// Forgets what has left the interval, together with its effects.
    fn forget(&mut self, rule: &FirstChange, now: Step) {
        let lasts =
            |until: Option<Step>| rule.forgets(until).is_none_or(|forgotten| forgotten >= now);
        self.roots.retain_mut(|root| {
            root.spans.retain(|span| lasts(span.until));
            !root.spans.is_empty()
        });
        self.effects.retain(|effect| lasts(effect.change.until));
    }

    /// Explains a change that is an effect for certain.
    fn explain(&mut self, rule: &FirstChange, change: &KnownChange) -> Option<Reason> {
        if let Some(entered) = self.entered(rule, change) {
            let Effect { by, since, .. } = entered.clone();
            return Some(Reason::Effect { by, since, how: Explanation::Leaving });
        }
        if self.is_root(change) || rule.is_root_by_ratio(change) {
            return None;
        }
        let Explaining { root, since, how, .. } = self.explaining(rule, change.onset)?;
        let by = root.clone();
        Some(self.effect(change, by, since, how))
    }

    /// Begins with these simultaneous changes: one of them is the root cause.
    fn begin(&mut self, rule: &FirstChange, rivals: &[KnownChange]) -> Vec<Reason> {
        let Some(root) = self.choose(rule, rivals) else { return Vec::new() };
        let before = self.explained_until(rule);
        let is_new = !self.is_root(root);
        let again = |change| match rule.is_root_by_ratio(change) {
            true => Reason::ByRatio,
            false => Reason::Again,
        };
        let reasons = rivals.iter().map(|change| {
            if self.is_root(change) && change != root {
                self.enter(change);
                again(change)
            } else if change != root {
                let (by, since) = (root.path.clone(), root.step);
                match self.entered(rule, change) {
                    Some(Effect { by, since, .. }) => {
                        let (by, since) = (by.clone(), *since);
                        Reason::Effect { by, since, how: Explanation::Leaving }
                    }
                    None => self.effect(change, by, since, Explanation::Tie),
                }
            } else if !is_new {
                again(change)
            } else if before.is_some_and(|before| before >= root.step) {
                Reason::ByRatio
            } else {
                Reason::First { rivals: rivals.to_vec(), before }
            }
        });
        let reasons = reasons.collect();
        self.enter(root);
        reasons
    }

    /// The root cause among simultaneous changes: one that was a root cause before, unless another has the
    /// ratio of a root cause and outranks it; otherwise the one that outranks all others.
    fn choose<'a>(&self, rule: &FirstChange, rivals: &'a [KnownChange]) -> Option<&'a KnownChange> {
        let best = |among: &mut dyn Iterator<Item = &'a KnownChange>| {
            among.reduce(|best, change| if change.outranks(best) { change } else { best })
        };
        let known = best(&mut rivals.iter().filter(|change| self.is_root(change)));
        let is_new =
            |change: &&KnownChange| !self.is_root(change) && self.entered(rule, change).is_none();
        let new = best(&mut rivals.iter().filter(is_new));
        match (known, new) {
            (Some(known), Some(new)) if rule.is_root_by_ratio(new) && new.outranks(known) => {
                Some(new)
            }
            (Some(known), _) => Some(known),
            (None, new) => new,
        }
    }

    fn is_root(&self, change: &KnownChange) -> bool {
        self.roots.iter().any(|root| root.path == change.path)
    }

    /// The effect in the same channel that leaves the interval with this change.
    fn entered(&self, rule: &FirstChange, change: &KnownChange) -> Option<&Effect> {
        self.effects.iter().rev().find(|effect| {
            let entered = &effect.change;
            entered.path == change.path
                && change.ratio <= ALIKE * entered.ratio
                && rule.leaves(entered.span(), change.step)
        })
    }

    /// What explains changes that began at a step, or later: the latest root cause, else the latest of the
    /// effects.
    fn explaining(&self, rule: &FirstChange, onset: Step) -> Option<Explaining<'_>> {
        let covers = |cause: &Explaining<'_>| cause.covers(onset);
        let latest = |cause: &Explaining<'_>| cause.since;
        (self.by_roots(rule).filter(covers).max_by_key(latest))
            .or_else(|| self.by_effects(rule).filter(covers).max_by_key(latest))
            .or_else(|| self.by_leaving(rule).filter(covers).max_by_key(latest))
    }

    /// The last step at which any root cause explains anything.
    fn explained_until(&self, rule: &FirstChange) -> Option<Step> {
        let causes = self.by_roots(rule).chain(self.by_effects(rule));
        causes.map(|cause| cause.until.unwrap_or(Step(u64::MAX))).max()
    }

    fn by_roots(&self, rule: &FirstChange) -> impl Iterator<Item = Explaining<'_>> {
        self.spans().map(|(root, span)| Explaining {
            root: &root.path,
            since: span.since,
            how: Explanation::Earlier,
            from: Step(0),
            until: match root.spans.len() {
                RESTLESS.. => rule.forgets(span.until),
                _ => rule.explains_until(span.until),
            },
        })
    }

    /// What a root cause did leaves the interval, and what followed from it, though that may have been too small
    /// to show when it entered.
    fn by_leaving(&self, rule: &FirstChange) -> impl Iterator<Item = Explaining<'_>> {
        self.spans().filter_map(|(root, span)| {
            let (from, until) = rule.leaving(span)?;
            let how = Explanation::Leaving;
            Some(Explaining { root: &root.path, since: span.since, how, from, until })
        })
    }

    fn spans(&self) -> impl Iterator<Item = (&Root, Span)> {
        self.roots.iter().flat_map(|root| root.spans.iter().map(move |span| (root, *span)))
    }

    /// An effect of an effect explains nothing: there would be no end to it.
    fn by_effects(&self, rule: &FirstChange) -> impl Iterator<Item = Explaining<'_>> {
        let direct =
            |effect: &&Effect| matches!(effect.how, Explanation::Earlier | Explanation::Tie);
        self.effects.iter().filter(direct).map(|effect| Explaining {
            root: &effect.by,
            since: effect.since,
            how: Explanation::ByEffect,
            from: Step(0),
            until: rule.explains_until(effect.change.until),
        })
    }

    fn effect(
        &mut self,
        change: &KnownChange,
        by: ComponentPath,
        since: Step,
        how: Explanation,
    ) -> Reason {
        self.effects.push(Effect { change: change.clone(), by: by.clone(), since, how });
        Reason::Effect { by, since, how }
    }

    /// A root cause changes.
    fn enter(&mut self, change: &KnownChange) {
        match self.roots.iter_mut().find(|root| root.path == change.path) {
            Some(root) => root.spans.push(change.span()),
            None => {
                let (path, spans) = (change.path.clone(), vec![change.span()]);
                self.roots.push(Root { path, spans });
            }
        }
    }
}
