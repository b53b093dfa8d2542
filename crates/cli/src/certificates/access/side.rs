//! A linked router, with those on its side.

use std::collections::BTreeSet;
use std::str::FromStr;

use pki::Holder;
use pki::holder::BearerName;

/// A router that another one is linked to.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Linked {
    pub(super) router: BearerName,
    pub(super) side: Side,
}

/// Those whose messages come by a link: behind the router at its other end, or behind further ones.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Side {
    /// Anybody of the structure.
    Everybody,
    /// These.
    These(BTreeSet<Holder>),
}

impl Side {
    pub(super) fn includes(&self, holder: &Holder) -> bool {
        match self {
            Side::Everybody => true,
            Side::These(holders) => holders.contains(holder),
        }
    }
}

/// `ground` or `ground=module1,operator.ada`.
impl FromStr for Linked {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (router, side) = match text.split_once('=') {
            None => (text, Side::Everybody),
            Some((router, holders)) => {
                let holders = holders.split(',').map(|holder| holder.trim().parse::<Holder>());
                let holders: Result<_, _> = holders.collect();
                (router, Side::These(holders.map_err(|error| error.to_string())?))
            }
        };
        let named = router.strip_prefix("router.").unwrap_or(router);
        let router = named.parse().map_err(|error| format!("no name of a router: {error}"))?;
        Ok(Linked { router, side })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_router_is_given_with_or_without_its_side() {
        let all: Linked = "ground".parse().unwrap();
        assert_eq!((all.router.to_string().as_str(), &all.side), ("ground", &Side::Everybody));
        let some: Linked = "router.top=module2, operator.ada".parse().unwrap();
        let module = |name: &str| Holder::Module(name.parse().unwrap());
        assert!(some.side.includes(&module("module2")) && !some.side.includes(&module("module1")));
        assert!(some.side.includes(&Holder::Operator("ada".parse().unwrap())));
        for wrong in ["", "=module1", "top=", "top=king.ada", "a/b"] {
            assert!(wrong.parse::<Linked>().is_err(), "{wrong}");
        }
    }
}
