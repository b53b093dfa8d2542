//! The shipped configurations are valid, and what is derived is up to date.

use std::path::{Path, PathBuf};

use daemon::config::{PlantFlags, load_diagnoser, load_plant};
use session::Network;
use truss::Structure;

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs")
}

/// Set this variable to write the derived files instead of comparing them.
const REWRITE: &str = "TRUSSWATCH_REWRITE_STRUCTURES";

#[test]
fn every_modules_structure_is_the_one_cut_out_of_the_whole() {
    for (whole, module, part) in [
        ("tower.toml", "module1", "tower/module1.structure.toml"),
        ("tower.toml", "module2", "tower/module2.structure.toml"),
        ("small.toml", "lower", "small/lower.structure.toml"),
        ("small.toml", "upper", "small/upper.structure.toml"),
    ] {
        let text = std::fs::read_to_string(configs().join(whole)).unwrap();
        let structure = Structure::from_toml(&text).unwrap();
        let local = structure.local(&module.parse().unwrap()).unwrap().to_toml();
        let expected = format!(
            "# Module `{module}` of ../{whole}, cut out of it and clamped at its lower interface.\n{local}"
        );
        let file = configs().join(part);
        if std::env::var_os(REWRITE).is_some() {
            std::fs::write(&file, &expected).unwrap();
        }
        let found = std::fs::read_to_string(&file).unwrap();
        assert!(found == expected, "{part} is out of date; set {REWRITE}=1 to rewrite it");
    }
}

#[test]
fn every_diagnosers_configuration_is_valid() {
    for (file, structure, module, size) in [
        ("module1.toml", "tower", "module1", (4, 8)),
        ("module2.toml", "tower", "module2", (4, 8)),
        ("small/lower.toml", "small", "lower", (2, 3)),
        ("small/upper.toml", "small", "upper", (1, 3)),
    ] {
        let config = load_diagnoser(&configs().join(file)).unwrap();
        assert_eq!(config.structure_name.as_str(), structure);
        assert_eq!(config.module().as_str(), module);
        assert_eq!(config.size(), size);
    }
}

#[test]
fn every_plants_configuration_is_valid() {
    for file in ["plant.toml", "small/plant.toml", "weather/alike.toml", "weather/uneven.toml"] {
        let config = load_plant(&configs().join(file), &PlantFlags::default()).unwrap();
        assert_eq!(config.wait_for.len(), 2);
    }
}

#[test]
fn every_file_of_zenoh_settings_is_taken_by_zenoh_and_limits_messages_as_we_do() {
    const { assert!(session::LONGEST_MESSAGE_BYTES >= 4 * vocabulary::MAX_MESSAGE_BYTES) };
    for file in [
        "peer.json5",
        "client.json5",
        "router.json5",
        "client-tls.json5",
        "tower-peer.json5",
        "tower-router.json5",
    ] {
        let file = configs().join("zenoh").join(file);
        // As Zenoh's own router reads it.
        let itself = session::from_file(&file).unwrap();
        let limit = itself.get_json("transport/link/rx/max_message_size").unwrap();
        assert_eq!(limit, session::LONGEST_MESSAGE_BYTES.to_string(), "{}", file.display());
        session::settings(&Network { zenoh: Some(file), ..Network::default() }).unwrap();
    }
}
