//! Rules as tests read them.

use serde_json::Value;
use zenoh::key_expr::KeyExpr;

/// The rules of a subject.
pub(super) fn rules_of(access: &Value, subject: &str) -> Vec<String> {
    let policies = access["policies"].as_array().unwrap();
    let policy = policies.iter().find(|policy| policy["subjects"][0] == subject).unwrap();
    let rules = policy["rules"].as_array().unwrap();
    rules.iter().map(|rule| rule.as_str().unwrap().to_owned()).collect()
}

/// Does a rule cover this key?
pub(super) fn covers(access: &Value, rule: &str, key: &str) -> bool {
    let rules = access["rules"].as_array().unwrap();
    let rule = rules.iter().find(|known| known["id"] == rule).unwrap();
    let key = KeyExpr::try_from(key.to_owned()).unwrap();
    let expressions = rule["key_exprs"].as_array().unwrap().iter();
    expressions
        .map(|expression| KeyExpr::try_from(expression.as_str().unwrap().to_owned()).unwrap())
        .any(|expression| expression.includes(&key))
}
