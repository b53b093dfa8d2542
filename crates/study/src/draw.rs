//! Draws components and faults at random.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use truss::Structure;
use vocabulary::{ComponentPath, fault::FaultKind};

use crate::system::{System, generator};

/// Draws the events of a case.
pub(crate) struct Draw<'a> {
    pub(crate) system: &'a System,
    pub(crate) generator: ChaCha8Rng,
}

impl<'a> Draw<'a> {
    pub(crate) fn new(system: &'a System, stream: u64) -> Self {
        Self { system, generator: generator(system.seed, stream) }
    }

    pub(crate) fn uniform(&mut self, [from, to]: [f64; 2]) -> f64 {
        self.generator.random_range(from..=to)
    }

    /// A log-uniformly distributed value.
    pub(crate) fn log_uniform(&mut self, [from, to]: [f64; 2]) -> f64 {
        self.uniform([from.ln(), to.ln()]).exp()
    }

    pub(crate) fn sign(&mut self) -> f64 {
        if self.generator.random() { 1.0 } else { -1.0 }
    }

    pub(crate) fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.generator.random_range(0..all.len())]
    }

    /// A random component that can have this kind of fault and is not among those `taken`, all equally likely.
    pub(crate) fn component(
        &mut self,
        kind: FaultKind,
        taken: &[ComponentPath],
    ) -> Option<ComponentPath> {
        let fitting = self.fitting(kind, taken);
        // An empty list has no first component either.
        let place = self.generator.random_range(0..fitting.len().max(1));
        fitting.get(place).cloned()
    }

    /// The components that can have this kind of fault and are not among those `taken`.
    pub(crate) fn fitting(&self, kind: FaultKind, taken: &[ComponentPath]) -> Vec<ComponentPath> {
        let mut fitting = components_that_can_have(&self.system.structure, kind);
        fitting.retain(|component| !taken.contains(component));
        fitting
    }
}

/// The components of the structure that can have this kind of fault, module by module.
pub(crate) fn components_that_can_have(
    structure: &Structure,
    kind: FaultKind,
) -> Vec<ComponentPath> {
    let paths = structure.equipped().flat_map(|module| {
        let of = |component| ComponentPath { module: module.name.clone(), component };
        module.components().map(of)
    });
    paths.filter(|path| path.component.kind() == kind.component_kind()).collect()
}
