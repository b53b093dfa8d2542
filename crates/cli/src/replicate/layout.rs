//! The endpoints that each process listens on and connects to.

use toml::{Table, Value};
use zenoh::config::EndPoint;

use crate::failure::Failure;

/// The shipped settings of a router, and the endpoint in them to be replaced.
const ROUTER: &str = include_str!("../../../../configs/zenoh/router.json5");
const ROUTER_ENDPOINT: &str = "tcp/127.0.0.1:7447";

pub(crate) enum NetworkLayout {
    /// Every process listens on a port of this machine: first the plant, then the modules.
    Mesh {
        /// The plant's.
        first_port: u16,
    },
    /// Every process is a client of a router.
    Star {
        /// The endpoint of the router.
        router: String,
    },
}

impl NetworkLayout {
    /// Ports for a plant and this many modules.
    pub(crate) fn mesh(first_port: u16, modules: usize) -> Result<NetworkLayout, Failure> {
        let highest = usize::from(u16::MAX) - modules;
        if first_port == 0 || usize::from(first_port) > highest {
            return Err(Failure::usage(format!(
                "`--first-port` is {first_port}; use 1 to {highest} for a plant and {modules} diagnosers"
            )));
        }
        Ok(NetworkLayout::Mesh { first_port })
    }

    pub(crate) fn star(router: &EndPoint) -> NetworkLayout {
        NetworkLayout::Star { router: router.to_string() }
    }

    /// The plant's table `[network]`.
    pub(crate) fn of_plant(&self) -> Table {
        match self {
            NetworkLayout::Mesh { first_port } => peer(*first_port, &[]),
            NetworkLayout::Star { router } => client(router),
        }
    }

    /// A module's table `[network]`, given the modules that it is linked to, ascending. Of two linked modules the later
    /// one connects, also after a restart of either.
    pub(crate) fn of_module(&self, module: usize, linked: &[usize]) -> Table {
        match self {
            NetworkLayout::Mesh { first_port } => {
                // `mesh` has checked that there are ports for all.
                let port = |module: usize| first_port.saturating_add(module as u16 + 1);
                let before =
                    linked.iter().filter(|other| **other < module).map(|other| port(*other));
                let connect: Vec<u16> = [*first_port].into_iter().chain(before).collect();
                peer(port(module), &connect)
            }
            NetworkLayout::Star { router } => client(router),
        }
    }

    /// File and text of the settings of the router, if there is one.
    pub(crate) fn router_settings(&self) -> Option<(&'static str, String)> {
        match self {
            NetworkLayout::Mesh { .. } => None,
            NetworkLayout::Star { router } => {
                Some(("router.json5", ROUTER.replace(ROUTER_ENDPOINT, router)))
            }
        }
    }
}

fn peer(port: u16, connect: &[u16]) -> Table {
    let endpoint = |port: &u16| Value::from(format!("tcp/127.0.0.1:{port}"));
    let mut network = Table::new();
    network.insert("listen".into(), vec![endpoint(&port)].into());
    if !connect.is_empty() {
        let connect: Vec<Value> = connect.iter().map(endpoint).collect();
        network.insert("connect".into(), connect.into());
    }
    network
}

fn client(router: &str) -> Table {
    let mut network = Table::new();
    network.insert("mode".into(), "client".into());
    network.insert("connect".into(), vec![router.to_owned()].into());
    network
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_that_are_linked_the_later_one_connects() {
        let layout = NetworkLayout::mesh(7447, 3).ok();
        let network = |module, linked: &[usize]| {
            layout.as_ref().map(|layout| layout.of_module(module, linked))
        };
        let first = "listen = [\"tcp/127.0.0.1:7448\"]\nconnect = [\"tcp/127.0.0.1:7447\"]\n";
        assert_eq!(network(0, &[1, 2]), first.parse().ok());
        let last = "listen = [\"tcp/127.0.0.1:7450\"]\n\
                    connect = [\"tcp/127.0.0.1:7447\", \"tcp/127.0.0.1:7449\"]\n";
        assert_eq!(network(2, &[1]), last.parse().ok());
    }

    #[test]
    fn there_are_ports_for_all_or_the_highest_first_port_is_named() {
        assert!(NetworkLayout::mesh(65_485, 50).is_ok());
        for port in [0, 65_486] {
            let failure = NetworkLayout::mesh(port, 50).err();
            let text = format!("{failure:?}");
            assert!(text.contains(&format!("`--first-port` is {port}; use 1 to 65485")), "{text}");
        }
    }

    #[test]
    fn the_router_listens_where_its_clients_connect() {
        let endpoint: Result<EndPoint, _> = "tcp/192.0.2.1:7000".parse();
        let layout = endpoint.ok().map(|endpoint| NetworkLayout::star(&endpoint));
        let text = layout.and_then(|layout| layout.router_settings()).map(|(_, text)| text);
        let text = text.unwrap_or_default();
        assert!(text.contains("tcp/192.0.2.1:7000") && !text.contains("127.0.0.1"), "{text}");
    }
}
