//! The rules of a fleet's router.

use std::collections::BTreeSet;

use names::StructureName;
use pki::Holder;
use pki::holder::BearerName;
use wire::fleet::Crossing;
use wire::realm;

use super::rules::{
    ANSWER, ASK, ASKED, AccessControl, GET, HEAR, INCOMING, LISTEN, OUTGOING, OWN, PUBLISH, People,
    READ, REQUEST, SHOW, SUBSCRIBE, WATCH, allow, orders,
};

/// Structures, each behind a gateway, and the people at the fleet's router.
#[derive(Debug)]
pub(super) struct Fleet {
    pub(super) name: StructureName,
    pub(super) structures: BTreeSet<StructureName>,
    pub(super) people: People,
}

/// What every gateway is asked for.
const LISTENS: &str = "the fleet listens";
const WATCHES: &str = "the fleet watches who is there";
const ASKS: &str = "the fleet asks what only tells";

impl AccessControl {
    /// What the gateways and the people of a fleet may do.
    pub(super) fn of_fleet(fleet: &Fleet) -> Self {
        let any = Crossing::of_any();
        let rules = vec![
            allow(GET, OUTGOING, &OWN, realm::everything()),
            allow(ASKED, OUTGOING, &REQUEST, realm::everything()),
            allow(HEAR, INCOMING, &LISTEN, realm::everything()),
            allow(READ, INCOMING, &ASK, realm::readable()),
            allow(LISTENS, OUTGOING, &SUBSCRIBE, any.news()),
            allow(WATCHES, OUTGOING, &WATCH, any.tokens()),
            allow(ASKS, OUTGOING, &ASK, any.questions()),
        ];
        let mut access = Self::of_rules(rules, &fleet.people.generations);
        for structure in &fleet.structures {
            access.join(&fleet.name, structure);
        }
        for operator in &fleet.people.operators {
            access.seat(fleet, operator);
        }
        for observer in &fleet.people.observers {
            access.admit(&fleet.name, Holder::Observer(observer.clone()), &[]);
        }
        access
    }

    /// Allows the router that has the name of a structure, its gateway, to speak and answer for this structure and to be
    /// asked for it.
    fn join(&mut self, fleet: &StructureName, structure: &StructureName) {
        let own = Crossing::of(structure);
        let answers = [own.questions(), own.commands()].concat();
        let rules = [
            allow(&format!("{structure} publishes"), INCOMING, &PUBLISH, own.news()),
            allow(&format!("{structure} shows who is there"), INCOMING, &SHOW, own.tokens()),
            allow(&format!("{structure} answers"), INCOMING, &ANSWER, answers),
            allow(&format!("{structure} is ordered"), OUTGOING, &ASK, own.commands()),
        ];
        let own = rules.map(|rule| self.add(rule));
        let rules: Vec<&str> =
            own.iter().map(String::as_str).chain([LISTENS, WATCHES, ASKS]).collect();
        // Every name of a structure is one of a router.
        if let Ok(name) = structure.to_string().parse() {
            self.admit_to(fleet, Holder::Router(name), &rules);
        }
    }

    /// Allows an operator to command the modules of every structure.
    fn seat(&mut self, fleet: &Fleet, operator: &BearerName) {
        let Ok(known) = operator.to_string().parse() else { return };
        let structures = fleet.structures.iter();
        let keys = structures.flat_map(|structure| Crossing::of(structure).commands_of(&known));
        let rule = self.add(allow(&orders(operator), INCOMING, &ASK, keys.collect()));
        self.admit(&fleet.name, Holder::Operator(operator.clone()), &[&rule]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{covers, rules_of};
    use super::*;
    use pki::Generations;

    fn access() -> serde_json::Value {
        let people = People {
            operators: BTreeSet::from(["ada".parse().unwrap()]),
            observers: BTreeSet::from(["wall".parse().unwrap()]),
            generations: Generations::default(),
            ..People::default()
        };
        let structures = ["tower", "mast"].map(|name| name.parse().unwrap()).into();
        let fleet = Fleet { name: "fleet".parse().unwrap(), structures, people };
        serde_json::to_value(AccessControl::of_fleet(&fleet)).unwrap()
    }

    #[test]
    fn a_gateway_speaks_for_its_structure_only() {
        let access = access();
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
            assert!(covers(&access, "tower answers", &own(published)), "{published}");
        }
        assert!(covers(&access, "tower answers", &own("command/reset/*")));
        for not in
            ["sample", "divergence", "change", "status", "progress", "state", "command/reset"]
        {
            assert!(!covers(&access, "tower publishes", &own(not)), "{not}");
            assert!(!covers(&access, "tower answers", &own(not)), "{not}");
        }
        assert!(!covers(&access, "tower publishes", "trusswatch/mast/module1/fault/sensor/g3"));
        assert!(!covers(&access, "tower answers", "trusswatch/mast/module1/history"));
    }

    #[test]
    fn an_operator_of_the_fleet_commands_modules_of_every_structure_in_his_own_name() {
        let access = access();
        assert_eq!(rules_of(&access, "operator.ada.fleet"), ["ada orders", HEAR, READ, GET, ASKED]);
        assert_eq!(rules_of(&access, "observer.wall.fleet"), [HEAR, READ, GET, ASKED]);
        for structure in ["tower", "mast"] {
            let key = |rest: &str| format!("trusswatch/{structure}/{rest}");
            assert!(covers(&access, "ada orders", &key("module1/command/acknowledge/ada")));
            for not in [
                "module1/command/acknowledge/bob",
                "module1/command/acknowledge",
                "plant/command/inject",
            ] {
                assert!(!covers(&access, "ada orders", &key(not)), "{not}");
            }
        }
        assert!(!covers(&access, "ada orders", "trusswatch/other/module1/command/reset/ada"));
    }
}
