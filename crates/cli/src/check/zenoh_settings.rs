//! Checks files of Zenoh's own settings, with their certificates and access control, and directories with a holder's
//! certificate and key.

use std::path::Path;

use pki::{Certificate, Identity};
use serde_json::Value;
use session::mistake;
use settings::{ConfigError, ConfigErrors};

use super::mistake as mistake_in;

/// The kind of the settings, or all their problems.
pub(super) fn check_settings(file: &Path) -> Result<String, ConfigErrors> {
    let config = session::from_file(file).map_err(|error| mistake_in(file, None, error))?;
    // Zenoh itself checks access control only at its start.
    let access = config.get_json("access_control").unwrap_or_default();
    let access: Value = serde_json::from_str(&access).unwrap_or_default();
    let is_enabled = access["enabled"] == true;
    let mut errors: Vec<ConfigError> = Vec::new();
    for identity in session::identities(&config) {
        errors.extend(identity.problems(None, &[]).into_iter().map(mistake));
    }
    for problem in unknown_names(&access) {
        errors.extend(mistake_in(file, None, problem).0);
    }
    let mutual = config.get_json("transport/link/tls/enable_mtls").is_ok_and(|set| set == "true");
    if is_enabled && !mutual {
        let problem = "access control identifies clients by their certificates; it needs \
                       `transport.link.tls.enable_mtls: true`";
        errors.extend(mistake_in(file, None, problem).0);
    }
    if !errors.is_empty() {
        return Err(ConfigErrors(errors));
    }
    let mode = config.get_json("mode").unwrap_or_default();
    let subjects = match is_enabled {
        true => format!(", access control for {}", ids(&access["subjects"]).join(", ")),
        false => String::new(),
    };
    Ok(format!("Zenoh settings, mode {}{subjects}", mode.trim_matches('"')))
}

/// Rules and subjects that policies refer to but that do not exist.
fn unknown_names(access: &Value) -> Vec<String> {
    let (rules, subjects) = (ids(&access["rules"]), ids(&access["subjects"]));
    let mut problems = Vec::new();
    for policy in entries(&access["policies"]) {
        for (what, named, known) in
            [("rule", &policy["rules"], &rules), ("subject", &policy["subjects"], &subjects)]
        {
            let named = entries(named).iter().filter_map(Value::as_str);
            for name in named.filter(|name| !known.contains(name)) {
                problems.push(format!(
                    "a policy of `access_control` names the {what} `{name}`, which is not there; \
                     add it or regenerate the file with `trusswatch pki access`"
                ));
            }
        }
    }
    problems
}

fn entries(list: &Value) -> &[Value] {
    list.as_array().map_or(&[], Vec::as_slice)
}

fn ids(list: &Value) -> Vec<&str> {
    entries(list).iter().filter_map(|entry| entry["id"].as_str()).collect()
}

/// The holder of the certificate in a directory, or all problems of the directory.
pub(super) fn check_identity(directory: &Path) -> Result<String, ConfigErrors> {
    let identity = Identity::in_directory(directory);
    let problems = identity.problems(None, &[]);
    if !problems.is_empty() {
        return Err(ConfigErrors(problems.into_iter().map(mistake).collect()));
    }
    let read = Certificate::read(&identity.certificate)
        .map_err(|error| mistake_in(&identity.certificate, None, error))?;
    let name = read.common_name.unwrap_or_else(|| "unnamed".to_owned());
    Ok(format!("certificate of `{name}`, until {}", read.lifetime.until.date()))
}
