//! The shipped structures.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]
#![allow(dead_code, reason = "not every test needs both")]

use truss::Structure;

pub(crate) fn tower() -> Structure {
    Structure::from_toml(include_str!("../../../../configs/tower.toml")).unwrap()
}

pub(crate) fn small() -> Structure {
    Structure::from_toml(include_str!("../../../../configs/small.toml")).unwrap()
}

/// On a pin and a roller: no module stands by itself.
pub(crate) fn bridge() -> Structure {
    Structure::from_toml(include_str!("../../../../configs/templates/bridge.toml")).unwrap()
}

pub(crate) fn local(structure: &Structure, module: &str) -> Structure {
    structure.local(&module.parse().unwrap()).unwrap()
}

/// Both shipped structures and the local models of their equipped modules.
pub(crate) fn all() -> Vec<Structure> {
    let (tower, small) = (tower(), small());
    let mut all = Vec::new();
    for structure in [tower, small] {
        for module in structure.equipped() {
            all.push(structure.local(&module.name).unwrap());
        }
        all.push(structure);
    }
    all
}
