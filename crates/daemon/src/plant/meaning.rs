//! Which component of the plant an order means.

use plant::Plant;
use vocabulary::{ComponentPath, Mention};

/// The component that is mentioned: where no module is given, the only one of that name.
pub(crate) fn meant(mention: &Mention, plant: &Plant) -> Result<ComponentPath, String> {
    if let Mention { module: Some(module), component } = mention {
        return Ok(ComponentPath { module: module.clone(), component: component.clone() });
    }
    let all: Vec<_> = plant.components().filter(|path| mention.may_be(path)).collect();
    match all.as_slice() {
        [only] => Ok((*only).clone()),
        [] => Err(format!("no module has a component `{mention}`")),
        several => {
            let paths: Vec<String> = several.iter().map(|path| format!("`{path}`")).collect();
            Err(format!("`{mention}` may be {}; write which", paths.join(" or ")))
        }
    }
}
