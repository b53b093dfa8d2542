//! A file of Zenoh's own settings, with the certificates and the access control in it.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Deserialize;
use session::mistake;
use settings::{ConfigError, ConfigErrors};
use zenoh::Config;

use super::mistake as mistake_in;

/// What Zenoh itself checks only when it starts.
#[derive(Debug, Default, Deserialize)]
struct AccessControl {
    enabled: bool,
    rules: Option<Vec<Named>>,
    subjects: Option<Vec<Named>>,
    policies: Option<Vec<Policy>>,
}

#[derive(Debug, Deserialize)]
struct Named {
    id: String,
}

#[derive(Debug, Deserialize)]
struct Policy {
    rules: Vec<String>,
    subjects: Vec<String>,
}

/// What the settings are, or everything that is wrong with them.
pub(super) fn check(file: &Path) -> Result<String, ConfigErrors> {
    let config = session::from_file(file).map_err(|error| mistake_in(file, None, error))?;
    let access = access_control(&config);
    let mut errors: Vec<ConfigError> = Vec::new();
    for identity in session::identities(&config) {
        errors.extend(identity.problems(None, &[]).into_iter().map(mistake));
    }
    for problem in access.problems() {
        errors.extend(mistake_in(file, None, problem).0);
    }
    let mutual = config.get_json("transport/link/tls/enable_mtls").is_ok_and(|set| set == "true");
    if access.enabled && !mutual {
        let problem = "access control identifies clients by their certificates; it needs \
                       `transport.link.tls.enable_mtls: true`";
        errors.extend(mistake_in(file, None, problem).0);
    }
    if !errors.is_empty() {
        return Err(ConfigErrors(errors));
    }
    let mode = config.get_json("mode").unwrap_or_default();
    Ok(format!("Zenoh settings, mode {}{}", mode.trim_matches('"'), access.summary()))
}

fn access_control(config: &Config) -> AccessControl {
    let text = config.get_json("access_control").unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

impl AccessControl {
    /// Policies that name rules and subjects which are not there.
    fn problems(&self) -> Vec<String> {
        let ids = |named: &Option<Vec<Named>>| -> BTreeSet<String> {
            named.iter().flatten().map(|named| named.id.clone()).collect()
        };
        let (rules, subjects) = (ids(&self.rules), ids(&self.subjects));
        let mut problems = Vec::new();
        for policy in self.policies.iter().flatten() {
            for (what, named, known) in
                [("rule", &policy.rules, &rules), ("subject", &policy.subjects, &subjects)]
            {
                for name in named.iter().filter(|name| !known.contains(*name)) {
                    problems.push(format!(
                        "a policy of `access_control` names the {what} `{name}`, which is not there; \
                         add it or regenerate the file with `trusswatch pki access`"
                    ));
                }
            }
        }
        problems
    }

    fn summary(&self) -> String {
        if !self.enabled {
            return String::new();
        }
        let who = self.subjects.iter().flatten().map(|subject| subject.id.as_str());
        format!(", access control for {}", who.collect::<Vec<_>>().join(", "))
    }
}
