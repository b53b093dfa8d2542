//! The faults of components.

use truss::Structure;
use vocabulary::{
    ComponentPath, ModuleName,
    fault::{Fault, FaultError, FaultKind},
};

/// Why a fault cannot be injected or cleared; nothing was changed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InjectError {
    /// No equipped module has this name.
    #[error("unknown equipped module `{module}`: expected one of {known}")]
    UnknownModule {
        /// The requested module.
        module: ModuleName,
        /// The equipped modules.
        known: String,
    },
    /// The module has no such component.
    #[error("there is no `{path}`; module `{module}` has {known}", module = path.module)]
    UnknownComponent {
        /// The requested component.
        path: ComponentPath,
        /// The components of the module.
        known: String,
    },
    /// A fault of an actuator for a gage, or vice versa.
    #[error("`{path}` cannot have the fault `{kind}`; use it for an {expected}", expected = kind.component_kind())]
    WrongKind {
        /// The requested component.
        path: ComponentPath,
        /// The requested fault.
        kind: FaultKind,
    },
    /// A parameter of the fault is out of range.
    #[error(transparent)]
    Fault(#[from] FaultError),
}

/// A component by its number among all of its kind in a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Slot {
    Actuator(usize),
    Gage(usize),
}

/// The position of a component in the plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PartSlot {
    /// Number of the part.
    pub(crate) part: usize,
    /// The component within the part.
    pub(crate) slot: Slot,
}

/// The components of the plant, and their faults.
#[derive(Debug, Clone)]
pub(crate) struct Injections {
    components: Vec<(ComponentPath, PartSlot)>,
    present: Vec<(ComponentPath, Fault)>,
}

impl Injections {
    pub(crate) fn new(parts: &[Structure]) -> Self {
        let mut components = Vec::new();
        for (number, part) in parts.iter().enumerate() {
            let (mut actuators, mut gages) = (0, 0);
            for module in &part.modules {
                let mut add = |component, place| {
                    let path = ComponentPath { module: module.name.clone(), component };
                    components.push((path, PartSlot { part: number, slot: place }));
                };
                for actuator in &module.actuators {
                    let name = actuator.name.clone();
                    add(vocabulary::Component::Actuator(name), Slot::Actuator(actuators));
                    actuators += 1;
                }
                for gage in &module.gages {
                    add(vocabulary::Component::Sensor(gage.name.clone()), Slot::Gage(gages));
                    gages += 1;
                }
            }
        }
        Self { components, present: Vec::new() }
    }

    /// Records a fault, replacing any present one of the component; returns the position of the component.
    pub(crate) fn inject(
        &mut self,
        path: &ComponentPath,
        fault: Fault,
    ) -> Result<PartSlot, InjectError> {
        let place = self.place(path)?;
        if fault.kind().component_kind() != path.component.kind() {
            return Err(InjectError::WrongKind { path: path.clone(), kind: fault.kind() });
        }
        fault.check()?;
        self.present.retain(|(present, _)| present != path);
        self.present.push((path.clone(), fault));
        Ok(place)
    }

    /// Removes a component's fault; returns its position if there was one.
    pub(crate) fn clear(&mut self, path: &ComponentPath) -> Result<Option<PartSlot>, InjectError> {
        let place = self.place(path)?;
        let before = self.present.len();
        self.present.retain(|(present, _)| present != path);
        Ok((self.present.len() < before).then_some(place))
    }

    pub(crate) fn components(&self) -> impl Iterator<Item = &ComponentPath> {
        self.components.iter().map(|(path, _)| path)
    }

    pub(crate) fn present(&self) -> &[(ComponentPath, Fault)] {
        &self.present
    }

    /// The names of all actuators.
    pub(crate) fn actuators(&self) -> impl Iterator<Item = String> {
        let actuator =
            |(_, place): &&(ComponentPath, PartSlot)| matches!(place.slot, Slot::Actuator(_));
        self.components.iter().filter(actuator).map(|(path, _)| format!("`{path}`"))
    }

    /// The position of a component, if it exists.
    pub(crate) fn place_of(&self, path: &ComponentPath) -> Option<PartSlot> {
        let found = self.components.iter().find(|(known, _)| known == path);
        found.map(|(_, place)| *place)
    }

    /// The position of a component.
    pub(crate) fn place(&self, path: &ComponentPath) -> Result<PartSlot, InjectError> {
        self.place_of(path).ok_or_else(|| self.unknown(path))
    }

    pub(crate) fn unknown(&self, path: &ComponentPath) -> InjectError {
        let in_module = self.components.iter().filter(|(known, _)| known.module == path.module);
        let known: Vec<String> =
            in_module.map(|(known, _)| format!("`{}`", known.component)).collect();
        if !known.is_empty() {
            return InjectError::UnknownComponent { path: path.clone(), known: known.join(", ") };
        }
        let mut modules: Vec<String> =
            self.components.iter().map(|(known, _)| format!("`{}`", known.module)).collect();
        modules.dedup();
        InjectError::UnknownModule { module: path.module.clone(), known: modules.join(", ") }
    }
}
