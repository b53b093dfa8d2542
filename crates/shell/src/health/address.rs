//! The address for health requests.

use std::net::SocketAddr;
use std::path::Path;

use serde::{Deserialize, Serialize};

use settings::{ConfigErrors, SettingsFile};

const RIGHT: &str = "write e.g. `127.0.0.1:9464`";

/// The table `[health]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HealthSettings {
    /// Serve `/healthz`, `/readyz` and `/metrics` on this address, e.g. `127.0.0.1:9464`; not
    /// served without an address.
    pub listen: Option<String>,
}

/// The address for health from the command line.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct HealthFlags {
    /// Serve /healthz, /readyz and /metrics on this address, e.g. `127.0.0.1:9464`, without authentication; overrides the
    /// configuration
    #[arg(long, value_name = "ADDRESS")]
    pub health: Option<String>,
}

impl HealthSettings {
    /// The address, if one is configured.
    #[must_use]
    pub fn address(
        &self,
        document: &SettingsFile,
        errors: &mut ConfigErrors,
    ) -> Option<SocketAddr> {
        let text = self.listen.as_ref()?;
        let line = document.line(&["health", "listen"]);
        parse(text, &document.file, line, errors)
    }
}

impl HealthFlags {
    /// The address from the flag, which overrides the configuration.
    #[must_use]
    pub fn address_or(
        &self,
        file: Option<SocketAddr>,
        errors: &mut ConfigErrors,
    ) -> Option<SocketAddr> {
        match &self.health {
            Some(text) => parse(text, Path::new("--health"), None, errors),
            None => file,
        }
    }
}

fn parse(
    text: &str,
    file: &Path,
    line: Option<usize>,
    errors: &mut ConfigErrors,
) -> Option<SocketAddr> {
    let address = text.parse();
    if address.is_err() {
        errors.add(file, line, format!("`{text}` is not an address with a port; {RIGHT}"));
    }
    address.ok()
}
