//! A component's fault in readable form.

use observer::{StateRow, known_identification};
use terminal::Plot;
use vocabulary::{
    Candidate, FaultTransition, Identification, Signature, SignaturePoint, fault::FaultKind,
};

use super::frame::WIDEST;
use crate::paint::{Paint, tone_colour};
use crate::table::{TextTable, table};
use vocabulary::words::{candidate, fault_size, in_small_units, percent, utc};

/// The width of a drawing that is written to a file.
pub(super) const USUAL_WIDTH: u16 = 80;

/// Lines of a drawing: title, curves, steps.
const LINES: u16 = 14;

/// The text: the component's state, the kind of its fault, and the measurements.
pub(super) fn report(found: &FaultTransition, width: Option<u16>, paint: Paint) -> String {
    let row = StateRow::of_component(found);
    let FaultTransition { component, structure, .. } = found;
    if !found.state().is_fault() {
        let why = if row.why.is_empty() { String::new() } else { format!("; {}", row.why) };
        // The absence of a declared fault does not imply health; the state tells what is known.
        return format!("{component} of {structure}, no fault declared: {}{why}\n", row.state);
    }
    let mut rows = table(&[&component.to_string(), &format!("of {structure}")]);
    add_state(&mut rows, &row);
    let identification = known_identification(found);
    match identification {
        Some(identification) => add_identification(&mut rows, identification),
        None => rows.add_row(["kind", "not identified"]),
    }
    // The first row shows the state.
    let text = rows.painted(width, &[tone_colour(row.tone)], paint);
    let signature = identification.and_then(|identification| identification.signature.as_ref());
    let drawing = match signature {
        Some(signature) => drawing(signature, width.unwrap_or(USUAL_WIDTH), paint),
        None => "no measurements are kept\n".to_owned(),
    };
    format!("{text}\n\n{drawing}")
}

fn add_state(rows: &mut TextTable, row: &StateRow) {
    rows.add_row(["state".to_owned(), row.state.clone()]);
    if let Some(since) = row.since_unix_ns {
        rows.add_row(["since".to_owned(), utc(since)]);
    }
    if let Some(onset) = row.measured.onset_step {
        rows.add_row(["onset".to_owned(), format!("step {onset}")]);
    }
    if !row.why.is_empty() {
        rows.add_row(["why".to_owned(), row.why.clone()]);
    }
}

fn add_identification(rows: &mut TextTable, identification: &Identification) {
    let mut others = identification.candidates.as_slice();
    match (identification.kind(), &identification.candidates[..]) {
        (Some(decided), rest) => {
            rows.add_row(["kind", decided.kind.words()]);
            rows.add_row(["probability".to_owned(), percent(decided.probability)]);
            if let Some(size) = &decided.size {
                rows.add_row(["size".to_owned(), fault_size(size, decided.kind)]);
            }
            if let Some(note) = note(decided) {
                rows.add_row(["note", note]);
            }
            others = &rest[1..];
        }
        (None, []) => rows.add_row(["kind", "could not be identified"]),
        (None, _) => rows.add_row(["kind", "not yet decided"]),
    }
    for (place, other) in others.iter().enumerate() {
        let label = if place == 0 { "contenders" } else { "" };
        let text = format!("{}: {}", percent(other.probability), candidate(other));
        rows.add_row([label.to_owned(), text]);
    }
    let (step, time) = (identification.as_of_step, utc(identification.time_unix_ns));
    let latest = format!("as of step {step}, {time}");
    let identified = match identification.since_unix_ns {
        Some(since) => format!("{}; {latest}", utc(since)),
        None => latest,
    };
    rows.add_row(["identified".to_owned(), identified]);
}

/// A remark on an ambiguity of the kind: a structure that has become softer under a gage looks like a gage with too
/// large a gain.
fn note(decided: &Candidate) -> Option<&'static str> {
    let too_much = decided.size.as_ref().is_some_and(|size| size.value > 1.0);
    let is_gain = decided.kind.known() == Some(FaultKind::Gain);
    (is_gain && too_much).then_some("structure, or a gage that reads too much")
}

fn drawing(signature: &Signature, width: u16, paint: Paint) -> String {
    let (scale, title) = in_small_units(&signature.unit);
    #[expect(clippy::cast_precision_loss, reason = "a drawing")]
    let curve = |value: fn(&SignaturePoint) -> f64| {
        let points = signature.points.iter();
        points.map(|point| (point.step.0 as f64, scale * value(point))).collect()
    };
    let (points, fitted) = (curve(|point| point.measured), curve(|point| point.fitted));
    let plot = Plot { title: format!("  {title}"), points, fitted, ..Plot::default() };
    let text = plot.text(width.min(WIDEST), LINES, paint.has_colours());
    format!("{text}  {}\n", Plot::FIT_LEGEND)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::latched;
    use observer::testing::{identification, state};
    use vocabulary::{FaultSize, FaultState, IdentifiedKind, Step};

    fn sized(kind: FaultKind, probability: f64, interval: [f64; 3]) -> Candidate {
        let [low, value, high] = interval;
        let size = Some(FaultSize { value, low, high, own_unit: false });
        Candidate { kind: kind.into(), probability, size }
    }

    fn bias(probability: f64) -> Candidate {
        sized(FaultKind::Bias, probability, [44.8e-6, 45.1e-6, 45.4e-6])
    }

    fn fault(identification: Option<Identification>) -> FaultTransition {
        let identification = identification.map(Box::new);
        FaultTransition { identification, durable: true, ..latched("m1/sensor/g2") }
    }

    fn identified(decided: bool, candidates: Vec<Candidate>) -> FaultTransition {
        fault(Some(Identification { candidates, ..identification(decided, &[]) }))
    }

    fn text(found: &FaultTransition, width: Option<u16>) -> String {
        let text = report(found, width, Paint::NONE);
        text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn a_decided_fault_is_shown_with_size_and_interval() {
        let drift = sized(FaultKind::Drift, 0.0127, [8.95e-5, 9e-5, 9.05e-5]);
        let found = identified(true, vec![bias(0.9873), drift]);
        let expected = "  m1/sensor/g2   of tower
────────────────────────────────────────────────────────────
  state          latched
  since          1970-01-01T00:00:01.000Z
  onset          step 40
  kind           bias
  probability    98.7 %
  size           +45.1 µm (44.8 to 45.4)
  contenders     1.3 %: drift of +90.0 µm/s (89.5 to 90.5)
  identified     as of step 142, 1970-01-01T00:00:01.100Z

no measurements are kept";
        let text = text(&found, None);
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn a_fault_is_identified_when_its_kind_was_first_found() {
        let later = Identification {
            since_unix_ns: Some(1_050_000_000),
            ..identification(true, &["bias"])
        };
        let expected =
            "  identified     1970-01-01T00:00:01.050Z; as of step 142, 1970-01-01T00:00:01.100Z\n";
        let text = text(&fault(Some(later)), None);
        assert!(text.contains(expected), "{text}");
    }

    #[test]
    fn an_undecided_fault_is_shown_with_contenders() {
        let drift = sized(FaultKind::Drift, 0.4, [8.95e-5, 9e-5, 9.05e-5]);
        let text = text(&identified(false, vec![bias(0.6), drift]), None);
        for line in [
            "  kind           not yet decided\n",
            "  contenders     60.0 %: bias of +45.1 µm (44.8 to 45.4)\n",
            "                 40.0 %: drift of +90.0 µm/s (89.5 to 90.5)\n",
        ] {
            assert!(text.contains(line), "`{line}` is not in\n{text}");
        }
        assert!(!text.contains("probability"), "{text}");
    }

    #[test]
    fn an_unknown_kind_differs_from_a_missing_identification() {
        let nothing_fits = text(&identified(false, Vec::new()), None);
        assert!(nothing_fits.contains("kind           could not be identified"), "{nothing_fits}");
        let unidentified = text(&fault(None), None);
        assert!(unidentified.contains("kind           not identified\n"), "{unidentified}");
        assert!(unidentified.ends_with("no measurements are kept"), "{unidentified}");
    }

    #[test]
    fn a_fault_of_no_known_kind_is_shown_as_that_and_not_as_unidentified() {
        let none = Candidate { kind: IdentifiedKind::NoneOfThese, probability: 0.973, size: None };
        let text = text(&identified(true, vec![none]), None);
        assert!(text.contains("  kind           none of the known kinds\n"), "{text}");
        assert!(text.contains("probability    97.3 %") && !text.contains("size"), "{text}");
        assert!(text.contains("  state          latched\n"), "{text}");
    }

    #[test]
    fn a_gain_above_one_may_be_the_structure() {
        let gain = |value: f64| sized(FaultKind::Gain, 0.99, [value - 0.01, value, value + 0.01]);
        let noted = |value| {
            text(&identified(true, vec![gain(value)]), None)
                .contains("note           structure, or a gage that reads too much")
        };
        assert!(noted(1.05) && !noted(0.95));
    }

    #[test]
    fn what_was_measured_is_drawn_and_everything_fits_the_terminal() {
        let point = |step| {
            let fitted = if step < 1040 { 0.0 } else { 45.1e-6 };
            SignaturePoint { step: Step(step), measured: fitted + 1e-6, fitted }
        };
        let points = (1000..1120).map(point).collect();
        let signature = Some(Signature { unit: "m".to_owned(), points });
        let candidates = vec![bias(0.99)];
        let identification = Identification { candidates, signature, ..identification(true, &[]) };
        let found = fault(Some(identification));
        for width in [Some(40), Some(80), None] {
            let text = text(&found, width);
            let limit = usize::from(width.unwrap_or(USUAL_WIDTH));
            assert!(text.lines().all(|line| line.chars().count() <= limit), "{text}");
            for part in ["µm\n", "46┤", "step 1000", "1119\n", "⠒ measured"] {
                assert!(text.contains(part), "`{part}` is not in\n{text}");
            }
            assert!(!text.contains("nothing measured"), "{text}");
        }
    }

    #[test]
    fn a_component_without_declared_fault_is_shown_with_its_state() {
        let normal = text(&state("m1/sensor/g1", FaultState::Normal), None);
        assert_eq!(normal, "m1/sensor/g1 of tower, no fault declared: normal, not verified");
        let explained = FaultTransition {
            verdict: vocabulary::Verdict::Explained {
                by: "m2/actuator/a3".parse().unwrap(),
                since: Step(3100),
            },
            ..state("m1/sensor/g1", FaultState::Explained)
        };
        let expected = "m1/sensor/g1 of tower, no fault declared: explained; explained by \
                        m2/actuator/a3, which changed at step 3100";
        assert_eq!(text(&explained, None), expected);
    }
}
