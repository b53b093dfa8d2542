//! A structure's gateway: its router that is linked to the router of a fleet.

use std::collections::BTreeSet;
use std::str::FromStr;

use names::{OperatorName, StructureName};
use pki::{CommonName, Holder};
use wire::fleet::Crossing;

use super::rules::{
    ANSWER, ASK, AccessControl, INCOMING, OUTGOING, PUBLISH, SHOW, SUBSCRIBE, WATCH, allow,
};

/// The fleet's router as a gateway sees it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Gateway {
    /// By the certificate of the fleet's authority.
    pub(super) router: CommonName,
    /// Operators of the fleet who may issue commands in the structure.
    pub(super) operators: BTreeSet<OperatorName>,
}

/// What the rules are called.
const PUBLISHES: &str = "publishes to the fleet";
const SHOWS: &str = "the fleet sees who is there";
const ANSWERS: &str = "the fleet is answered";
const LISTENS: &str = "the fleet listens";
const WATCHES: &str = "the fleet watches who is there";
const ASKS: &str = "the fleet asks what only tells";
const ORDERS: &str = "the fleet orders";

impl AccessControl {
    /// Allows the fleet's router what leaves the structure and what may come in, and nothing else.
    pub(super) fn open(&mut self, structure: &StructureName, gateway: &Gateway) {
        let (own, any) = (Crossing::of(structure), Crossing::of_any());
        let mut answers = own.questions();
        let orders: Vec<String> =
            gateway.operators.iter().flat_map(|operator| own.commands_of(operator)).collect();
        if !orders.is_empty() {
            answers.extend(own.commands());
        }
        let mut rules = vec![
            allow(PUBLISHES, OUTGOING, &PUBLISH, own.news()),
            allow(SHOWS, OUTGOING, &SHOW, own.tokens()),
            allow(ANSWERS, OUTGOING, &ANSWER, answers),
            allow(LISTENS, INCOMING, &SUBSCRIBE, any.news()),
            allow(WATCHES, INCOMING, &WATCH, any.tokens()),
            allow(ASKS, INCOMING, &ASK, any.questions()),
        ];
        if !orders.is_empty() {
            rules.push(allow(ORDERS, INCOMING, &ASK, orders));
        }
        let rules: Vec<String> = rules.into_iter().map(|rule| self.add(rule)).collect();
        let rules: Vec<&str> = rules.iter().map(String::as_str).collect();
        self.permit(&gateway.router, &rules);
    }
}

/// `hub.fleet` or `hub.fleet=operator.ada,operator.bob`.
impl FromStr for Gateway {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (router, operators) = match text.split_once('=') {
            None => (text, BTreeSet::new()),
            Some((router, holders)) => {
                (router, holders.split(',').map(operator).collect::<Result<_, _>>()?)
            }
        };
        let named = router.strip_prefix("router.").unwrap_or(router);
        let wrong = || format!("`{named}` is no router of a fleet; `hub.fleet` is");
        let router = format!("router.{named}").parse::<CommonName>().map_err(|_| wrong())?;
        if !matches!(router.issued.holder, Holder::Router(_)) {
            return Err(wrong());
        }
        Ok(Gateway { router, operators })
    }
}

fn operator(text: &str) -> Result<OperatorName, String> {
    let text = text.trim();
    match text.parse::<Holder>() {
        Ok(Holder::Operator(name)) => name.to_string().parse().map_err(|error| format!("{error}")),
        _ => Err(format!("`{text}` is no operator; only commands of e.g. `operator.ada` come in")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::rules::{GET, HEAR, People, READ};
    use super::super::testing::{covers, rules_of};
    use super::*;
    use truss::Structure;

    #[test]
    fn of_the_structure_only_faults_phases_and_presence_leave_and_orders_of_operators_enter() {
        let text = include_str!("../../../../../configs/tower.toml");
        let gateway = Some("hub.fleet=operator.ada".parse().unwrap());
        let people = People { gateway, ..People::default() };
        let access = AccessControl::of(&Structure::from_toml(text).unwrap(), &people);
        let access = serde_json::to_value(access).unwrap();
        let rules = rules_of(&access, "router.hub.fleet");
        assert_eq!(rules, [PUBLISHES, SHOWS, ANSWERS, LISTENS, WATCHES, ASKS, ORDERS]);
        assert!(!rules.iter().any(|rule| [GET, HEAR, READ].contains(&rule.as_str())));
        let key = |rest: &str| format!("trusswatch/tower/module1/{rest}");
        for leaves in ["fault/sensor/g3", "identification/sensor/g3", "phase"] {
            assert!(covers(&access, PUBLISHES, &key(leaves)), "{leaves}");
            assert!(covers(&access, ASKS, &key(leaves)), "{leaves}");
        }
        assert!(covers(&access, ANSWERS, &key("history")) && covers(&access, SHOWS, &key("alive")));
        assert!(covers(&access, LISTENS, "trusswatch/*/*/fault/**"));
        for stays in ["sample", "divergence", "change", "status", "progress", "state"] {
            for rule in &rules {
                assert!(!covers(&access, rule, &key(stays)), "{rule}: {stays}");
                assert!(!covers(&access, rule, &format!("trusswatch/*/*/{stays}")), "{rule}");
            }
        }
        assert!(covers(&access, ORDERS, &key("command/acknowledge/ada")));
        for not in ["command/acknowledge/bob", "command/acknowledge", "command/*/*"] {
            assert!(!covers(&access, ORDERS, &key(not)), "{not}");
        }
        assert!(!covers(&access, ORDERS, "trusswatch/tower/plant/command/inject"));
        assert!(!covers(&access, PUBLISHES, "trusswatch/mast/module1/fault/sensor/g3"));
    }

    #[test]
    fn a_gateway_is_given_with_the_fleet_and_its_operators() {
        let one: Gateway = "hub.fleet".parse().unwrap();
        assert_eq!((one.router.to_string().as_str(), one.operators.len()), ("router.hub.fleet", 0));
        let two: Gateway = "router.hub~2.fleet=operator.ada, operator.bob".parse().unwrap();
        assert_eq!(two.router.to_string(), "router.hub~2.fleet");
        assert!(two.operators.iter().map(OperatorName::as_str).eq(["ada", "bob"]));
        for wrong in ["", "hub", "hub.fleet=", "hub.fleet=module1", "hub.fleet=observer.wall"] {
            assert!(wrong.parse::<Gateway>().is_err(), "{wrong}");
        }
    }
}
