//! The certificate of a process, and checks that it is the right one.

use std::path::PathBuf;

use pki::{Address, Certificate, CommonName, Holder, Identity, IdentityProblem, credentials};
use settings::{ConfigError, ConfigErrors};
use vocabulary::{OperatorName, StructureName};

use crate::network::Network;
use crate::zenoh_file;
use crate::zenoh_settings::settings;

impl Network {
    /// The certificate files of the process, if any.
    #[must_use]
    pub fn identity(&self) -> Option<Identity> {
        self.tls.as_deref().map(credentials::identity)
    }

    /// The operator in the certificate of the process, if it belongs to an operator; the certificate comes from a
    /// directory or from a file named in Zenoh's settings. An unreadable one is reported by the checks.
    #[must_use]
    pub fn operator(&self) -> Option<OperatorName> {
        let settings = settings(self).ok()?;
        let file = settings.get_json(zenoh_file::CONNECT_CERTIFICATE).ok()?;
        let file: Option<PathBuf> = serde_json::from_str(&file).ok()?;
        let name = Certificate::read(&file?).ok()?.common_name?;
        match name.parse::<CommonName>().ok()?.issued.holder {
            Holder::Operator(name) => name.to_string().parse().ok(),
            _ => None,
        }
    }

    /// The files of the certificates that the process shows on the network.
    #[must_use]
    pub fn certificates(&self) -> Vec<PathBuf> {
        self.identities().into_iter().map(|identity| identity.certificate).collect()
    }

    /// The identity in the configuration, or those in its file of Zenoh settings.
    fn identities(&self) -> Vec<Identity> {
        if let Some(identity) = self.identity() {
            return vec![identity];
        }
        // Another check reports a file that cannot be read.
        let settings = self.zenoh.as_deref().and_then(|file| zenoh_file::from_file(file).ok());
        settings.map(|config| zenoh_file::identities(&config)).unwrap_or_default()
    }

    /// Problems of the certificates that depend on the time.
    #[must_use]
    pub fn problems_of_time(&self) -> Vec<IdentityProblem> {
        let mut problems = self.problems(None);
        problems.retain(|problem| problem.wrong.passes());
        problems
    }

    /// Likewise, as configuration errors.
    ///
    /// # Errors
    /// A certificate that has expired or is not yet valid.
    pub fn check_time(&self) -> Result<(), ConfigErrors> {
        let mut errors = ConfigErrors(Vec::new());
        errors.0.extend(self.problems_of_time().into_iter().map(mistake));
        errors.or(())
    }

    /// Checks the certificates for problems that do not depend on the time or on the process.
    ///
    /// # Errors
    /// Problems of the certificates.
    pub fn check_certificates(&self) -> Result<(), ConfigErrors> {
        let problems = self.problems(None).into_iter();
        let lasting = problems.filter(|problem| !problem.wrong.passes()).map(mistake);
        ConfigErrors(lasting.collect()).or(())
    }

    /// Checks the certificates for problems that do not depend on the time, because a process that starts before the
    /// clock is set must not give up.
    pub fn check_identity(
        &self,
        holder: &Holder,
        structure: &StructureName,
        errors: &mut ConfigErrors,
    ) {
        let problems = match CommonName::new(holder.clone(), structure.clone()) {
            Ok(expected) => self.problems(Some(&expected)),
            Err(error) => {
                if let Some(directory) = &self.tls {
                    errors.add(directory, None, error);
                }
                return;
            }
        };
        let lasting = problems.into_iter().filter(|problem| !problem.wrong.passes());
        errors.0.extend(lasting.map(mistake));
        if let Some(directory) = &self.tls {
            for endpoint in self.listen.iter().chain(&self.connect) {
                if !endpoint.starts_with(TLS) {
                    let right = format!("{TLS}{}", address_part(endpoint));
                    let problem =
                        format!("`{endpoint}` is not possible beside `tls`; write `{right}`");
                    errors.add(directory, None, problem);
                }
            }
        }
    }

    /// Problems of the certificates that the configuration or its file of Zenoh settings names.
    fn problems(&self, expected: Option<&CommonName>) -> Vec<IdentityProblem> {
        let listening: Vec<Address> = self.listen.iter().filter_map(|text| host(text)).collect();
        if let Some(identity) = self.identity() {
            return identity.problems(expected, &listening);
        }
        let identities = self.identities();
        let all = identities.iter().flat_map(|identity| identity.problems(expected, &[]));
        all.collect()
    }
}

const TLS: &str = "tls/";

/// The part of an endpoint after the protocol.
fn address_part(endpoint: &str) -> &str {
    endpoint.split_once('/').map_or(endpoint, |(_, address)| address)
}

/// The host of a TLS endpoint, unless it is a wildcard.
fn host(endpoint: &str) -> Option<Address> {
    let (host, _) = endpoint.strip_prefix(TLS)?.rsplit_once(':')?;
    let address = host.trim_start_matches('[').trim_end_matches(']').parse().ok()?;
    let anywhere = matches!(address, Address::Ip(ip) if ip.is_unspecified());
    (!anywhere).then_some(address)
}

/// Converts a problem of a certificate into a configuration error.
#[must_use]
pub fn mistake(problem: IdentityProblem) -> ConfigError {
    ConfigError { file: problem.file, line: None, problem: problem.wrong.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_certain_host_has_to_stand_in_the_certificate() {
        let host = |text| host(text).map(|address| address.to_string());
        assert_eq!(host("tls/192.0.2.1:7447").as_deref(), Some("192.0.2.1"));
        assert_eq!(host("tls/[2001:db8::1]:7447").as_deref(), Some("2001:db8::1"));
        assert_eq!(host("tls/mast.example:7447").as_deref(), Some("mast.example"));
        assert_eq!(host("tls/0.0.0.0:7447"), None);
        assert_eq!(host("tls/[::]:7447"), None);
        assert_eq!(host("tcp/192.0.2.1:7447"), None);
    }
}
