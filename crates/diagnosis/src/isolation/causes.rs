//! The root causes so far and what they explain. Changes are taken in their order; each is judged once.

use vocabulary::{ComponentPath, Step};

use super::knowledge::{ChangePeriod, KnownChange};
use super::windows::Windows;

/// What leaves the interval looks like what entered it, up to this factor of its ratio.
const ALIKE: f64 = 3.0;

/// A fault that comes and is repaired changes so often, for both leave the interval. With more changes it comes and
/// goes. The Gaussian learns that and may show no more of them, so it explains for as long as the interval remembers.
const COMES_AND_IS_REPAIRED: usize = 4;

/// Why a change is a root cause or not.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
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
    /// It was a root cause before, and no later one explains it: it is repaired, is back again, or its fault leaves the
    /// interval.
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Explanation {
    /// The root cause changed before.
    Earlier,
    /// An effect of the root cause was still changing, had just been, or leaves: that may be another fault, hidden
    /// behind the root cause, with effects of its own.
    ByEffect,
    /// They are simultaneous, and the root cause outranks it.
    Tie,
    /// It is a cylinder that does what is demanded of it, as well as it can, and the root cause is faulty still.
    Demand,
    /// What happened then leaves the interval.
    Leaving,
}

/// A component that is a root cause, with its changes.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct Root {
    path: ComponentPath,
    changes: Vec<RootChange>,
    /// It comes and goes.
    restless: bool,
}

/// A change of a root cause.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct RootChange {
    period: ChangePeriod,
    /// An earlier one left the interval with it, so nothing that entered with it will leave.
    left: bool,
}

impl Root {
    fn enter(&mut self, windows: &Windows, period: ChangePeriod) {
        let leaves =
            |change: &RootChange| !change.left && windows.leaves(change.period, period.since);
        let left = self.changes.iter().any(leaves);
        self.changes.push(RootChange { period, left });
        let entered = self.changes.iter().filter(|change| !change.left).count();
        // As many without their leaving are as many faults.
        self.restless |=
            entered >= COMES_AND_IS_REPAIRED || self.changes.len() > COMES_AND_IS_REPAIRED;
    }
}

/// A change that is an effect.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
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
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Causes {
    roots: Vec<Root>,
    effects: Vec<Effect>,
    /// Components that are known to be faulty, and since when: what they did before may be forgotten.
    pub(super) faulty: Vec<(ComponentPath, Step)>,
}

impl Causes {
    /// Judges the first of `changes`, which follow those that were taken before, and all that are judged with
    /// it: one reason for each, in their order.
    pub(super) fn take(&mut self, windows: &Windows, changes: &[KnownChange]) -> Vec<Reason> {
        let Some(first) = changes.first() else { return Vec::new() };
        self.forget(windows, first.step);
        if let Some(reason) = self.explain(windows, first) {
            return vec![reason];
        }
        self.begin(windows, windows.simultaneous(changes, first))
    }

    /// Forgets what has left the interval, together with its effects.
    fn forget(&mut self, windows: &Windows, now: Step) {
        let lasts =
            |until: Option<Step>| windows.forgets(until).is_none_or(|forgotten| forgotten >= now);
        self.roots.retain_mut(|root| {
            root.changes.retain(|change| lasts(change.period.until));
            !root.changes.is_empty()
        });
        self.effects.retain(|effect| lasts(effect.change.until));
    }

    /// Explains a change that is an effect for certain.
    fn explain(&mut self, windows: &Windows, change: &KnownChange) -> Option<Reason> {
        if let Some(Effect { by, since, .. }) = self.entered(windows, change) {
            let (by, since) = (by.clone(), *since);
            return Some(self.effect(change, by, since, Explanation::Leaving));
        }
        if windows.is_root_by_ratio(change) {
            return None;
        }
        let Explaining { root, since, how, .. } = match self.root_since(change) {
            None => self.explaining(windows, change)?,
            Some(own) => self.explaining_root(windows, change, own)?,
        };
        let by = root.clone();
        Some(self.effect(change, by, since, how))
    }

    /// Begins with these simultaneous changes: one of them is the root cause.
    fn begin(&mut self, windows: &Windows, rivals: &[KnownChange]) -> Vec<Reason> {
        let Some(root) = self.choose(windows, rivals) else { return Vec::new() };
        if let Some(reasons) = self.explain_by_demand(rivals, root) {
            return reasons;
        }
        let before = self.explained_until(windows);
        let is_new = !self.is_root(root);
        let again = |change| match windows.is_root_by_ratio(change) {
            true => Reason::ByRatio,
            false => Reason::Again,
        };
        let reasons = rivals.iter().map(|change| {
            let is_again = change.path == root.path
                || (self.is_root(change) && (!is_new || windows.is_root_by_ratio(change)));
            if change != root && is_again {
                self.enter(windows, change);
                again(change)
            } else if change != root {
                let (by, since) = (root.path.clone(), root.step);
                match self.entered(windows, change) {
                    Some(Effect { by, since, .. }) => {
                        let (by, since) = (by.clone(), *since);
                        self.effect(change, by, since, Explanation::Leaving)
                    }
                    None => self.effect(change, by, since, Explanation::Tie),
                }
            } else if !is_new || before.is_some_and(|before| before >= root.step) {
                // A change that only its own effect explains: it was the root, but has been forgotten as one.
                again(change)
            } else {
                Reason::First { rivals: rivals.to_vec(), before }
            }
        });
        let reasons = reasons.collect();
        self.enter(windows, root);
        reasons
    }

    /// A component that is known to be faulty moves the demands of others for as long as it is not repaired.
    fn explain_by_demand(
        &mut self,
        rivals: &[KnownChange],
        root: &KnownChange,
    ) -> Option<Vec<Reason>> {
        if self.is_root(root) || !root.follows_demand() {
            return None;
        }
        let until = |(_, since): &&(ComponentPath, Step)| *since <= root.step;
        let (by, since) = self.faulty.iter().filter(until).max_by_key(|(_, since)| *since)?.clone();
        let of = |causes: &mut Self, change: &KnownChange| {
            causes.effect(change, by.clone(), since, Explanation::Demand)
        };
        Some(rivals.iter().map(|change| of(self, change)).collect())
    }

    /// The root cause among simultaneous changes: one that was a root cause before, unless another has the
    /// ratio of a root cause and outranks it; otherwise the one that outranks all others.
    fn choose<'a>(&self, windows: &Windows, rivals: &'a [KnownChange]) -> Option<&'a KnownChange> {
        let best = |among: &mut dyn Iterator<Item = &'a KnownChange>| {
            among.reduce(|best, change| if change.outranks(best) { change } else { best })
        };
        let known = best(&mut rivals.iter().filter(|change| self.is_root(change)));
        let is_new = |change: &&KnownChange| {
            !self.is_root(change) && self.entered(windows, change).is_none()
        };
        let new = best(&mut rivals.iter().filter(is_new));
        match (known, new) {
            (Some(known), Some(new)) if windows.is_root_by_ratio(new) && new.outranks(known) => {
                Some(new)
            }
            (Some(known), _) => Some(known),
            (None, new) => new,
        }
    }

    fn is_root(&self, change: &KnownChange) -> bool {
        self.root_since(change).is_some()
    }

    /// When the component of this change was a root cause last, if it was one before.
    fn root_since(&self, change: &KnownChange) -> Option<Step> {
        let changed = self.changes().filter(|(root, _)| root.path == change.path);
        let faulty = self.faulty.iter().filter(|(path, _)| *path == change.path);
        let since = changed.map(|(_, change)| change.period.since);
        since.chain(faulty.map(|(_, since)| *since).filter(|since| *since <= change.step)).max()
    }

    /// The effect in the same channel that leaves the interval with this change.
    fn entered(&self, windows: &Windows, change: &KnownChange) -> Option<&Effect> {
        self.effects.iter().rev().find(|effect| {
            let entered = &effect.change;
            entered.path == change.path
                && change.ratio <= ALIKE * entered.ratio
                && windows.leaves(entered.period(), change.step)
        })
    }

    /// What explains a change: the latest root cause, else the latest of the effects. Nothing explains itself: the
    /// effects of a root cause may outlast it.
    fn explaining(&self, windows: &Windows, change: &KnownChange) -> Option<Explaining<'_>> {
        let covers =
            |cause: &Explaining<'_>| cause.covers(change.onset) && *cause.root != change.path;
        let latest = |cause: &Explaining<'_>| cause.since;
        (self.by_roots(windows).filter(covers).max_by_key(latest))
            .or_else(|| self.by_effects(windows).filter(covers).max_by_key(latest))
            .or_else(|| self.by_leaving(windows).filter(covers).max_by_key(latest))
    }

    /// What explains a change of a component that was a root cause itself, last at step `own`: another that was one
    /// later. It may have been repaired meanwhile, and then shows effects as any healthy component does.
    fn explaining_root(
        &self,
        windows: &Windows,
        change: &KnownChange,
        own: Step,
    ) -> Option<Explaining<'_>> {
        let is_later = |cause: &Explaining<'_>| {
            cause.since > own && *cause.root != change.path && cause.covers(change.onset)
        };
        self.by_roots(windows).filter(is_later).max_by_key(|cause| cause.since)
    }

    /// The last step at which any root cause explains anything.
    fn explained_until(&self, windows: &Windows) -> Option<Step> {
        let causes = self.by_roots(windows).chain(self.by_effects(windows));
        causes.map(|cause| cause.until.unwrap_or(Step(u64::MAX))).max()
    }

    fn by_roots(&self, windows: &Windows) -> impl Iterator<Item = Explaining<'_>> {
        self.changes().map(|(root, RootChange { period, .. })| Explaining {
            root: &root.path,
            since: period.since,
            how: Explanation::Earlier,
            from: Step(0),
            until: match root.restless {
                true => windows.forgets(period.until),
                false => windows.explains_until(period.until),
            },
        })
    }

    /// What a root cause did leaves the interval, and what followed from it, though that may have been too small
    /// to show when it entered. What was taken for the leaving of one change may have been another, and leaves as well.
    fn by_leaving(&self, windows: &Windows) -> impl Iterator<Item = Explaining<'_>> {
        let entered = self.changes().filter(|(_, change)| !change.left);
        let of_roots = entered.map(|(root, RootChange { period, .. })| {
            (&root.path, period.since, period, Explanation::Leaving)
        });
        let leaving = self.effects.iter().filter(|effect| effect.how == Explanation::Leaving);
        let of_effects = leaving.map(|effect| {
            (&effect.by, effect.since, effect.change.period(), Explanation::ByEffect)
        });
        of_roots.chain(of_effects).filter_map(|(root, since, period, how)| {
            let (from, until) = windows.leaving(period)?;
            Some(Explaining { root, since, how, from, until })
        })
    }

    fn changes(&self) -> impl Iterator<Item = (&Root, RootChange)> {
        self.roots.iter().flat_map(|root| root.changes.iter().map(move |change| (root, *change)))
    }

    /// An effect of an effect explains nothing: there would be no end to it.
    fn by_effects(&self, windows: &Windows) -> impl Iterator<Item = Explaining<'_>> {
        let direct = |effect: &&Effect| effect.how != Explanation::ByEffect;
        self.effects.iter().filter(direct).map(|effect| Explaining {
            root: &effect.by,
            since: effect.since,
            how: Explanation::ByEffect,
            from: Step(0),
            until: windows.explains_until(effect.change.until),
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
    fn enter(&mut self, windows: &Windows, change: &KnownChange) {
        let place = self.roots.iter().position(|root| root.path == change.path);
        let place = place.unwrap_or_else(|| {
            let path = change.path.clone();
            self.roots.push(Root { path, changes: Vec::new(), restless: false });
            self.roots.len() - 1
        });
        self.roots[place].enter(windows, change.period());
    }
}
