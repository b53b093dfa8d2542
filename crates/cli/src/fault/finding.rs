//! Resolves the component named by the user.

use observer::{ModuleView, Scene};
use vocabulary::{FaultTransition, Mention};

use crate::failure::Failure;

/// The state of the named component; an ambiguous name is refused.
pub(super) fn find(scene: &Scene, mention: &Mention) -> Result<FaultTransition, Failure> {
    let all = scene.components();
    let meant: Vec<_> = all.filter(|state| mention.may_be(&state.component)).collect();
    match &meant[..] {
        [one] => Ok((*one).clone()),
        [] => Err(none(scene, mention)),
        several => Err(ambiguous(several, mention)),
    }
}

/// The components of a module that does not answer are unknown.
fn none(scene: &Scene, mention: &Mention) -> Failure {
    let named =
        |module: &&ModuleView| mention.module.as_ref().is_none_or(|name| *name == module.module);
    let mut named = scene.modules.iter().filter(named).peekable();
    if named.peek().is_none() {
        let module = mention.module.as_ref().map_or_else(String::new, ToString::to_string);
        return Failure::network(format!("no module `{module}` was seen"));
    }
    match named.find(|module| !module.answers()) {
        Some(silent) => Failure::network(format!(
            "{} does not answer; its components are unknown",
            silent.module
        )),
        None => Failure::runtime(match &mention.module {
            Some(module) => format!("`{module}` has no component `{}`", mention.component),
            None => format!("no module has a component `{}`", mention.component),
        }),
    }
}

fn ambiguous(several: &[&FaultTransition], mention: &Mention) -> Failure {
    let in_one = several.iter().all(|state| state.structure == several[0].structure);
    let name = |state: &&FaultTransition| match in_one {
        true => format!("`{}`", state.component),
        false => format!("`{}` of `{}`", state.component, state.structure),
    };
    let names: Vec<String> = several.iter().map(name).collect();
    let how = if in_one { "" } else { " with --structure" };
    Failure::usage(format!("`{mention}` may be {}; say which{how}", names.join(" or ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::{latched, module};
    use observer::testing::{mute, scene, state};
    use vocabulary::{FaultState, ModulePhase};

    fn tower() -> Scene {
        let normal = || state("m1/sensor/g1", FaultState::Normal);
        let first = vec![normal(), latched("m1/sensor/g2")];
        let second = vec![state("m2/sensor/g1", FaultState::Normal)];
        scene(vec![
            module("m1", ModulePhase::InService, first),
            module("m2", ModulePhase::InService, second),
        ])
    }

    fn failure(scene: &Scene, mention: &str) -> Failure {
        find(scene, &mention.parse().unwrap()).unwrap_err()
    }

    #[test]
    fn a_component_is_found_by_its_path_and_by_its_name_where_that_is_unique() {
        for mention in ["m1/sensor/g2", "sensor/g2"] {
            let found = find(&tower(), &mention.parse().unwrap()).unwrap();
            assert_eq!(found.component.to_string(), "m1/sensor/g2");
        }
        let expected = "`sensor/g1` may be `m1/sensor/g1` or `m2/sensor/g1`; say which";
        assert_eq!(failure(&tower(), "sensor/g1"), Failure::usage(expected));
    }

    #[test]
    fn a_component_of_two_structures_is_not_guessed_at() {
        let mut scene = tower();
        let other = FaultTransition {
            structure: "bridge".parse().unwrap(),
            ..state("m1/sensor/g2", FaultState::Normal)
        };
        scene.modules.push(module("m1", ModulePhase::InService, vec![other]));
        let expected = "`sensor/g2` may be `m1/sensor/g2` of `tower` or `m1/sensor/g2` of `bridge`; \
                        say which with --structure";
        assert_eq!(failure(&scene, "sensor/g2"), Failure::usage(expected));
    }

    #[test]
    fn an_unknown_component_differs_from_one_that_does_not_answer() {
        let expected = Failure::runtime("`m1` has no component `sensor/g9`");
        assert_eq!(failure(&tower(), "m1/sensor/g9"), expected);
        let expected = Failure::runtime("no module has a component `sensor/g9`");
        assert_eq!(failure(&tower(), "sensor/g9"), expected);
        assert_eq!(failure(&tower(), "m3/sensor/g1"), Failure::network("no module `m3` was seen"));
        let mut scene = tower();
        scene.modules.push(mute("m3", Some("m1")));
        let expected = "m3 does not answer; its components are unknown";
        assert_eq!(failure(&scene, "m3/sensor/g1"), Failure::network(expected));
        assert_eq!(failure(&scene, "sensor/g9"), Failure::network(expected));
    }
}
