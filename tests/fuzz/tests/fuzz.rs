//! libFuzzer around one target, which the environment variable `FUZZ_TARGET` names. One program for all
//! of them: linking one for each would take longer than fuzzing.
#![no_main]

use std::sync::OnceLock;

use fuzz_targets::{TARGETS, Target};
use libfuzzer_sys::fuzz_target;

static CHOSEN: OnceLock<Target> = OnceLock::new();

fn chosen() -> Target {
    let name = std::env::var("FUZZ_TARGET").unwrap_or_default();
    Target::named(&name).unwrap_or_else(|| {
        let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("error: FUZZ_TARGET is `{name}`; use one of {}", names.join(", "));
        std::process::exit(2)
    })
}

fuzz_target!(|bytes: &[u8]| (CHOSEN.get_or_init(chosen).check)(bytes));
