//! The certificate that a process authenticates with, and whether it is the right one.

use std::path::PathBuf;

use pki::{Address, Certificate, CommonName, Holder, Identity, IdentityProblem, credentials};
use settings::{ConfigError, ConfigErrors};
use vocabulary::{OperatorName, StructureName};

use crate::network::Network;
use crate::zenoh_file;
use crate::zenoh_settings::settings;

impl Network {
    /// The files that the process authenticates with, if any.
    #[must_use]
    pub fn identity(&self) -> Option<Identity> {
        self.tls.as_deref().map(credentials::identity)
    }

    /// The operator whose certificate the process shows, if it is one's: that of a directory, or the one that a file of
    /// Zenoh's settings names. One that cannot be read is found wrong elsewhere.
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

    /// What is wrong with the certificates at this time of day and would be right at another one.
    #[must_use]
    pub fn problems_of_time(&self) -> Vec<IdentityProblem> {
        let mut problems = self.problems(None);
        problems.retain(|problem| problem.wrong.passes());
        problems
    }

    /// The same as mistakes.
    ///
    /// # Errors
    /// A certificate that is expired or not yet valid.
    pub fn check_time(&self) -> Result<(), ConfigErrors> {
        let mut errors = ConfigErrors(Vec::new());
        errors.0.extend(self.problems_of_time().into_iter().map(mistake));
        errors.or(())
    }

    /// Checks the certificates for what is wrong at any time of day, whatever the process.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn check_certificates(&self) -> Result<(), ConfigErrors> {
        let problems = self.problems(None).into_iter();
        let lasting = problems.filter(|problem| !problem.wrong.passes()).map(mistake);
        ConfigErrors(lasting.collect()).or(())
    }

    /// Checks the certificates for what is wrong at any time of day: a process that is started before
    /// the clock is set must not give up.
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

    /// What is wrong with the certificates that the process itself or its file of Zenoh settings names.
    fn problems(&self, expected: Option<&CommonName>) -> Vec<IdentityProblem> {
        let listening: Vec<Address> = self.listen.iter().filter_map(|text| host(text)).collect();
        if let Some(identity) = self.identity() {
            return identity.problems(expected, &listening);
        }
        // A file that cannot be read is reported elsewhere.
        let settings = self.zenoh.as_deref().and_then(|file| zenoh_file::from_file(file).ok());
        let identities = settings.map(|config| zenoh_file::identities(&config)).unwrap_or_default();
        let all = identities.iter().flat_map(|identity| identity.problems(expected, &[]));
        all.collect()
    }
}

const TLS: &str = "tls/";

/// The part of an endpoint behind the protocol.
fn address_part(endpoint: &str) -> &str {
    endpoint.split_once('/').map_or(endpoint, |(_, address)| address)
}

/// The host of a TLS endpoint, if it is a certain one.
fn host(endpoint: &str) -> Option<Address> {
    let (host, _) = endpoint.strip_prefix(TLS)?.rsplit_once(':')?;
    let address = host.trim_start_matches('[').trim_end_matches(']').parse().ok()?;
    let anywhere = matches!(address, Address::Ip(ip) if ip.is_unspecified());
    (!anywhere).then_some(address)
}

/// A problem of a certificate among the mistakes of configurations.
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
