//! Why a component is in the state that it is in.

use wire::{FaultState, FaultTransition, GivenOrder, GivenOrderKind, Symptom};

use super::{by_whom, later_state, printable, residual, utc, why_unconfirmed};

/// In words; empty if there is nothing to say beside the state.
pub fn reason(transition: &FaultTransition) -> String {
    let mut reasons = Vec::new();
    if transition.state.is_fault() {
        reasons.extend(symptom(transition));
        if transition.is_verified() {
            reasons.push("it agrees with its reference again".to_owned());
        }
    }
    if let Some(root) = &transition.explained_by {
        let since = transition.explained_since_step;
        let since =
            since.map_or_else(String::new, |step| format!(", which changed at step {step}"));
        reasons.push(format!("explained by {root}{since}"));
    }
    if let Some(root) = transition.disputed.as_ref().filter(|_| transition.state.is_fault()) {
        let module = &root.module;
        reasons.push(format!("disputed: {root} explained it, but {module} raises no alarm for it"));
    }
    if transition.state == FaultState::Unconfirmed {
        let FaultTransition { doubt, silent, unknowing, one_of, .. } = transition;
        reasons.push(why_unconfirmed(*doubt, silent, unknowing, one_of));
        reasons.extend(transition.assumed.as_ref().map(ToString::to_string));
        let because = silent.iter().zip(&transition.silent_because);
        reasons.extend(because.map(|(module, why)| format!("{module}: {}", printable(why))));
    }
    reasons.extend(later_state(transition).map(str::to_owned));
    if let Some(unknown) = &transition.unknown {
        let since = utc(unknown.since_unix_ns);
        reasons.push(format!("not monitored since {since}: {}", printable(&unknown.reason)));
    }
    reasons.extend(transition.order.as_ref().map(ordered));
    if !transition.durable {
        reasons.push("NOT IN THE JOURNAL".to_owned());
    }
    reasons.join("; ")
}

fn symptom(transition: &FaultTransition) -> Option<String> {
    let departs = |what: &str| {
        let since = match (transition.before_service, transition.onset_step) {
            (true, _) | (_, None) => "already when it was first compared".to_owned(),
            (false, Some(step)) => format!("since step {step} at the earliest"),
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
        Symptom::Other => Some("it shows by something that only a later version knows".to_owned()),
    }
}

fn ordered(given: &GivenOrder) -> String {
    let end = given.until_unix_ns.map_or_else(String::new, |end| format!(" until {}", utc(end)));
    let what = match (given.order, given.force) {
        (GivenOrderKind::Lapse, _) => {
            return "counts again: the time for which it was set aside is over".to_owned();
        }
        (GivenOrderKind::Reset, _) if given.re_tare => {
            "replaced, and its reference re-tared,".to_owned()
        }
        (GivenOrderKind::Acknowledge, _) => "acknowledged".to_owned(),
        (GivenOrderKind::Reset, false) => "reset".to_owned(),
        (GivenOrderKind::Reset, true) => "reset by force".to_owned(),
        (GivenOrderKind::Shelve, _) => format!("shelved{end}"),
        (GivenOrderKind::Unshelve, _) => "unshelved".to_owned(),
        (GivenOrderKind::Suppress, _) => format!("suppressed{end}"),
        (GivenOrderKind::Unsuppress, _) => "no longer suppressed, ordered".to_owned(),
        (GivenOrderKind::Other, _) => "given an order that only a later version knows".to_owned(),
    };
    let note =
        given.note.as_ref().map_or_else(String::new, |note| format!(": {}", printable(note)));
    format!("{what} by {}{note}", by_whom(&given.by, given.on_behalf_of.as_deref()))
}
