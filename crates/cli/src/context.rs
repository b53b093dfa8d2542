//! Where a client command connects: set by its flags, then by environment variables, then by a context of the client
//! file.
//!
//! ```toml
//! default = "site"                       # used without --context
//!
//! [context.site]
//! connect = ["tls/192.0.2.10:7447"]
//! tls = "/home/ada/pki/operator.ada"     # relative to this file
//! structure = "tower"
//! ```

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use session::{Mode, endpoint};
use vocabulary::StructureName;

use crate::failure::Failure;

/// The environment variable with the path of the client file, if it is not in one of the usual places.
const FILE_VARIABLE: &str = "TRUSSWATCH_CLIENT";
const SYSTEM_FILE: &str = "/etc/trusswatch/client.toml";

/// Settings from a context, from environment variables or from flags.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Context {
    pub(crate) mode: Option<Mode>,
    pub(crate) listen: Vec<String>,
    pub(crate) connect: Vec<String>,
    pub(crate) tls: Option<PathBuf>,
    pub(crate) zenoh: Option<PathBuf>,
    pub(crate) structure: Option<StructureName>,
}

/// The content of the file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ClientFile {
    default: Option<String>,
    #[serde(default)]
    context: BTreeMap<String, Context>,
}

impl Context {
    /// Whether it contains an endpoint.
    pub(crate) fn names_a_place(&self) -> bool {
        !self.connect.is_empty() || !self.listen.is_empty() || self.zenoh.is_some()
    }

    /// Takes missing settings from `other`.
    pub(crate) fn or(self, other: Self) -> Self {
        let places = if self.names_a_place() { &self } else { &other }.clone();
        Self {
            mode: self.mode.or(other.mode),
            listen: places.listen,
            connect: places.connect,
            zenoh: places.zenoh,
            tls: self.tls.or(other.tls),
            structure: self.structure.or(other.structure),
        }
    }

    /// `TRUSSWATCH_CONNECT` (endpoints separated by commas), `TRUSSWATCH_TLS`, `TRUSSWATCH_STRUCTURE`.
    pub(crate) fn from_environment() -> Result<Self, Failure> {
        Self::from_variables(|name| env::var(name).ok().filter(|value| !value.is_empty()))
    }

    fn from_variables(variable: impl Fn(&str) -> Option<String>) -> Result<Self, Failure> {
        let wrong = |name: &str, error: &dyn std::fmt::Display| {
            Failure::usage(format!("environment variable {name}: {error}"))
        };
        let connect = variable("TRUSSWATCH_CONNECT").unwrap_or_default();
        let connect: Vec<String> =
            connect.split(',').map(str::trim).filter(|s| !s.is_empty()).map(Into::into).collect();
        for text in &connect {
            endpoint(text).map_err(|error| wrong("TRUSSWATCH_CONNECT", &error))?;
        }
        let structure = variable("TRUSSWATCH_STRUCTURE").map(|name| name.parse()).transpose();
        let structure = structure.map_err(|error| wrong("TRUSSWATCH_STRUCTURE", &error))?;
        let tls = variable("TRUSSWATCH_TLS").map(PathBuf::from);
        Ok(Self { connect, tls, structure, ..Self::default() })
    }

    /// The context with this name; without a name the file's default, or its only one. Without a file and a name, an
    /// empty context.
    pub(crate) fn from_file(name: Option<&str>) -> Result<Self, Failure> {
        let given = env::var_os(FILE_VARIABLE).map(PathBuf::from);
        let file = given.or_else(|| usual_places().into_iter().find(|file| file.exists()));
        match (file, name) {
            (Some(file), name) => Self::read(&file, name),
            (None, None) => Ok(Self::default()),
            (None, Some(name)) => {
                let places: Vec<_> =
                    usual_places().iter().map(|place| place.display().to_string()).collect();
                let places = places.join(" or ");
                Err(Failure::input(format!(
                    "no client file has a context `{name}`: write {places}"
                )))
            }
        }
    }

    fn read(file: &Path, name: Option<&str>) -> Result<Self, Failure> {
        let here = file.display();
        let text = fs::read_to_string(file).map_err(|error| Failure::unreadable(file, error))?;
        let ClientFile { default, context } = toml::from_str(&text).map_err(|error| {
            let before = error.span().map_or("", |span| &text[..span.start]);
            let line = before.matches('\n').count() + 1;
            Failure::input(format!("{here}:{line}: {}", error.message()))
        })?;
        let only = || context.keys().next().filter(|_| context.len() == 1).cloned();
        let Some(name) = name.map(ToOwned::to_owned).or(default).or_else(only) else {
            return Ok(Self::default());
        };
        let Some(found) = context.get(&name) else {
            let known: Vec<_> = context.keys().map(|name| format!("`{name}`")).collect();
            let known = known.join(", ");
            return Err(Failure::input(format!(
                "{here}: unknown context `{name}`; expected one of {known}"
            )));
        };
        for text in found.connect.iter().chain(&found.listen) {
            endpoint(text).map_err(|error| Failure::input(format!("{here}: {name}: {error}")))?;
        }
        let beside =
            |path: &PathBuf| file.parent().map_or(path.clone(), |parent| parent.join(path));
        let (tls, zenoh) = (found.tls.as_ref().map(beside), found.zenoh.as_ref().map(beside));
        Ok(Self { tls, zenoh, ..found.clone() })
    }
}

fn usual_places() -> Vec<PathBuf> {
    let home = || Some(PathBuf::from(env::var_os("HOME")?).join(".config"));
    let own = env::var_os("XDG_CONFIG_HOME").map(PathBuf::from).or_else(home);
    let own = own.map(|folder| folder.join("trusswatch/client.toml"));
    own.into_iter().chain([PathBuf::from(SYSTEM_FILE)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "default = \"site\"\n\
        [context.site]\nconnect = [\"tls/192.0.2.10:7447\"]\ntls = \"pki/ada\"\nstructure = \"tower\"\n\
        [context.rig]\nconnect = [\"tcp/127.0.0.1:7447\"]\nmode = \"peer\"\n";

    fn file(text: &str) -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("client.toml");
        fs::write(&file, text).unwrap();
        (directory, file)
    }

    #[test]
    fn a_context_is_chosen_by_name_or_by_default() {
        let (directory, file) = file(FILE);
        let site = Context::read(&file, None).unwrap();
        assert_eq!(site.connect, ["tls/192.0.2.10:7447"]);
        assert_eq!(site.tls, Some(directory.path().join("pki/ada")));
        let rig = Context::read(&file, Some("rig")).unwrap();
        assert_eq!((rig.mode, rig.tls), (Some(Mode::Peer), None));
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        for (text, words) in [
            (FILE.replace("tls =", "tsl ="), ":4: unknown field `tsl`"),
            (FILE.replace("tcp/127", "127"), "rig: `127.0.0.1:7447` is not a valid endpoint"),
        ] {
            let (_directory, file) = file(&text);
            let error = format!("{:?}", Context::read(&file, Some("rig")).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
        let (_directory, file) = file(FILE);
        let error = format!("{:?}", Context::read(&file, Some("lab")).unwrap_err());
        assert!(error.contains("unknown context `lab`; expected one of `rig`, `site`"), "{error}");
    }

    #[test]
    fn the_environment_goes_before_the_file_and_its_places_replace_the_files() {
        let set = |name: &str| match name {
            "TRUSSWATCH_CONNECT" => Some("tcp/a:1, tcp/b:2".to_owned()),
            "TRUSSWATCH_STRUCTURE" => Some("bridge".to_owned()),
            _ => None,
        };
        let (_directory, file) = file(FILE);
        let site = Context::read(&file, None).unwrap();
        let merged = Context::from_variables(set).unwrap().or(site.clone());
        assert_eq!(merged.connect, ["tcp/a:1", "tcp/b:2"]);
        assert_eq!(merged.structure.unwrap().as_str(), "bridge");
        assert_eq!(merged.tls, site.tls);
        let wrong = |name: &str| (name == "TRUSSWATCH_CONNECT").then(|| "here".to_owned());
        let error = format!("{:?}", Context::from_variables(wrong).unwrap_err());
        assert!(error.contains("TRUSSWATCH_CONNECT: `here` is not a valid endpoint"), "{error}");
    }
}
