//! The rules of Zenoh's access control.
//!
//! Zenoh judges each message on the link that it arrives by, and identifies its sender by the common name
//! of the certificate. What is not allowed is denied.

use std::collections::BTreeSet;

use names::{ModuleName, StructureName};
use pki::holder::BearerName;
use pki::{CommonName, Generations, Holder};
use serde::Serialize;
use truss::Structure;
use wire::realm;

use super::gateway::Gateway;
use super::side::Linked;

/// Clients that are no part of the structure.
#[derive(Debug, Default)]
pub(super) struct People {
    pub(super) operators: BTreeSet<BearerName>,
    pub(super) observers: BTreeSet<BearerName>,
    /// Routers linked to the one that the rules are for.
    pub(super) routers: BTreeSet<Linked>,
    /// The fleet's router, if the rules are for a gateway.
    pub(super) gateway: Option<Gateway>,
    /// By which certificates these and the modules and the plant are admitted.
    pub(super) generations: Generations,
}

/// The table `access_control`.
#[derive(Debug, Serialize)]
pub(super) struct AccessControl {
    enabled: bool,
    default_permission: &'static str,
    rules: Vec<Rule>,
    subjects: Vec<Subject>,
    policies: Vec<Policy>,
    #[serde(skip)]
    generations: Generations,
}

#[derive(Debug, Serialize)]
pub(super) struct Rule {
    id: String,
    permission: &'static str,
    flows: [&'static str; 1],
    messages: Vec<&'static str>,
    key_exprs: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Subject {
    id: String,
    cert_common_names: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Policy {
    rules: Vec<String>,
    subjects: Vec<String>,
}

pub(super) const INCOMING: [&str; 1] = ["ingress"];
pub(super) const OUTGOING: [&str; 1] = ["egress"];

/// What the owner of a key does with it.
pub(super) const OWN: [&str; 5] =
    ["put", "delete", "declare_queryable", "reply", "liveliness_token"];
/// The parts of that.
pub(super) const PUBLISH: [&str; 2] = ["put", "delete"];
pub(super) const ANSWER: [&str; 2] = ["declare_queryable", "reply"];
pub(super) const SHOW: [&str; 1] = ["liveliness_token"];
/// What a subscriber does that also reads liveliness tokens.
pub(super) const LISTEN: [&str; 3] =
    ["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"];
/// The parts of that.
pub(super) const SUBSCRIBE: [&str; 1] = ["declare_subscriber"];
pub(super) const WATCH: [&str; 2] = ["liveliness_query", "declare_liveliness_subscriber"];
pub(super) const ASK: [&str; 1] = ["query"];
/// What others do with a key that they do not own.
pub(super) const REQUEST: [&str; 4] =
    ["declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"];

pub(super) const GET: &str = "gets what it may know";
pub(super) const ASKED: &str = "is asked and listened to";
pub(super) const HEAR: &str = "listens";
pub(super) const READ: &str = "asks what only tells";
const PEER: &str = "asks as a peer";
const PLANT: &str = "plant speaks";

impl AccessControl {
    /// What the modules of a structure, its plant and these people may do.
    pub(super) fn of(structure: &Structure, people: &People) -> Self {
        let name = &structure.name;
        let mut access = Self::of_rules(general_rules(structure), &people.generations);
        for module in structure.equipped() {
            let rule = speaks(&module.name);
            let keys = realm::of_module(name, &module.name);
            access.rules.push(allow(&rule, INCOMING, &OWN, keys));
            access.admit(name, Holder::Module(module.name.clone()), &[&rule, PEER]);
        }
        access.admit(name, Holder::Plant, &[PLANT]);
        for operator in &people.operators {
            let rule = orders(operator);
            if let Ok(known) = operator.to_string().parse() {
                let keys = realm::commands_of(name, &known);
                access.rules.push(allow(&rule, INCOMING, &ASK, keys));
            }
            access.admit(name, Holder::Operator(operator.clone()), &[&rule]);
        }
        for observer in &people.observers {
            access.admit(name, Holder::Observer(observer.clone()), &[]);
        }
        for linked in &people.routers {
            access.link(structure, &people.operators, linked);
        }
        if let Some(gateway) = &people.gateway {
            access.open(name, gateway);
        }
        access
    }

    /// These rules, and nobody yet to whom they apply.
    pub(super) fn of_rules(rules: Vec<Rule>, generations: &Generations) -> Self {
        Self {
            enabled: true,
            default_permission: "deny",
            rules,
            subjects: Vec::new(),
            policies: Vec::new(),
            generations: generations.clone(),
        }
    }

    /// Adds a rule; returns its name.
    pub(super) fn add(&mut self, rule: Rule) -> String {
        let id = rule.id.clone();
        self.rules.push(rule);
        id
    }

    /// Allows a router to pass on what those on its side may say, and nothing else.
    fn link(&mut self, structure: &Structure, operators: &BTreeSet<BearerName>, linked: &Linked) {
        let Linked { router, side } = linked;
        let modules = structure.equipped().map(|module| &module.name);
        let modules: Vec<_> =
            modules.filter(|name| side.includes(&Holder::Module((*name).clone()))).collect();
        let mut rules: Vec<String> = modules.iter().map(|name| speaks(name)).collect();
        if !modules.is_empty() {
            rules.push(PEER.to_owned());
        }
        if side.includes(&Holder::Plant) {
            rules.push(PLANT.to_owned());
        }
        let there =
            operators.iter().filter(|name| side.includes(&Holder::Operator((*name).clone())));
        rules.extend(there.map(orders));
        let rules: Vec<&str> = rules.iter().map(String::as_str).collect();
        self.admit(&structure.name, Holder::Router(router.clone()), &rules);
    }

    /// Allows a holder these rules and those of every known client.
    pub(super) fn admit(&mut self, structure: &StructureName, holder: Holder, rules: &[&str]) {
        self.admit_to(structure, holder, &[rules, &[HEAR, READ, GET, ASKED]].concat());
    }

    /// Allows a holder these rules and nothing else.
    pub(super) fn admit_to(&mut self, structure: &StructureName, holder: Holder, rules: &[&str]) {
        // A name that is too long for a certificate has none.
        if let Ok(name) = CommonName::new(self.generations.of(holder), structure.clone()) {
            self.permit(&name, rules);
        }
    }

    /// Allows whoever shows a certificate of this name these rules.
    pub(super) fn permit(&mut self, name: &CommonName, rules: &[&str]) {
        let id = name.to_string();
        self.subjects.push(Subject { id: id.clone(), cert_common_names: vec![id.clone()] });
        let rules = rules.iter().map(ToString::to_string).collect();
        self.policies.push(Policy { rules, subjects: vec![id] });
    }
}

pub(super) fn orders(operator: &BearerName) -> String {
    format!("{operator} orders")
}

fn speaks(module: &ModuleName) -> String {
    format!("{module} speaks")
}

fn general_rules(structure: &Structure) -> Vec<Rule> {
    let name = &structure.name;
    let mut plants = realm::of_plant(name);
    plants.extend(structure.equipped().map(|module| realm::samples(name, &module.name)));
    vec![
        allow(GET, OUTGOING, &OWN, realm::of_structure(name)),
        allow(ASKED, OUTGOING, &REQUEST, realm::everything()),
        allow(HEAR, INCOMING, &LISTEN, realm::everything()),
        allow(READ, INCOMING, &ASK, realm::readable()),
        allow(PEER, INCOMING, &ASK, vec![realm::questions_of_peers(name)]),
        allow(PLANT, INCOMING, &OWN, plants),
    ]
}

pub(super) fn allow(
    id: &str,
    flows: [&'static str; 1],
    messages: &[&'static str],
    key_exprs: Vec<String>,
) -> Rule {
    Rule { id: id.to_owned(), permission: "allow", flows, messages: messages.to_vec(), key_exprs }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{covers, rules_of};
    use super::*;

    fn access() -> serde_json::Value {
        let text = include_str!("../../../../../configs/tower.toml");
        let structure = Structure::from_toml(text).unwrap();
        let people = People {
            operators: BTreeSet::from(["ada".parse().unwrap()]),
            observers: BTreeSet::from(["wall".parse().unwrap()]),
            routers: [
                "all",
                "top=module2,operator.ada",
                "bottom=plant,module1",
                "wall=observer.wall",
            ]
            .map(|linked| linked.parse().unwrap())
            .into(),
            ..People::default()
        };
        serde_json::to_value(AccessControl::of(&structure, &people)).unwrap()
    }

    #[test]
    fn only_equipped_modules_may_write_and_each_only_its_own_keys() {
        let access = access();
        let subjects: Vec<_> =
            access["subjects"].as_array().unwrap().iter().map(|s| s["id"].clone()).collect();
        let expected = [
            "module1.tower",
            "module2.tower",
            "plant.tower",
            "operator.ada.tower",
            "observer.wall.tower",
            "router.all.tower",
            "router.bottom.tower",
            "router.top.tower",
            "router.wall.tower",
        ];
        assert_eq!(subjects, expected);
        assert!(rules_of(&access, "module1.tower").contains(&"module1 speaks".to_owned()));
        assert!(!rules_of(&access, "module2.tower").contains(&"module1 speaks".to_owned()));
    }

    #[test]
    fn an_operator_commands_in_his_own_name() {
        let access = access();
        let key = |rest: &str| format!("trusswatch/tower/module1/command/{rest}");
        assert!(covers(&access, "ada orders", &key("acknowledge/ada")));
        assert!(covers(&access, "ada orders", "trusswatch/tower/plant/command/inject"));
        for other in ["acknowledge/bob", "acknowledge", "acknowledge/*"] {
            assert!(!covers(&access, "ada orders", &key(other)), "{other}");
        }
    }

    #[test]
    fn a_router_passes_on_what_its_side_may_say() {
        let access = access();
        let rules = |router: &str| rules_of(&access, &format!("router.{router}.tower"));
        let (first, second) = ("module1 speaks", "module2 speaks");
        assert_eq!(
            rules("all"),
            [first, second, PEER, PLANT, "ada orders", HEAR, READ, GET, ASKED]
        );
        assert_eq!(rules("top"), [second, PEER, "ada orders", HEAR, READ, GET, ASKED]);
        assert_eq!(rules("bottom"), [first, PEER, PLANT, HEAR, READ, GET, ASKED]);
        assert_eq!(rules("wall"), [HEAR, READ, GET, ASKED]);
    }

    #[test]
    fn a_module_may_publish_its_own_identifications_and_observers_may_read_all() {
        let access = access();
        let own = "trusswatch/tower/module1/identification/sensor/g3";
        assert!(covers(&access, "module1 speaks", own));
        assert!(!covers(&access, "module2 speaks", own));
        assert!(covers(&access, READ, own) && covers(&access, HEAR, own));
        assert!(covers(&access, READ, "trusswatch/*/*/identification/**"));
    }

    #[test]
    fn observers_may_do_less_than_operators_and_both_write_nothing() {
        let access = access();
        let observer = rules_of(&access, "observer.wall.tower");
        let operator = rules_of(&access, "operator.ada.tower");
        assert_eq!(observer, [HEAR, READ, GET, ASKED]);
        assert_eq!(operator, ["ada orders", HEAR, READ, GET, ASKED]);
        for rule in access["rules"].as_array().unwrap() {
            let id = rule["id"].as_str().unwrap().to_owned();
            let incoming = rule["flows"][0] == "ingress";
            if incoming && operator.contains(&id) {
                let messages = rule["messages"].as_array().unwrap();
                assert!(!messages.contains(&"put".into()), "{rule}");
                assert!(!messages.contains(&"reply".into()), "{rule}");
            }
        }
    }
}
