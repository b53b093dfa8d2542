//! What is to stand in the environment of a process that runs for long. The units, the image, the demo and
//! the tests set it; started by hand without it, a process works, and logs what is missing.
//!
//! - Eight threads for the network's reception, which wait for sockets and read them. Left to itself, the
//!   network's library waits on one thread and reads on two others, so that each message switches to two threads,
//!   and two callbacks that wait make a process deaf. Only an environment variable sets this.
//! - Memory that goes back where it came from. The C library keeps a pool of memory for every few threads
//!   and gives little of it back, so that a flood of messages leaves a process twice as large. With one pool,
//!   and everything that is not in use given back, it grows by an eighth. With two, it grew now and then by
//!   half: waiting questions hold the buffers that they came in, and what is allocated meanwhile settles
//!   above them.

use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// The variables with their values. The first is read by the network's library, the others by the GNU C
/// library \[bytes\].
const VARIABLES: [(&str, &str); 4] = [
    ("ZENOH_RUNTIME", "(net: (worker_threads: 8), rx: (handover: net))"),
    ("MALLOC_ARENA_MAX", "1"),
    ("MALLOC_TRIM_THRESHOLD_", "131072"),
    ("MALLOC_MMAP_THRESHOLD_", "131072"),
];

/// Those that are not set, for processes that this one starts.
pub fn missing() -> impl Iterator<Item = (&'static str, &'static str)> {
    VARIABLES.into_iter().filter(|(name, _)| std::env::var_os(name).is_none())
}

/// Logs those that are not set.
pub(crate) fn log() {
    let missing: Vec<String> = missing().map(|(name, value)| format!("{name}={value}")).collect();
    if !missing.is_empty() {
        tracing::info!("environment not set for long runs: {}", missing.join(" "));
    }
}

/// More than that many connections without a handshake would cost more memory than the shipped units grant.
const DESCRIPTORS: u64 = 16_384;

/// Raises the limit of open files and connections as far as the system allows and it is of use.
///
/// Systems allow few at first (1024 as a rule), for programs that cannot count further, and many more on request. A
/// stranger who opens connections and sends nothing keeps each for as long as a handshake may take: with a thousand
/// descriptors a thousand of them keep everybody out.
pub(crate) fn raise_descriptor_limit() {
    let Ok((soft, hard)) = getrlimit(Resource::RLIMIT_NOFILE) else { return };
    let wanted = DESCRIPTORS.min(hard);
    if soft < wanted
        && let Err(error) = setrlimit(Resource::RLIMIT_NOFILE, wanted, hard)
    {
        tracing::info!("cannot raise the limit of {soft} open files: {error}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_image_set_every_variable() {
        let deploy = concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy");
        for file in [
            "systemd/trusswatch-diagnoser@.service",
            "systemd/trusswatch-plant.service",
            "systemd/trusswatch-router.service",
        ] {
            let text = std::fs::read_to_string(format!("{deploy}/{file}")).unwrap();
            for (name, value) in VARIABLES {
                let line = format!("\nEnvironment=\"{name}={value}\"\n");
                assert!(text.contains(&line), "{file} sets {name}");
            }
        }
        let image = std::fs::read_to_string(format!("{deploy}/compose/Dockerfile")).unwrap();
        for (name, value) in VARIABLES {
            let set = image.matches(&format!("{name}=\"{value}\"")).count();
            assert_eq!(set, image.matches("FROM scratch").count(), "{name} in every image");
        }
    }

    #[test]
    fn there_are_as_many_as_the_system_gives_and_no_fewer_than_before() {
        let before = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        raise_descriptor_limit();
        let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        assert_eq!((soft, hard), (before.0.max(DESCRIPTORS.min(hard)), before.1));
    }
}
