//! Malformed or hostile queries and commands, on every key that a diagnoser answers on.

use serde_json::{Value, json};

/// As long as a text gets.
const LONG: usize = 1 << 16;
/// One command in this many is longer than a message may be.
const OVERSIZED_EVERY: u64 = 499;

/// A query: its selector and its payload.
pub type Question = (String, Option<Vec<u8>>);

/// The queries of one key, sent in turn.
pub struct Questions {
    /// The key's last part.
    pub topic: &'static str,
    /// Malformed ones.
    malformed: Vec<Question>,
    /// Well-formed ones, though they may be refused.
    sensible: Vec<Question>,
    /// A rare one.
    rare: Option<(u64, Question, bool)>,
}

impl Questions {
    /// The query at a place in the sequence, and whether it is malformed.
    #[must_use]
    pub fn at(&self, place: u64) -> (&Question, bool) {
        if let Some((every, question, malformed)) = &self.rare
            && place % every == every / 2
        {
            return (question, *malformed);
        }
        let place = place as usize % (self.malformed.len() + self.sensible.len());
        match self.malformed.get(place) {
            Some(question) => (question, true),
            None => (&self.sensible[place - self.malformed.len()], false),
        }
    }
}

/// Those for every key under `base`, a module's, which has come to `step` of `run`.
#[must_use]
pub fn questions(base: &str, run: u64, step: u64) -> Vec<Questions> {
    vec![
        state(&format!("{base}/state"), run, step),
        of_components("fault/**", &format!("{base}/fault")),
        of_components("identification/**", &format!("{base}/identification")),
        phase(&format!("{base}/phase")),
        history(&format!("{base}/history")),
        orders("command/acknowledge", &format!("{base}/command/acknowledge")),
        orders("command/reset", &format!("{base}/command/reset")),
    ]
}

fn with_parameters(key: &str, parameters: &[String]) -> Vec<Question> {
    parameters.iter().map(|parameters| (format!("{key}?{parameters}"), None)).collect()
}

fn state(key: &str, run: u64, step: u64) -> Questions {
    let malformed = [
        String::new(),
        "from=0&step=5".into(),
        "run=0&from=0".into(),
        "run=0&step=5".into(),
        "run=0&from=x&step=5".into(),
        "run=0&from=6&step=5".into(),
        "run=0&from=-1&step=2".into(),
        "run=0&from=1e3&step=2000".into(),
        "run=0&from=1&from=2&step=3".into(),
        "run=0&from=0&step=18446744073709551616".into(),
        "from=0&step=1&run=%00".into(),
        format!("run=0&from={}&step=1", "9".repeat(LONG)),
        "&;=&&;;==\u{1}\u{feff}".repeat(50),
    ];
    let sensible = [
        format!("run={run}&from=0&step=0"),
        format!("run={run}&from=0&step={step}"),
        format!("run={run};from={step};step={step}"),
        format!("run={run}&from=0&step=18446744073709551615"),
        format!("run={run}&from=18446744073709551615&step=18446744073709551615"),
        "from=0&step=0&run=0".into(),
        "from=0&step=0&run=18446744073709551615".into(),
        format!("run={run}&from=0&step=1&x={}", "y".repeat(LONG)),
    ];
    // So far ahead that it is held until the client has timed out.
    let held = (format!("{key}?run={run}&from=0&step={}", step + 50_000), None);
    Questions {
        topic: "state",
        malformed: with_parameters(key, &malformed),
        sensible: with_parameters(key, &sensible),
        rare: Some((1009, held, false)),
    }
}

/// Everything that the key covers is returned, so nothing is malformed here.
fn of_components(topic: &'static str, key: &str) -> Questions {
    let asked = [
        format!("{key}/sensor/g1"),
        format!("{key}/actuator/a1?from=-1&junk={}", "x".repeat(1000)),
        format!("{key}/sensor/nobody"),
        format!("{key}/sensor/../x"),
        format!("{key}/{}", "deep/".repeat(200) + "end"),
        format!("{key}/{}", "x".repeat(LONG / 2)),
        format!("{key}/{}**", "*/".repeat(20)),
        format!("{key}/sensor/$*g$*9$*"),
    ];
    let all = (format!("{key}/**"), Some(vec![0xff; 1000]));
    Questions {
        topic,
        malformed: Vec::new(),
        sensible: asked.into_iter().map(|selector| (selector, None)).collect(),
        rare: Some((11, all, false)),
    }
}

/// Whatever stands behind it, it is the question for the phase.
fn phase(key: &str) -> Questions {
    let sensible = [String::new(), "since=x&since=y".into(), format!("junk={}", "x".repeat(LONG))];
    Questions {
        topic: "phase",
        malformed: Vec::new(),
        sensible: with_parameters(key, &sensible),
        rare: None,
    }
}

fn history(key: &str) -> Questions {
    let malformed = [
        "since=x".into(),
        "since=-1".into(),
        "since=1&since=2".into(),
        "since=18446744073709551616".into(),
        "limit=1.5".into(),
        format!("limit={}", "9".repeat(LONG)),
    ];
    let sensible = [
        String::new(),
        "since=0&limit=0".into(),
        "since=18446744073709551615&limit=18446744073709551615".into(),
        format!("junk={}", "x".repeat(LONG)),
    ];
    Questions {
        topic: "history",
        malformed: with_parameters(key, &malformed),
        sensible: with_parameters(key, &sensible),
        rare: None,
    }
}

fn orders(topic: &'static str, key: &str) -> Questions {
    let with = |payload: Option<Vec<u8>>| (key.to_owned(), payload);
    let order = |component: &str, by: Value| {
        let order = json!({"v": 1, "component": component, "by": by, "force": true});
        with(Some(serde_json::to_vec(&order).unwrap()))
    };
    let malformed = vec![
        with(None),
        with(Some(Vec::new())),
        with(Some(b"reset everything".to_vec())),
        with(Some(vec![0xff; 500])),
        with(Some(vec![b'{'; LONG])),
        with(Some(b"{\"v\":9}".to_vec())),
        with(Some(b"{\"v\":1}".to_vec())),
        order("sensor/g1", json!("")),
        order("sensor/g1", json!("x".repeat(LONG))),
        order("sensor/g1", json!(12)),
        order("sensor/../../etc", json!("mallory")),
        order(&"x".repeat(LONG), json!("mallory")),
    ];
    let sensible = vec![
        order("sensor/nobody", json!("mallory")),
        order("actuator/g1", json!("mallory")),
        order("sensor/g1", json!("mallory")),
        order("actuator/a1", json!("x".repeat(vocabulary::MAX_ORDER_TEXT))),
    ];
    let oversized = with(Some(vec![b' '; vocabulary::MAX_MESSAGE_BYTES + 1]));
    Questions { topic, malformed, sensible, rare: Some((OVERSIZED_EVERY, oversized, true)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{HistoryQuestion, Order, StateQuestion};
    use zenoh::query::Selector;

    fn is_malformed(topic: &str, (selector, payload): &Question) -> bool {
        let selector = Selector::try_from(selector.as_str()).unwrap();
        let parameters = selector.parameters().as_str();
        match topic {
            "state" => StateQuestion::from_parameters(parameters).is_err(),
            "history" => HistoryQuestion::from_parameters(parameters).is_err(),
            "fault/**" | "identification/**" | "phase" => false,
            _ => payload.as_ref().is_none_or(|payload| {
                vocabulary::decode::<Order>(payload)
                    .map_or(true, |order| order.check(vocabulary::OrderKind::Acknowledge).is_err())
            }),
        }
    }

    #[test]
    fn every_question_can_be_asked_and_is_what_it_is_called() {
        for questions in questions("trusswatch/tower/module1", 7, 5000) {
            for place in 0..20_000 {
                let (question, malformed) = questions.at(place);
                let start = || question.0.chars().take(120).collect::<String>();
                assert_eq!(is_malformed(questions.topic, question), malformed, "{}", start());
            }
        }
    }
}
