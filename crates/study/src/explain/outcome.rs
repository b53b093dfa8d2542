//! The outcome of a scenario and, if it is not exact, the reasons.

use super::account::{Account, Changed, Fate};
use super::words::times;
use super::{Line, LineKind};

/// A gage whose reading is not this many times its noise loses little when it reads nothing.
const CLEAR_READING: f64 = 10.0;

/// The last lines of a story.
pub(super) fn render(account: &Account) -> Vec<Line> {
    let mut lines = Lines { account, lines: Vec::new() };
    lines.verdict();
    if account.record.named().is_none() {
        lines.missed();
    }
    lines.false_alarms();
    lines.wrong();
    lines.lines
}

struct Lines<'a> {
    account: &'a Account<'a>,
    lines: Vec<Line>,
}

impl Lines<'_> {
    fn add(&mut self, kind: LineKind, text: String) {
        let step = names::Step(self.account.record.steps);
        self.lines.push(Line { time_s: self.account.clock().seconds(step), step, kind, text });
    }

    fn verdict(&mut self) {
        let record = &self.account.record;
        let clock = self.account.clock();
        let component = &record.component;
        let delays = record.detection_delay().zip(record.verdict_delay());
        let text = match delays.map(|(d, v)| (clock.span(d), clock.span(v))) {
            None => format!("missed: {component} is faulty and was not named"),
            Some((delay, verdict)) if record.is_exact() => format!(
                "exact: {component} was named and nothing else; changed {delay}, named {verdict} \
                 after the fault began"
            ),
            Some((_, verdict)) => format!(
                "not exact: {component} was named {verdict} after the fault began, but not alone"
            ),
        };
        self.add(LineKind::Outcome, text);
    }

    fn false_alarms(&mut self) {
        let record = &self.account.record;
        for early in record.diagnosed.iter().filter(|d| d.detection < record.onset) {
            let before = self.account.clock().span(record.onset.since(early.detection));
            let text = format!(
                "false alarm: {} was named for a change {before} before the fault began",
                early.component
            );
            self.add(LineKind::Because, text);
        }
    }

    fn wrong(&mut self) {
        let record = &self.account.record;
        for wrong in record.wrong().filter(|d| d.detection >= record.onset) {
            let text = format!("wrong: {} is healthy and was named", wrong.component);
            self.add(LineKind::Because, text);
        }
    }

    fn missed(&mut self) {
        let reason = match self.changes_after_onset().next() {
            Some(changed) => self.why_not_named(changed),
            None => self.why_not_changed(),
        };
        self.add(LineKind::Because, reason);
        if let Some(reading) = self.faint_reading() {
            self.add(LineKind::Because, reading);
        }
    }

    /// Changes of the faulty channel since the fault began.
    fn changes_after_onset(&self) -> impl Iterator<Item = &Changed> {
        let record = &self.account.record;
        let mut changes = self.account.changes.iter();
        std::iter::from_fn(move || {
            changes.find(|c| c.step >= record.onset && c.component == record.component)
        })
    }

    fn why_not_named(&self, changed: &Changed) -> String {
        let clock = self.account.clock();
        let at = clock.time(changed.step);
        match &changed.fate {
            Fate::Explained { root, .. } => {
                format!("its change at {at} was explained by {}", root.component)
            }
            Fate::Known { since } => format!(
                "it had been named already, for its change at {}, and is not judged again",
                clock.time(*since)
            ),
            Fate::Open | Fate::Fault { .. } => {
                format!("its change at {at} was not judged before the run ended")
            }
        }
    }

    fn why_not_changed(&self) -> String {
        match self.account.faulty_peak {
            Some((step, ratio)) if ratio < 1.0 => format!(
                "its divergence never reached its threshold: the largest after the fault began was \
                 {} the threshold, at {}",
                times(ratio),
                self.account.clock().time(step)
            ),
            Some((_, ratio)) => format!(
                "its divergence was above its threshold before the fault began, and going up to \
                 {} the threshold is no new change",
                times(ratio)
            ),
            None => "the run ended before the fault began".to_owned(),
        }
    }

    /// Why a gage that reads nothing any more is not missed.
    fn faint_reading(&self) -> Option<String> {
        let record = &self.account.record;
        let reading = record.reading_over_noise?;
        let silent = record.kind() == names::fault::FaultKind::ZeroOutput;
        (silent && reading < CLEAR_READING).then(|| {
            format!(
                "right before the fault the gage read only {} its noise: to read nothing instead \
                 changes little",
                times(reading)
            )
        })
    }
}
