//! Access control rules in Zenoh's settings: the permissions of modules, plant, routers and users. All other access is
//! denied.

use std::collections::BTreeSet;

use pki::holder::BearerName;
use pki::{CommonName, Generations, Holder};
use serde_json::{Value, json};
use truss::Structure;
use vocabulary::{ModuleName, OperatorName, StructureName, fleet::Crossing, realm};

use super::parties::{Fleet, Gateway, Linked, People};

const INCOMING: &str = "ingress";
const OUTGOING: &str = "egress";

/// The messages that the owner of a key may send on it.
const OWN: &[&str] = &["put", "delete", "declare_queryable", "reply", "liveliness_token"];
/// Publishing, a part of `OWN`.
const PUBLISH: &[&str] = &["put", "delete"];
const ANSWER: &[&str] = &["declare_queryable", "reply"];
const SHOW: &[&str] = &["liveliness_token"];
/// The messages of a subscriber that also reads liveliness tokens.
const LISTEN: &[&str] =
    &["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"];
/// Subscribing, a part of `LISTEN`.
const SUBSCRIBE: &[&str] = &["declare_subscriber"];
const WATCH: &[&str] = &["liveliness_query", "declare_liveliness_subscriber"];
const ASK: &[&str] = &["query"];
/// The messages that other clients may send on a key.
const REQUEST: &[&str] =
    &["declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"];

const GET: &str = "receive publications and replies";
const ASKED: &str = "receive queries and subscriptions";
const HEAR: &str = "subscribe";
const READ: &str = "query";
const PEER: &str = "query as a peer";
const PLANT: &str = "publish as plant";
const LISTENS: &str = "fleet subscribes";
const WATCHES: &str = "fleet reads liveliness";
const ASKS: &str = "fleet queries";
const PUBLISHES: &str = "publish to fleet";
const SHOWS: &str = "liveliness to fleet";
const ANSWERS: &str = "reply to fleet";
const ORDERS: &str = "fleet commands";

/// The table `access_control` for the modules of a structure, its plant and these users.
pub(super) fn of_structure(structure: &Structure, people: &People) -> Value {
    let name = &structure.name;
    let mut access = AccessRules::new(&people.generations);
    access.add_general_rules(structure);
    for module in structure.equipped() {
        let rule = publish_as(&module.name);
        access.allow(&rule, INCOMING, OWN, realm::of_module(name, &module.name));
        access.admit(name, Holder::Module(module.name.clone()), &[&rule, PEER]);
    }
    access.admit(name, Holder::Plant, &[PLANT]);
    for operator in &people.operators {
        let rule = command_as(operator);
        if let Ok(known) = operator.to_string().parse() {
            access.allow(&rule, INCOMING, ASK, realm::commands_of(name, &known));
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
    access.table()
}

/// The table `access_control` for the gateways and the users of a fleet.
pub(super) fn of_fleet(fleet: &Fleet) -> Value {
    let any = Crossing::of_any();
    let mut access = AccessRules::new(&fleet.people.generations);
    access.allow(GET, OUTGOING, OWN, realm::everything());
    access.allow(ASKED, OUTGOING, REQUEST, realm::everything());
    access.allow(HEAR, INCOMING, LISTEN, realm::everything());
    access.allow(READ, INCOMING, ASK, realm::readable());
    access.allow(LISTENS, OUTGOING, SUBSCRIBE, any.news());
    access.allow(WATCHES, OUTGOING, WATCH, any.tokens());
    access.allow(ASKS, OUTGOING, ASK, any.questions());
    for structure in &fleet.structures {
        access.join(&fleet.name, structure);
    }
    for operator in &fleet.people.operators {
        let rule = command_as(operator);
        if let Ok(known) = operator.to_string().parse::<OperatorName>() {
            let structures = fleet.structures.iter();
            let keys = structures.flat_map(|structure| Crossing::of(structure).commands_of(&known));
            access.allow(&rule, INCOMING, ASK, keys.collect());
            access.admit(&fleet.name, Holder::Operator(operator.clone()), &[&rule]);
        }
    }
    for observer in &fleet.people.observers {
        access.admit(&fleet.name, Holder::Observer(observer.clone()), &[]);
    }
    access.table()
}

/// The entries of the table `access_control`.
struct AccessRules<'a> {
    rules: Vec<Value>,
    subjects: Vec<Value>,
    policies: Vec<Value>,
    generations: &'a Generations,
}

impl<'a> AccessRules<'a> {
    fn new(generations: &'a Generations) -> Self {
        Self { rules: Vec::new(), subjects: Vec::new(), policies: Vec::new(), generations }
    }

    fn table(self) -> Value {
        json!({
            "enabled": true,
            "default_permission": "deny",
            "rules": self.rules,
            "subjects": self.subjects,
            "policies": self.policies,
        })
    }

    fn add_general_rules(&mut self, structure: &Structure) {
        let name = &structure.name;
        let mut plants = realm::of_plant(name);
        plants.extend(structure.equipped().map(|module| realm::samples(name, &module.name)));
        self.allow(GET, OUTGOING, OWN, realm::of_structure(name));
        self.allow(ASKED, OUTGOING, REQUEST, realm::everything());
        self.allow(HEAR, INCOMING, LISTEN, realm::everything());
        self.allow(READ, INCOMING, ASK, realm::readable());
        self.allow(PEER, INCOMING, ASK, vec![realm::questions_of_peers(name)]);
        self.allow(PLANT, INCOMING, OWN, plants);
    }

    /// Permits a router to forward the messages of the holders on its side, and nothing else.
    fn link(&mut self, structure: &Structure, operators: &BTreeSet<BearerName>, linked: &Linked) {
        let modules = structure.equipped().map(|module| &module.name);
        let modules: Vec<_> =
            modules.filter(|name| linked.passes_on(&Holder::Module((*name).clone()))).collect();
        let mut rules: Vec<String> = modules.iter().map(|name| publish_as(name)).collect();
        if !modules.is_empty() {
            rules.push(PEER.to_owned());
        }
        if linked.passes_on(&Holder::Plant) {
            rules.push(PLANT.to_owned());
        }
        let there =
            operators.iter().filter(|name| linked.passes_on(&Holder::Operator((*name).clone())));
        rules.extend(there.map(command_as));
        let rules: Vec<&str> = rules.iter().map(String::as_str).collect();
        self.admit(&structure.name, Holder::Router(linked.router.clone()), &rules);
    }

    /// Permits the fleet's router to exchange the messages that may leave or enter the structure, and nothing else.
    fn open(&mut self, structure: &StructureName, gateway: &Gateway) {
        let (own, any) = (Crossing::of(structure), Crossing::of_any());
        let mut answers = own.questions();
        let orders: Vec<String> =
            gateway.operators.iter().flat_map(|operator| own.commands_of(operator)).collect();
        if !orders.is_empty() {
            answers.extend(own.commands());
        }
        let mut rules = vec![PUBLISHES, SHOWS, ANSWERS, LISTENS, WATCHES, ASKS];
        self.allow(PUBLISHES, OUTGOING, PUBLISH, own.news());
        self.allow(SHOWS, OUTGOING, SHOW, own.tokens());
        self.allow(ANSWERS, OUTGOING, ANSWER, answers);
        self.allow(LISTENS, INCOMING, SUBSCRIBE, any.news());
        self.allow(WATCHES, INCOMING, WATCH, any.tokens());
        self.allow(ASKS, INCOMING, ASK, any.questions());
        if !orders.is_empty() {
            self.allow(ORDERS, INCOMING, ASK, orders);
            rules.push(ORDERS);
        }
        self.permit(&gateway.router, &rules);
    }

    /// Permits the gateway of a structure, a router with the structure's name, to publish and reply for the structure,
    /// and to receive its queries.
    fn join(&mut self, fleet: &StructureName, structure: &StructureName) {
        let own = Crossing::of(structure);
        let answers = [own.questions(), own.commands()].concat();
        let does = |what: &str| format!("{structure} {what}");
        let rules = [
            does("publishes"),
            does("declares liveliness"),
            does("replies"),
            does("receives commands"),
        ];
        self.allow(&rules[0], INCOMING, PUBLISH, own.news());
        self.allow(&rules[1], INCOMING, SHOW, own.tokens());
        self.allow(&rules[2], INCOMING, ANSWER, answers);
        self.allow(&rules[3], OUTGOING, ASK, own.commands());
        let own = rules.iter().map(String::as_str);
        let rules: Vec<&str> = own.chain([LISTENS, WATCHES, ASKS]).collect();
        // Every structure name is also a valid router name.
        if let Ok(name) = structure.to_string().parse() {
            self.admit_to(fleet, Holder::Router(name), &rules);
        }
    }

    /// Grants a holder these rules and those of every known client.
    fn admit(&mut self, structure: &StructureName, holder: Holder, rules: &[&str]) {
        self.admit_to(structure, holder, &[rules, &[HEAR, READ, GET, ASKED]].concat());
    }

    /// Grants a holder these rules only.
    fn admit_to(&mut self, structure: &StructureName, holder: Holder, rules: &[&str]) {
        // A holder whose common name is too long for a certificate has none.
        if let Ok(name) = CommonName::new(self.generations.of(holder), structure.clone()) {
            self.permit(&name, rules);
        }
    }

    /// Grants these rules to the certificate with this name.
    fn permit(&mut self, name: &CommonName, rules: &[&str]) {
        let id = name.to_string();
        self.subjects.push(json!({ "id": id, "cert_common_names": [id] }));
        self.policies.push(json!({ "subjects": [id], "rules": rules }));
    }

    /// Adds a rule. It takes effect once [`Self::permit`] grants it to a holder.
    fn allow(&mut self, id: &str, flow: &str, messages: &[&str], keys: Vec<String>) {
        self.rules.push(json!({
            "id": id,
            "permission": "allow",
            "flows": [flow],
            "messages": messages,
            "key_exprs": keys,
        }));
    }
}

fn command_as(operator: &BearerName) -> String {
    format!("command as {operator}")
}

fn publish_as(module: &ModuleName) -> String {
    format!("publish as {module}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use zenoh::key_expr::KeyExpr;

    /// The rules of a subject.
    fn rules_of(access: &Value, subject: &str) -> Vec<String> {
        let policies = access["policies"].as_array().unwrap();
        let policy = policies.iter().find(|policy| policy["subjects"][0] == subject).unwrap();
        let rules = policy["rules"].as_array().unwrap();
        rules.iter().map(|rule| rule.as_str().unwrap().to_owned()).collect()
    }

    /// Whether a rule covers this key.
    fn covers(access: &Value, rule: &str, key: &str) -> bool {
        let rules = access["rules"].as_array().unwrap();
        let rule = rules.iter().find(|known| known["id"] == rule).unwrap();
        let key = KeyExpr::try_from(key.to_owned()).unwrap();
        let expressions = rule["key_exprs"].as_array().unwrap().iter();
        expressions
            .map(|expression| KeyExpr::try_from(expression.as_str().unwrap().to_owned()).unwrap())
            .any(|expression| expression.includes(&key))
    }

    fn access() -> Value {
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
        of_structure(&structure, &people)
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
        assert!(rules_of(&access, "module1.tower").contains(&"publish as module1".to_owned()));
        assert!(!rules_of(&access, "module2.tower").contains(&"publish as module1".to_owned()));
    }

    #[test]
    fn an_operator_commands_only_under_the_own_name() {
        let access = access();
        let key = |rest: &str| format!("trusswatch/tower/module1/command/{rest}");
        assert!(covers(&access, "command as ada", &key("acknowledge/ada")));
        assert!(covers(&access, "command as ada", "trusswatch/tower/plant/command/inject"));
        for other in ["acknowledge/bob", "acknowledge", "acknowledge/*"] {
            assert!(!covers(&access, "command as ada", &key(other)), "{other}");
        }
    }

    #[test]
    fn a_router_forwards_messages_of_its_side() {
        let access = access();
        let rules = |router: &str| rules_of(&access, &format!("router.{router}.tower"));
        let (first, second) = ("publish as module1", "publish as module2");
        assert_eq!(
            rules("all"),
            [first, second, PEER, PLANT, "command as ada", HEAR, READ, GET, ASKED]
        );
        assert_eq!(rules("top"), [second, PEER, "command as ada", HEAR, READ, GET, ASKED]);
        assert_eq!(rules("bottom"), [first, PEER, PLANT, HEAR, READ, GET, ASKED]);
        assert_eq!(rules("wall"), [HEAR, READ, GET, ASKED]);
    }

    #[test]
    fn a_module_may_publish_its_own_identifications_and_observers_may_read_all() {
        let access = access();
        let own = "trusswatch/tower/module1/identification/sensor/g3";
        assert!(covers(&access, "publish as module1", own));
        assert!(!covers(&access, "publish as module2", own));
        assert!(covers(&access, READ, own) && covers(&access, HEAR, own));
        assert!(covers(&access, READ, "trusswatch/*/*/identification/**"));
    }

    #[test]
    fn observers_have_fewer_rights_than_operators_and_neither_may_publish() {
        let access = access();
        let observer = rules_of(&access, "observer.wall.tower");
        let operator = rules_of(&access, "operator.ada.tower");
        assert_eq!(observer, [HEAR, READ, GET, ASKED]);
        assert_eq!(operator, ["command as ada", HEAR, READ, GET, ASKED]);
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

    #[test]
    fn a_gateway_forwards_faults_phases_presence_and_commands_of_operators_only() {
        let text = include_str!("../../../../../configs/tower.toml");
        let gateway = Some("hub.fleet=operator.ada".parse().unwrap());
        let people = People { gateway, ..People::default() };
        let access = of_structure(&Structure::from_toml(text).unwrap(), &people);
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

    fn fleet_access() -> Value {
        let people = People {
            operators: BTreeSet::from(["ada".parse().unwrap()]),
            observers: BTreeSet::from(["wall".parse().unwrap()]),
            generations: Generations::default(),
            ..People::default()
        };
        let structures = ["tower", "mast"].map(|name| name.parse().unwrap()).into();
        let fleet = Fleet { name: "fleet".parse().unwrap(), structures, people };
        of_fleet(&fleet)
    }

    #[test]
    fn a_gateway_publishes_for_its_structure_only() {
        let access = fleet_access();
        let rules = rules_of(&access, "router.tower.fleet");
        assert!(
            !rules
                .iter()
                .any(|rule| rule.starts_with("mast") || [GET, HEAR, READ].contains(&rule.as_str())),
            "{rules:?}"
        );
        let own = |rest: &str| format!("trusswatch/tower/module1/{rest}");
        for published in ["fault/sensor/g3", "identification/sensor/g3", "phase"] {
            assert!(covers(&access, "tower publishes", &own(published)), "{published}");
            assert!(covers(&access, "tower replies", &own(published)), "{published}");
        }
        assert!(covers(&access, "tower replies", &own("command/reset/*")));
        for not in
            ["sample", "divergence", "change", "status", "progress", "state", "command/reset"]
        {
            assert!(!covers(&access, "tower publishes", &own(not)), "{not}");
            assert!(!covers(&access, "tower replies", &own(not)), "{not}");
        }
        assert!(!covers(&access, "tower publishes", "trusswatch/mast/module1/fault/sensor/g3"));
        assert!(!covers(&access, "tower replies", "trusswatch/mast/module1/history"));
    }

    #[test]
    fn an_operator_of_the_fleet_commands_every_module_only_under_the_own_name() {
        let access = fleet_access();
        assert_eq!(
            rules_of(&access, "operator.ada.fleet"),
            ["command as ada", HEAR, READ, GET, ASKED]
        );
        assert_eq!(rules_of(&access, "observer.wall.fleet"), [HEAR, READ, GET, ASKED]);
        for structure in ["tower", "mast"] {
            let key = |rest: &str| format!("trusswatch/{structure}/{rest}");
            assert!(covers(&access, "command as ada", &key("module1/command/acknowledge/ada")));
            for not in [
                "module1/command/acknowledge/bob",
                "module1/command/acknowledge",
                "plant/command/inject",
            ] {
                assert!(!covers(&access, "command as ada", &key(not)), "{not}");
            }
        }
        assert!(!covers(&access, "command as ada", "trusswatch/other/module1/command/reset/ada"));
    }
}
