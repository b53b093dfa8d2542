//! Where a process listens and connects.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use settings::{ConfigErrors, SettingsFile};

use crate::endpoint::endpoint;
use crate::flags::NetworkFlags;
use crate::zenoh_file;

/// Peer of its neighbours, or client of a router.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Connects directly to every configured endpoint.
    #[default]
    Peer,
    /// Connects to a router, which passes everything on.
    Client,
}

/// The table `[network]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Network {
    /// Peer, the default, or client.
    pub mode: Option<Mode>,
    /// Endpoints to listen on, e.g. `tcp/127.0.0.1:7447`; added to by `--listen`.
    pub listen: Vec<String>,
    /// Endpoints to connect to; added to by `--connect`.
    pub connect: Vec<String>,
    /// A file of Zenoh's own settings in JSON5, used as it is in place of everything that trusswatch
    /// would set; only `listen` and `connect`, if given, take the place of the file's, and messages are limited
    /// to [`crate::LONGEST_MESSAGE_BYTES`] unless it limits them itself.
    pub zenoh: Option<PathBuf>,
    /// A directory with this process's certificate, its key and the authority's certificate, as
    /// `trusswatch pki issue` makes it; `--tls` goes before it. Every link is then mutually
    /// authenticated TLS, and no other is accepted.
    pub tls: Option<PathBuf>,
    /// A link whose other side is silent for this long is dead \[ms\]; a message that cannot be sent for a fifth of it
    /// ends the link. Without it a second, [`DEFAULT_LEASE_MS`]: on a network of long or lossy links that is too short.
    pub lease_ms: Option<u32>,
}

/// What notices a loss soon, on a network of one site \[ms\].
pub const DEFAULT_LEASE_MS: u32 = 1000;
/// Sensible leases \[ms\].
pub const LEASES_MS: RangeInclusive<u32> = 200..=60_000;

impl Network {
    /// A peer that listens nowhere.
    #[must_use]
    pub fn peer_of(endpoints: &[String]) -> Self {
        Self { connect: endpoints.to_vec(), ..Self::default() }
    }

    /// A client.
    #[must_use]
    pub fn client_of(endpoints: &[String]) -> Self {
        Self { mode: Some(Mode::Client), connect: endpoints.to_vec(), ..Self::default() }
    }

    /// The lease of its links \[ms\].
    #[must_use]
    pub fn lease_ms(&self) -> u32 {
        self.lease_ms.unwrap_or(DEFAULT_LEASE_MS)
    }

    /// Adds what a command line says.
    pub fn add(&mut self, flags: &NetworkFlags) {
        self.listen.extend_from_slice(&flags.listen);
        self.connect.extend_from_slice(&flags.connect);
        self.tls = flags.tls.clone().or(self.tls.take());
    }

    /// Turns the file's path into one from here, and checks everything.
    pub fn check(&mut self, document: &SettingsFile, errors: &mut ConfigErrors) {
        let line = |key: &str| document.line(&["network", key]);
        for (key, endpoints) in [("listen", &self.listen), ("connect", &self.connect)] {
            for error in endpoints.iter().filter_map(|text| endpoint(text).err()) {
                errors.add(&document.file, line(key), error);
            }
        }
        if let Some(lease_ms) = self.lease_ms.filter(|lease_ms| !LEASES_MS.contains(lease_ms)) {
            let (least, most) = (LEASES_MS.start(), LEASES_MS.end());
            let problem = format!("a lease of {lease_ms} ms; use {least} to {most} ms");
            errors.add(&document.file, line("lease_ms"), problem);
        }
        if let Some(directory) = &mut self.tls {
            *directory = document.beside(directory);
        }
        let Some(file) = &mut self.zenoh else { return };
        *file = document.beside(file);
        for (key, is_set) in [("mode", self.mode.is_some()), ("lease_ms", self.lease_ms.is_some())]
        {
            if is_set {
                let problem = format!("`{key}` has no effect beside `zenoh`; set it in that file");
                errors.add(&document.file, line(key), problem);
            }
        }
        if let Err(error) = zenoh_file::from_file(file) {
            errors.add(&document.file, line("zenoh"), error);
        }
    }
}
