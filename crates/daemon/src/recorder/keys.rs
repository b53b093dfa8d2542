//! What is to be recorded, as key expressions.

use vocabulary::{
    ModuleName, StructureName,
    keys::{PLANT, ROOT, Watched},
};
use zenoh::key_expr::KeyExpr;

/// How files are called if no structure is named.
const ANY: &str = "trusswatch";

/// What a module publishes, but for corrected readings: these follow from the samples, and subscribing to them would make
/// every module publish them at every step.
const OF_MODULE: [&str; 12] = [
    "sample",
    "divergence",
    "capability",
    "change",
    "fault/**",
    "identification/**",
    "status",
    "progress",
    "phase",
    "input",
    "freeze-frame",
    "alive",
];

/// What is to be recorded.
#[derive(Debug, Clone, Default)]
pub struct RecordedKeys {
    /// This structure only.
    pub structure: Option<StructureName>,
    /// These modules only; without any, everything of the structure.
    pub modules: Vec<ModuleName>,
    /// These key expressions as well, or only these if no module is named.
    pub keys: Vec<String>,
}

impl RecordedKeys {
    /// What files are called.
    #[must_use]
    pub fn name(&self) -> &str {
        self.structure.as_ref().map_or(ANY, StructureName::as_str)
    }

    /// The key expressions.
    #[must_use]
    pub fn expressions(&self) -> Vec<String> {
        let structure = self.structure.as_ref().map_or("*", StructureName::as_str);
        let modules = self.modules.iter().map(|module| format!("{ROOT}/{structure}/{module}/**"));
        let mut expressions: Vec<String> = modules.chain(self.keys.iter().cloned()).collect();
        if expressions.is_empty() {
            let whole = self.structure.as_ref().map(|structure| format!("{ROOT}/{structure}/**"));
            expressions.push(whole.unwrap_or_else(|| format!("{ROOT}/**")));
        }
        expressions
    }

    /// What is subscribed to: what modules and plant publish but corrected readings; other keys as they are.
    fn subscribed(&self) -> Vec<String> {
        let structure = self.structure.as_ref().map_or("*", StructureName::as_str);
        let of_module =
            |module: &str| OF_MODULE.map(|topic| format!("{ROOT}/{structure}/{module}/{topic}"));
        let modules = self.modules.iter().flat_map(|module| of_module(module.as_str()));
        let mut all: Vec<String> = modules.chain(self.keys.iter().cloned()).collect();
        if all.is_empty() {
            all.push(format!("{ROOT}/{structure}/{PLANT}/**"));
            all.extend(of_module("*"));
        }
        all
    }

    /// The same such that no message comes twice: each with earlier ones, whose messages it leaves out.
    pub(super) fn distinct(&self) -> zenoh::Result<Vec<(KeyExpr<'static>, Vec<KeyExpr<'static>>)>> {
        let mut all: Vec<KeyExpr<'static>> = Vec::new();
        for text in self.subscribed() {
            let expression = KeyExpr::new(text)?;
            if all.iter().any(|other| other.includes(&expression)) {
                continue;
            }
            all.retain(|other| !expression.includes(other));
            all.push(expression);
        }
        let distinct = all.iter().enumerate().map(|(index, whole)| {
            let earlier = all[..index].iter().filter(|other| other.intersects(whole));
            (whole.clone(), earlier.cloned().collect())
        });
        Ok(distinct.collect())
    }

    /// Does what is on this key belong to it?
    pub(super) fn has(&self, key: &str) -> bool {
        let Ok(key) = KeyExpr::new(key) else { return false };
        let expressions = self.expressions().into_iter().filter_map(|text| KeyExpr::new(text).ok());
        expressions.into_iter().any(|expression| expression.intersects(&key))
    }

    /// Liveliness tokens of whose setup is asked for.
    pub(super) fn tokens(&self) -> String {
        Watched { structure: self.structure.as_ref(), module: None }.tokens()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(structure: Option<&str>, modules: &[&str], keys: &[&str]) -> RecordedKeys {
        RecordedKeys {
            structure: structure.map(|name| name.parse().unwrap()),
            modules: modules.iter().map(|name| name.parse().unwrap()).collect(),
            keys: keys.iter().map(|key| (*key).to_owned()).collect(),
        }
    }

    #[test]
    fn without_a_wish_everything_is_recorded() {
        assert_eq!(keys(None, &[], &[]).expressions(), ["trusswatch/**"]);
        let tower = keys(Some("tower"), &[], &[]);
        assert_eq!((tower.name(), &*tower.expressions()[0]), ("tower", "trusswatch/tower/**"));
        assert!(tower.has("trusswatch/tower/m/input") && !tower.has("trusswatch/t/m/input"));
        let hears = |key: &str| {
            let key = KeyExpr::new(key).unwrap();
            tower.distinct().unwrap().iter().any(|(whole, _)| whole.includes(&key))
        };
        assert!(hears("trusswatch/tower/m/sample") && hears("trusswatch/tower/plant/status"));
        assert!(!hears("trusswatch/tower/m/corrected"), "it would be published for this alone");
    }

    #[test]
    fn no_message_comes_twice() {
        let overlapping =
            ["trusswatch/*/*/sample", "trusswatch/tower/m1/fault/**", "trusswatch/tower/*/sample"];
        let distinct = keys(Some("tower"), &["m1"], &overlapping).distinct().unwrap();
        let last = distinct.last().unwrap();
        assert_eq!((last.0.as_str(), last.1.len()), ("trusswatch/*/*/sample", 0));
        assert!(distinct.iter().all(|(whole, _)| *whole.as_str() != *"trusswatch/tower/m1/sample"));
        assert!(keys(None, &[], &["a//b"]).distinct().is_err());
    }
}
