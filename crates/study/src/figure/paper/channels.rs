//! Which channels a panel shows.

use vocabulary::{ComponentKind, ComponentPath};

use crate::trace::{ChannelTrace, ModuleTrace};

/// Components of one kind in one module, or in several.
pub(super) struct FigureChannels<'a> {
    pub(super) modules: Vec<&'a ModuleTrace>,
    pub(super) kind: ComponentKind,
}

impl FigureChannels<'_> {
    /// The channels of one of the modules.
    pub(super) fn of<'b>(
        &self,
        module: &'b ModuleTrace,
    ) -> Box<dyn Iterator<Item = &'b ChannelTrace> + 'b> {
        match self.kind {
            ComponentKind::Actuator => Box::new(module.actuators()),
            ComponentKind::Sensor => Box::new(module.gages()),
        }
    }

    pub(super) fn holds(&self, path: &ComponentPath) -> bool {
        path.component.kind() == self.kind
            && self.modules.iter().any(|module| module.module == path.module)
    }

    /// A component's name, with its module's if there are several.
    pub(super) fn name(&self, path: &ComponentPath) -> String {
        match self.modules.len() {
            1 => path.component.name().to_owned(),
            _ => format!("{} {}", path.module, path.component.name()),
        }
    }
}
