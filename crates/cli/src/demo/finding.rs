//! What a module found about a component, in words.

use wire::Symptom;

use super::entry::{Departure, Verdict};
use wording::{residual, why_unconfirmed};

/// One line, or two if there is a reference to compare with.
pub(super) fn of(found: &Verdict) -> String {
    let Verdict { component, verdict, .. } = found;
    match verdict {
        wire::Verdict::Latched => format!("FAULT      {component}, {}", why_faulty(found)),
        wire::Verdict::Explained { by, .. } => {
            format!("explained  {component}, explained by {by}")
        }
        wire::Verdict::Unconfirmed { doubt } => {
            format!("open       {component}, unconfirmed: {}", why_unconfirmed(doubt))
        }
        other => format!("{:<10} {component}", other.as_str()),
    }
}

fn why_faulty(found: &Verdict) -> String {
    match (found.symptom, &found.departure) {
        (Symptom::NoSignal, _) => "for it gives no signal".to_owned(),
        (_, Some(departure)) => departs(found, *departure),
        (_, None) => {
            let after = found.detection_step.map_or(0, |detection| found.step.since(detection));
            format!("found {after} steps after its change")
        }
    }
}

fn departs(found: &Verdict, Departure { measured, expected, changed }: Departure) -> String {
    let how = match changed {
        true => "beside a change that something else may explain",
        false => "though no change showed",
    };
    let in_unit = |value: f64| match found.symptom {
        Symptom::OilContent => format!("{:.2} bar", value / 1e5),
        Symptom::Scatter => format!("{:.2} µm", value * 1e6),
        _ => residual(found.component.component.kind(), value),
    };
    let (measured, expected) = (in_unit(measured), in_unit(expected));
    let measured = match found.symptom {
        Symptom::OilContent => format!("a pressure of {measured}"),
        Symptom::Scatter => format!("a noise of {measured}"),
        _ => format!("{measured} off the module's model"),
    };
    format!(
        "{how}: it departs from its reference\n\
         on average {measured}, where {expected} is expected"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use names::Step;
    use wire::{Doubt, Verdict as Finding};

    fn verdict(verdict: Finding, component: &str) -> Verdict {
        Verdict {
            step: Step(9),
            component: component.parse().unwrap(),
            verdict,
            detection_step: Some(Step(3)),
            symptom: Symptom::Change,
            departure: None,
        }
    }

    #[test]
    fn an_open_verdict_states_why_it_is_open() {
        let open = |doubt| of(&verdict(Finding::Unconfirmed { doubt }, "m1/sensor/g1"));
        let m2 = || vec!["m2".parse().unwrap()];
        let lines =
            [open(Doubt::Silent(m2())), open(Doubt::Unknowing(m2())), open(Doubt::RunEnded)];
        let why = lines.map(|text| text.replace("open       m1/sensor/g1, unconfirmed: ", ""));
        let expected = [
            "no answer from m2",
            "m2 was not watching when it happened",
            "the run ended before there was a verdict",
        ];
        assert_eq!(why, expected);
    }

    #[test]
    fn a_fault_is_worded_by_what_it_rests_on() {
        let fault = |component, symptom, departure: Option<[f64; 2]>, changed| {
            let departure =
                departure.map(|[measured, expected]| Departure { measured, expected, changed });
            of(&Verdict { symptom, departure, ..verdict(Finding::Latched, component) })
        };
        let gage = |symptom, departure| fault("m1/sensor/g1", symptom, departure, false);
        assert_eq!(
            gage(Symptom::Change, None),
            "FAULT      m1/sensor/g1, found 6 steps after its change"
        );
        assert_eq!(
            gage(Symptom::NoSignal, None),
            "FAULT      m1/sensor/g1, for it gives no signal"
        );
        assert_eq!(
            gage(Symptom::Departure, Some([9.5e-5, -1e-6])),
            "FAULT      m1/sensor/g1, though no change showed: it departs from its reference\n\
             on average +95.00 µm off the module's model, where -1.00 µm is expected"
        );
        let frozen = gage(Symptom::Scatter, Some([0.0, 9e-7]));
        let noise = "on average a noise of 0.00 µm, where 0.90 µm is expected";
        assert!(frozen.ends_with(noise), "{frozen}");
        let oil = fault("m1/actuator/a1", Symptom::OilContent, Some([60e5, 61.25e5]), true);
        let pressure = "a pressure of 60.00 bar, where 61.25 bar is expected";
        assert!(oil.contains("beside a change") && oil.ends_with(pressure), "{oil}");
    }
}
