//! Routers that a router may be linked to, and clients that do not belong to the structure.

use std::collections::BTreeSet;
use std::str::FromStr;

use pki::holder::BearerName;
use pki::{CommonName, Generations, Holder};
use vocabulary::{OperatorName, StructureName};

/// Clients that do not belong to the structure.
#[derive(Debug, Default)]
pub(super) struct People {
    pub(super) operators: BTreeSet<BearerName>,
    pub(super) observers: BTreeSet<BearerName>,
    /// Routers linked to the one that enforces the rules.
    pub(super) routers: BTreeSet<Linked>,
    /// The fleet's router, if the rules are for a gateway.
    pub(super) gateway: Option<Gateway>,
    /// The generations of the certificates of these clients, the modules and the plant.
    pub(super) generations: Generations,
}

/// Structures, each behind a gateway, and users at the fleet's router.
#[derive(Debug)]
pub(super) struct Fleet {
    pub(super) name: StructureName,
    pub(super) structures: BTreeSet<StructureName>,
    pub(super) people: People,
}

/// A linked router.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Linked {
    pub(super) router: BearerName,
    /// The holders whose messages arrive over the link: behind the router at its other end, or behind further ones. Any
    /// holder of the structure if `None`.
    pub(super) side: Option<BTreeSet<Holder>>,
}

impl Linked {
    pub(super) fn passes_on(&self, holder: &Holder) -> bool {
        self.side.as_ref().is_none_or(|holders| holders.contains(holder))
    }
}

/// Parses `ground` or `ground=module1,operator.ada`.
impl FromStr for Linked {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (router, side) = match text.split_once('=') {
            None => (text, None),
            Some((router, holders)) => {
                let holders = holders.split(',').map(|holder| holder.trim().parse::<Holder>());
                let holders: Result<_, _> = holders.collect();
                (router, Some(holders.map_err(|error| error.to_string())?))
            }
        };
        let named = router.strip_prefix("router.").unwrap_or(router);
        let router = named.parse().map_err(|error| format!("invalid router name: {error}"))?;
        Ok(Linked { router, side })
    }
}

/// The fleet's router, from the gateway's point of view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Gateway {
    /// Its name in the certificate issued by the fleet's authority.
    pub(super) router: CommonName,
    /// Operators of the fleet who may issue commands in the structure.
    pub(super) operators: BTreeSet<OperatorName>,
}

/// Parses `hub.fleet` or `hub.fleet=operator.ada,operator.bob`.
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
        let wrong =
            || format!("invalid fleet router `{named}`: expected `NAME.fleet`, e.g. `hub.fleet`");
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
        _ => Err(format!("invalid operator `{text}`: expected e.g. `operator.ada`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_router_is_given_with_or_without_its_side() {
        let all: Linked = "ground".parse().unwrap();
        assert_eq!((all.router.to_string().as_str(), &all.side), ("ground", &None));
        let some: Linked = "router.top=module2, operator.ada".parse().unwrap();
        let module = |name: &str| Holder::Module(name.parse().unwrap());
        assert!(some.passes_on(&module("module2")) && !some.passes_on(&module("module1")));
        assert!(some.passes_on(&Holder::Operator("ada".parse().unwrap())));
        for wrong in ["", "=module1", "top=", "top=king.ada", "a/b"] {
            assert!(wrong.parse::<Linked>().is_err(), "{wrong}");
        }
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
