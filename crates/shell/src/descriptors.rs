//! How many files and connections the process may have open. Systems allow few at first (1024 as a rule), for programs
//! that cannot count further, and many more to whoever asks. A stranger who opens connections and says nothing keeps
//! each for as long as a handshake may take: with a thousand descriptors a thousand of them keep everybody out.

use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// More than that many connections without a handshake would cost more memory than the shipped units grant.
const WANTED: u64 = 16_384;

/// Asks for as many as the system gives, up to what is of use. What it refuses stays as it is.
pub(crate) fn ask_for_more() {
    let Ok((soft, hard)) = getrlimit(Resource::RLIMIT_NOFILE) else { return };
    let wanted = WANTED.min(hard);
    if soft < wanted
        && let Err(error) = setrlimit(Resource::RLIMIT_NOFILE, wanted, hard)
    {
        tracing::info!("no more than {soft} files and connections: {error}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_as_many_as_the_system_gives_and_no_fewer_than_before() {
        let before = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        ask_for_more();
        let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        assert_eq!((soft, hard), (before.0.max(WANTED.min(hard)), before.1));
    }
}
