//! Why a component is in the state that it is in.

use crate::printable;
use crate::{
    ComponentKind, Doubt, FaultTransition, GivenOrder, GivenOrderKind, ReplacedReading, Symptom,
    Verdict,
};

use super::aside::{asides, by_whom};
use super::doubt::why_unconfirmed;
use super::quantity::{in_own_unit, residual};
use super::time::utc;

/// Why it is in this state now, in words; empty if there is nothing to say beside the state. An order that ended a
/// shelving, a suppression or a shut-off is of the past.
#[must_use]
pub fn present_reason(transition: &FaultTransition) -> String {
    reasons(transition, |kind| !ends_aside(kind))
}

/// Why it changed to this state, in words; empty if there is nothing to say beside the state.
#[must_use]
pub fn reason(transition: &FaultTransition) -> String {
    reasons(transition, |_| true)
}

fn ends_aside(kind: GivenOrderKind) -> bool {
    use GivenOrderKind::{Lapse, PutBack, Unshelve, Unsuppress};
    matches!(kind, Unshelve | Unsuppress | PutBack | Lapse { .. })
}

fn reasons(transition: &FaultTransition, tells: impl Fn(GivenOrderKind) -> bool) -> String {
    let mut reasons = Vec::new();
    if transition.state().is_fault() {
        reasons.extend(symptom(transition));
        if transition.is_verified() {
            reasons.push("it agrees with its reference again".to_owned());
        }
    }
    reasons.extend(transition.reading.as_ref().map(should_read));
    if let Verdict::Explained { by, since } = &transition.verdict {
        reasons.push(format!("explained by {by}, which changed at step {since}"));
    }
    if let Some(root) = transition.disputed.as_ref().filter(|_| transition.state().is_fault()) {
        let module = &root.module;
        reasons.push(format!("disputed: explained by {root}, but {module} raises no alarm for it"));
    }
    if let Verdict::Unconfirmed { doubt } = &transition.verdict {
        reasons.push(why_unconfirmed(doubt));
        if let Doubt::Silent(modules) = doubt {
            let because = modules.iter().zip(&transition.silent_because);
            reasons.extend(because.map(|(module, why)| format!("{module}: {}", printable(why))));
        }
    }
    if let Some(unknown) = &transition.unknown {
        let since = utc(unknown.since_unix_ns);
        reasons.push(format!("not monitored since {since}: {}", printable(&unknown.reason)));
    }
    reasons.extend(transition.shut_off.as_ref().map(ordered));
    reasons.extend(asides(transition));
    reasons.extend(transition.state_order.as_deref().map(ordered));
    let order = transition.order.as_ref().filter(|order| tells(order.kind));
    reasons.extend(order.and_then(|order| beside(transition, order)));
    if !transition.durable {
        reasons.push("NOT IN THE JOURNAL".to_owned());
    }
    reasons.join("; ")
}

/// What a gage read, and what it should have read.
fn should_read(reading: &ReplacedReading) -> String {
    let micrometres = |value: f64| residual(ComponentKind::Sensor, value);
    let own = reading.own_m.map_or_else(|| "nothing usable".to_owned(), micrometres);
    let ends = reading.low_m.zip(reading.high_m);
    let should = reading.elongation_m.zip(ends).map(|(value, (low, high))| {
        let (low, high) = (low * 1e6, high * 1e6);
        format!("{} ({low:+.2} to {high:+.2})", micrometres(value))
    });
    let should = should.unwrap_or_else(|| "an unknown value".to_owned());
    format!("at step {} it read {own}, and should have read {should}", reading.step)
}

/// The order, unless what it began is said already.
fn beside(transition: &FaultTransition, given: &GivenOrder) -> Option<String> {
    match given.kind {
        GivenOrderKind::Shelve(_) if transition.shelved.is_some() => None,
        GivenOrderKind::Suppress(_) if transition.suppressed.is_some() => None,
        GivenOrderKind::ShutOff { .. } if transition.shut_off.is_some() => None,
        GivenOrderKind::Lapse { .. } if transition.aside().is_some() => {
            Some("shelving or suppression expired, the other continues".to_owned())
        }
        _ => Some(ordered(given)),
    }
}

fn symptom(transition: &FaultTransition) -> Option<String> {
    let departs = |what: &str| {
        let since = match (transition.before_service, transition.onset_step) {
            (true, _) | (_, None) => "already at the first comparison".to_owned(),
            (false, Some(step)) => format!("after it agreed up to step {}", step.minus(1)),
        };
        Some(format!("{what} departs from its reference, {since}"))
    };
    match transition.symptom {
        Symptom::Change => None,
        Symptom::NoSignal => Some("no signal".to_owned()),
        Symptom::Departure => {
            let evidence = transition.evidence.as_ref();
            let size = evidence
                .map(|e| residual(transition.component.component.kind(), e.residual - e.level));
            departs(&size.map_or("its mean".to_owned(), |size| format!("its mean, off by {size},")))
        }
        Symptom::OilContent => departs("its oil content"),
        Symptom::Scatter => departs("its noise"),
        Symptom::Reading => {
            let by = transition.evidence.as_ref().map(|e| in_own_unit(e.residual));
            let since = match (transition.before_service, transition.onset_step) {
                (false, Some(step)) => format!(", since step {step}"),
                _ => ", already at the first comparison".to_owned(),
            };
            let by = by.map_or_else(String::new, |by| format!(", off by {by}"));
            Some(format!("its reading is not what the other channels say{by}{since}"))
        }
    }
}

/// An order with its issuer and reason.
#[must_use]
pub fn ordered(given: &GivenOrder) -> String {
    let what = match given.kind {
        GivenOrderKind::Lapse { .. } => {
            return "shelving or suppression expired".to_owned();
        }
        GivenOrderKind::ReTare => "replaced, and its reference re-tared,".to_owned(),
        GivenOrderKind::Acknowledge => "acknowledged".to_owned(),
        GivenOrderKind::Reset { force: false } => "reset".to_owned(),
        GivenOrderKind::Reset { force: true } => "reset by force".to_owned(),
        GivenOrderKind::Shelve(span) => format!("shelved until {}", utc(span.until_unix_ns)),
        GivenOrderKind::Unshelve => "unshelved".to_owned(),
        GivenOrderKind::Suppress(span) => format!("suppressed until {}", utc(span.until_unix_ns)),
        GivenOrderKind::Unsuppress => "no longer suppressed, ordered".to_owned(),
        GivenOrderKind::ShutOff { since_unix_ns } => format!("shut off at {}", utc(since_unix_ns)),
        GivenOrderKind::PutBack => "put back".to_owned(),
        GivenOrderKind::Declare => "declared faulty".to_owned(),
    };
    let note =
        given.note.as_ref().map_or_else(String::new, |note| format!(": {}", printable(note)));
    format!("{what} by {}{note}", by_whom(&given.by, given.on_behalf_of.as_deref()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Shelving, Span};

    const SPAN: Span = Span { since_unix_ns: 1, until_unix_ns: 2_000_000_000 };

    fn shelving(until_unix_ns: u64) -> Shelving {
        Shelving {
            since_unix_ns: 1,
            until_unix_ns,
            by: "web".to_owned(),
            on_behalf_of: Some("ada".to_owned()),
            reason: "painting\u{1b}[2J".to_owned(),
        }
    }

    fn given(kind: GivenOrderKind) -> GivenOrder {
        GivenOrder {
            kind,
            by: "web".to_owned(),
            on_behalf_of: Some("ada".to_owned()),
            note: Some("painting".to_owned()),
        }
    }

    fn transition(shelved: bool, suppressed: bool, order: GivenOrderKind) -> FaultTransition {
        let component = "m1/sensor/g1".parse().unwrap();
        let untouched = FaultTransition::untouched("t".parse().unwrap(), component, 5);
        FaultTransition {
            shelved: shelved.then(|| shelving(2_000_000_000)),
            suppressed: suppressed.then(|| shelving(3_000_000_000)),
            order: Some(given(order)),
            ..untouched
        }
    }

    #[test]
    fn a_window_before_the_detection_is_no_agreement_of_a_fault() {
        use crate::{Condition, Step};
        let again = "it agrees with its reference again";
        let fault = |from, run_ended| FaultTransition {
            verdict: Verdict::Latched,
            detection_step: Some(Step(500)),
            run_ended,
            condition: Some(Condition::Agrees { from: Step(from), as_of: Step(from + 999) }),
            order: None,
            ..transition(false, false, GivenOrderKind::Acknowledge)
        };
        assert_eq!(reason(&fault(1, false)), "");
        assert_eq!(reason(&fault(500, false)), "");
        assert_eq!(reason(&fault(501, false)), again);
        assert_eq!(reason(&fault(1, true)), again, "the steps are those of another run");
    }

    #[test]
    fn what_is_set_aside_says_until_when_by_whom_and_why_and_says_it_once() {
        let shelved =
            r"shelved until 1970-01-01T00:00:02.000Z by ada (through web): painting\u{1b}[2J";
        let suppressed =
            r"suppressed until 1970-01-01T00:00:03.000Z by ada (through web): painting\u{1b}[2J";
        let of = |transition: FaultTransition| reason(&transition);
        assert_eq!(of(transition(true, false, GivenOrderKind::Shelve(SPAN))), shelved);
        let both = format!("{shelved}; {suppressed}");
        assert_eq!(of(transition(true, true, GivenOrderKind::Suppress(SPAN))), both);
        let acknowledged = format!("{shelved}; acknowledged by ada (through web): painting");
        assert_eq!(of(transition(true, false, GivenOrderKind::Acknowledge)), acknowledged);
        let mut later = transition(true, false, GivenOrderKind::Shelve(SPAN));
        later.state_order = Some(Box::new(given(GivenOrderKind::Acknowledge)));
        assert_eq!(of(later), acknowledged, "who acknowledged it is still known");
        let over = format!("{shelved}; shelving or suppression expired, the other continues");
        assert_eq!(of(transition(true, false, GivenOrderKind::Lapse { now_unix_ns: 5 })), over);
    }

    #[test]
    fn what_a_faulty_gage_should_read_stands_beside_what_it_reads() {
        let read = |own_m, elongation_m: Option<f64>| {
            let (low_m, high_m) = (elongation_m.map(|m| m - 1e-7), elongation_m.map(|m| m + 2e-7));
            let step = crate::Step(9);
            let reading = Some(ReplacedReading { step, own_m, elongation_m, low_m, high_m });
            let acknowledged = transition(false, false, GivenOrderKind::Acknowledge);
            reason(&FaultTransition { reading, order: None, ..acknowledged })
        };
        let both = "at step 9 it read +300.10 µm, and should have read -1.20 µm (-1.30 to -1.00)";
        assert_eq!(read(Some(300.1e-6), Some(-1.2e-6)), both);
        let neither = "at step 9 it read nothing usable, and should have read an unknown value";
        assert_eq!(read(None, None), neither);
    }

    #[test]
    fn a_cylinder_that_is_shut_off_says_so_until_it_is_put_back() {
        let order = GivenOrderKind::ShutOff { since_unix_ns: 2_000_000_000 };
        let mut shut_off = transition(false, false, order);
        shut_off.shut_off = Some(given(order));
        let said = "shut off at 1970-01-01T00:00:02.000Z by ada (through web): painting";
        assert_eq!(reason(&shut_off), said, "once");
        shut_off.order = Some(given(GivenOrderKind::Acknowledge));
        assert_eq!(
            reason(&shut_off),
            format!("{said}; acknowledged by ada (through web): painting")
        );
        let put_back = transition(false, false, GivenOrderKind::PutBack);
        assert_eq!(reason(&put_back), "put back by ada (through web): painting");
    }

    #[test]
    fn what_counts_again_says_why() {
        let of = |order| reason(&transition(false, false, order));
        let lapsed = "shelving or suppression expired";
        assert_eq!(of(GivenOrderKind::Lapse { now_unix_ns: 5 }), lapsed);
        let unshelved = "unshelved by ada (through web): painting";
        assert_eq!(of(GivenOrderKind::Unshelve), unshelved);
        let unsuppressed = "no longer suppressed, ordered by ada (through web): painting";
        assert_eq!(of(GivenOrderKind::Unsuppress), unsuppressed);
        for ended in [GivenOrderKind::Unshelve, GivenOrderKind::Unsuppress, GivenOrderKind::PutBack]
        {
            assert_eq!(present_reason(&transition(false, false, ended)), "", "not for ever");
        }
    }
}
