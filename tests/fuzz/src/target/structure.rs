//! Descriptions of structures.

use truss::{ModalStepper, Structure};

use crate::refusal::{is_bearable, lines};

/// Larger structures are read, but no models are made of them: that takes long, and says nothing new.
const MOST_NODES: usize = 16;
/// Length of a step \[s\].
const STEP_S: f64 = 1e-3;

/// A description written out describes the same; each module can be cut out, once and for all; a model is
/// finite or refused; a mistake is named with its line.
pub(super) fn check(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let structure = match Structure::from_toml(text) {
        Ok(structure) => structure,
        Err(errors) => {
            assert!(errors.iter().len() > 0, "refused without a mistake");
            for error in errors.iter() {
                is_bearable(&error.to_string());
                assert!(
                    error.line.is_none_or(|line| (1..=lines(bytes)).contains(&line)),
                    "{error}"
                );
            }
            return;
        }
    };
    comes_back(&structure);
    for module in &structure.modules {
        let local = structure.local(&module.name).unwrap();
        assert_eq!(local.local(&module.name).as_ref(), Ok(&local), "cut out twice");
        comes_back(&local);
        if local.nodes.len() <= MOST_NODES {
            has_finite_model(&local);
        }
    }
    if structure.nodes.len() <= MOST_NODES {
        let drawing = figure::structure::drawing(&structure);
        assert!(drawing.contains("</svg>") && !drawing.contains("NaN"), "{drawing}");
    }
}

fn comes_back(structure: &Structure) {
    let written = structure.to_toml();
    match Structure::from_toml(&written) {
        Ok(back) => assert_eq!(back, *structure, "{written}"),
        Err(errors) => panic!("{errors}\n{written}"),
    }
}

/// Every elongation after a push is a finite number, or there is no model.
fn has_finite_model(local: &Structure) {
    match ModalStepper::of_module(local, STEP_S) {
        Ok(mut model) => {
            let forces_n = vec![1000.0; model.input_count()];
            let mut elongations_m = vec![0.0; model.output_count()];
            for _ in 0..3 {
                model.step(&forces_n, &[]);
                model.outputs(&mut elongations_m);
                assert!(elongations_m.iter().all(|x| x.is_finite()), "{elongations_m:?}");
            }
        }
        Err(error) => is_bearable(&error.to_string()),
    }
}
