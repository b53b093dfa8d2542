//! Key figures of a structure, for people.

use std::fmt;

use crate::assembly::Mechanics;
use crate::modal::Modes;
use crate::model_error::ModelError;
use crate::structure::{Module, Structure};

/// Number of modes listed.
const MODES_LISTED: usize = 6;

/// Counts, masses, first modes and equipment of a structure. Prints as a table.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureSummary {
    /// Name of the structure.
    pub name: String,
    /// Number of unconnected parts.
    pub parts: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of rods.
    pub rods: usize,
    /// Number of beams.
    pub beams: usize,
    /// Translational degrees of freedom after static condensation.
    pub degrees_of_freedom: usize,
    /// Mass of the members \[kg\].
    pub member_mass_kg: f64,
    /// Mass in addition to the members: that of the storeys \[kg\].
    pub storey_mass_kg: f64,
    /// Mass coefficient of the damping \[1/s\].
    pub alpha_per_s: f64,
    /// Stiffness coefficient of the damping \[s\].
    pub beta_s: f64,
    /// The first modes.
    pub modes: Vec<ModeSummary>,
    /// The modules, in order.
    pub modules: Vec<ModuleSummary>,
}

/// Key figures of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeSummary {
    /// Natural frequency \[Hz\].
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// Key figures of a module.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleSummary {
    /// Name of the module.
    pub name: String,
    /// Number of nodes, its lower interface included.
    pub nodes: usize,
    /// Number of members.
    pub members: usize,
    /// Names of its actuators.
    pub actuators: Vec<String>,
    /// Names of its gages.
    pub gages: Vec<String>,
    /// First frequency of its local model \[Hz\]; `None` if the module cannot stand alone.
    pub local_frequency_hz: Option<f64>,
}

impl Structure {
    /// The key figures of the structure.
    ///
    /// # Errors
    /// The structure does not yield a valid model.
    pub fn summary(&self) -> Result<StructureSummary, ModelError> {
        let parts = self.parts();
        let (mut degrees_of_freedom, mut modes) = (0, Vec::new());
        for part in &parts {
            let mechanics = Mechanics::assemble(part)?;
            let listed = Modes::of(&mechanics, part.damping, Some(MODES_LISTED))?;
            let frequencies_hz = listed.frequencies_hz();
            let pairs = frequencies_hz.iter().zip(&listed.damping_ratios);
            modes.extend(pairs.map(|(&frequency_hz, &damping_ratio)| ModeSummary {
                frequency_hz,
                damping_ratio,
            }));
            degrees_of_freedom += mechanics.dofs.len();
        }
        modes.sort_by(|one, other| one.frequency_hz.total_cmp(&other.frequency_hz));
        modes.truncate(MODES_LISTED);
        let beams = self.members.iter().filter(|member| member.is_beam()).count();
        Ok(StructureSummary {
            name: self.name.to_string(),
            nodes: self.nodes.len(),
            rods: self.members.len() - beams,
            beams,
            parts: parts.len(),
            degrees_of_freedom,
            member_mass_kg: self.members.iter().map(|member| member.mass_kg()).sum(),
            storey_mass_kg: self.nodes.iter().map(|node| node.mass_kg).sum(),
            alpha_per_s: self.damping.alpha_per_s,
            beta_s: self.damping.beta_s,
            modes,
            modules: self.modules.iter().map(|module| self.module_summary(module)).collect(),
        })
    }

    fn module_summary(&self, module: &Module) -> ModuleSummary {
        ModuleSummary {
            name: module.name.to_string(),
            nodes: module.nodes.len(),
            members: module.members.len(),
            actuators: module.actuators.iter().map(|actuator| actuator.name.to_string()).collect(),
            gages: module.gages.iter().map(|gage| gage.name.to_string()).collect(),
            local_frequency_hz: self.local_frequency(module),
        }
    }

    fn local_frequency(&self, module: &Module) -> Option<f64> {
        let local = self.local(&module.name).ok()?;
        let mechanics = Mechanics::assemble(&local).ok()?;
        let modes = Modes::of(&mechanics, local.damping, Some(1)).ok()?;
        modes.frequencies_hz().iter().next().copied()
    }
}

impl fmt::Display for StructureSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let members = self.rods + self.beams;
        writeln!(f, "structure          {}", self.name)?;
        if self.parts > 1 {
            writeln!(f, "parts              {}, each standing by itself", self.parts)?;
        }
        writeln!(f, "nodes              {}", self.nodes)?;
        writeln!(f, "members            {members} ({} beams, {} rods)", self.beams, self.rods)?;
        writeln!(f, "freedoms           {} translations", self.degrees_of_freedom)?;
        writeln!(
            f,
            "mass               {:.0} kg (members {:.0} kg, storeys {:.0} kg)",
            self.member_mass_kg + self.storey_mass_kg,
            self.member_mass_kg,
            self.storey_mass_kg
        )?;
        writeln!(f, "Rayleigh damping   alpha {} 1/s, beta {} s", self.alpha_per_s, self.beta_s)?;
        writeln!(f, "\nmode   frequency    damping")?;
        for (index, mode) in self.modes.iter().enumerate() {
            let percent = 100.0 * mode.damping_ratio;
            writeln!(f, "{:>4}   {:>6.2} Hz   {percent:>6.1} %", index + 1, mode.frequency_hz)?;
        }
        write_modules(f, &self.modules)
    }
}

fn write_modules(f: &mut fmt::Formatter<'_>, modules: &[ModuleSummary]) -> fmt::Result {
    let width = modules.iter().map(|module| module.name.len()).max().unwrap_or(0).max(6);
    writeln!(f, "\n{:<width$}   nodes   members   alone       actuators, gages", "module")?;
    for module in modules {
        let alone = match module.local_frequency_hz {
            Some(frequency) => format!("{frequency:>6.2} Hz"),
            None => "mechanism".to_owned(),
        };
        let equipment: Vec<&str> =
            module.actuators.iter().chain(&module.gages).map(String::as_str).collect();
        let equipment = if equipment.is_empty() { "none".to_owned() } else { equipment.join(" ") };
        let ModuleSummary { name, nodes, members, .. } = module;
        writeln!(f, "{name:<width$}   {nodes:>5}   {members:>7}   {alone:<9}   {equipment}")?;
    }
    Ok(())
}
