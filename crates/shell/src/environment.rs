//! Environment variables for long-running processes. The units, the image, the demo and the tests set them; a process
//! started by hand without them works, and logs those that are missing.
//!
//! - Eight threads for the network, which wait for sockets and read them. By default Zenoh waits for a socket
//!   on the thread that opened it, and reads it on one of two others, so that each message wakes two threads, and two
//!   blocking callbacks stop all reception. Only an environment variable changes this.
//! - Memory is returned to the system. The GNU C library keeps a pool of memory for every few threads and returns
//!   little of it, so that a flood of messages doubles the size of a process. With one pool and immediate return of
//!   unused memory it grows by an eighth. With two pools it sometimes grew by half: pending queries hold the buffers
//!   that they arrived in, and later allocations settle above them.

use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// The variables with their values. The first is read by Zenoh, the others by the GNU C library \[bytes\].
const VARIABLES: [(&str, &str); 4] = [
    (
        "ZENOH_RUNTIME",
        "(net: (worker_threads: 8), \
          rx: (handover: net), acc: (handover: net), app: (handover: net))",
    ),
    ("MALLOC_ARENA_MAX", "1"),
    ("MALLOC_TRIM_THRESHOLD_", "131072"),
    ("MALLOC_MMAP_THRESHOLD_", "131072"),
];

/// The variables that are not set, for processes started by this one.
pub fn missing() -> impl Iterator<Item = (&'static str, &'static str)> {
    VARIABLES.into_iter().filter(|(name, _)| std::env::var_os(name).is_none())
}

/// Logs the variables that are not set.
pub(crate) fn log() {
    let missing: Vec<String> = missing().map(|(name, value)| format!("{name}={value}")).collect();
    if !missing.is_empty() {
        tracing::info!("environment not set for long runs: {}", missing.join(" "));
    }
}

/// With more connections that have not completed a handshake, memory would exceed the limit in the shipped units.
const DESCRIPTORS: u64 = 16_384;

/// Raises the limit of open files as far as the system allows, at most to [`DESCRIPTORS`].
///
/// Systems set a low soft limit (typically 1024) for programs that use `select`, and permit many more on request. A
/// client that opens connections and sends nothing keeps each of them until the handshake times out: with a thousand
/// descriptors, a thousand such connections lock out all others.
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
