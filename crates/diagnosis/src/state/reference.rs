//! What is known of a module while it was healthy: the Gaussians of its window means under the weather and the forces
//! that were seen, and the thresholds that follow from them.

use serde::{Deserialize, Serialize};
use vocabulary::{Component, ComponentPath, ModuleName};

use super::gaussian::Gaussian;
use super::reconstruction::ReconstructionError;
use crate::settings::ModuleSetup;
use vocabulary::WindowLength;

/// Version of the file.
pub const REFERENCE_VERSION: u32 = 4;

/// The reference of one module.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Version of the format.
    #[serde(rename = "v")]
    pub version: u32,
    /// The module.
    pub module: ModuleName,
    /// Fingerprint of the settings that residuals depend on ([`residual_settings`]).
    pub settings: String,
    /// Hours of data that it was learnt from.
    pub hours: f64,
    /// The rate of false alarms of the module that the thresholds are for, at most \[1/h\].
    pub false_alarms_per_hour: f64,
    /// z' from which on a cylinder has departed.
    pub cylinder_threshold: f64,
    /// Whose gages the first values of all `means` are: the module's own, then its peers'.
    pub gages: Vec<ComponentPath>,
    /// Whose forces the other values of `means` are, in the same order of modules, with what was seen of them.
    pub forces: Vec<ForceRange>,
    /// Over windows of a second.
    pub long: MeansReference,
    /// Over windows of a tenth of a second.
    pub short: MeansReference,
    /// How gage residuals \[m\] and forces \[N\] over windows of a tenth of a second move about the mean of their snippet.
    pub moving: Gaussian,
    /// How well each of its own gages is reconstructed from the other gages and the forces.
    pub reconstructions: Vec<ReconstructionError>,
    /// Each of its cylinders: mean tracking residual \[N\], oil content \[Pa\], force \[N\], its rate \[N/s\].
    pub cylinders: Vec<Gaussian>,
}

/// Gages and forces over windows of one length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeansReference {
    /// z' from which on a gage is displaced, if all peers have answered.
    pub gage_threshold: f64,
    /// The same if not.
    pub gage_threshold_alone: f64,
    /// The largest z' of a healthy gage in snippets that had been left out, by modules that answered: none, all.
    pub largest_left_out: [f64; 2],
    /// Of gage residuals \[m\] and forces \[N\].
    pub means: Gaussian,
    /// Each of the module's own gages.
    pub own_gages: Vec<GageReference>,
}

impl MeansReference {
    /// Everything of it that cannot be right, if the module has so many gages and there are so many values.
    fn problems(&self, gages: usize, values: usize) -> Vec<String> {
        let mut problems: Vec<String> = self.means.problem("means", values).into_iter().collect();
        if self.own_gages.len() != gages {
            problems.push(format!("`own_gages` are {}; use {gages}", self.own_gages.len()));
        }
        let of_gages = self.own_gages.iter().flat_map(|gage| {
            [
                figure("scatter_m2", gage.scatter_m2, POSITIVE),
                figure("largest_swing_m2", gage.largest_swing_m2, NOT_NEGATIVE),
            ]
        });
        let of_all = [
            figure("gage_threshold", self.gage_threshold, POSITIVE),
            figure("gage_threshold_alone", self.gage_threshold_alone, POSITIVE),
        ];
        let left_out = self.largest_left_out.map(|z| figure("largest_left_out", z, NOT_NEGATIVE));
        problems.extend(of_gages.chain(of_all).chain(left_out).flatten());
        problems
    }
}

/// The smallest number of a range, and the range in words; every range ends at the largest finite number.
type Range = (f64, &'static str);

const POSITIVE: Range = (f64::MIN_POSITIVE, "a finite number above 0");
const NOT_NEGATIVE: Range = (0.0, "0 or a finite number above 0");
const FINITE: Range = (f64::MIN, "a finite number");

/// What is wrong with a figure of this name.
fn figure(name: &str, value: f64, (least, words): Range) -> Option<String> {
    let is_right = value.is_finite() && value >= least;
    (!is_right).then(|| format!("`{name}` is {value}; use {words}"))
}

/// The forces of a cylinder that were seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceRange {
    /// The cylinder.
    pub actuator: ComponentPath,
    /// The least mean force of a window \[N\].
    pub least_n: f64,
    /// The largest \[N\].
    pub largest_n: f64,
}

impl ForceRange {
    /// Is this force within what was seen, and a tenth of its width on either side?
    pub(crate) fn has_seen(&self, force_n: f64) -> bool {
        let margin = 0.1 * (self.largest_n - self.least_n);
        (self.least_n - margin..=self.largest_n + margin).contains(&force_n)
    }
}

/// What is known of a gage beside its mean.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GageReference {
    /// Mean variance of its white noise \[m²\].
    pub scatter_m2: f64,
    /// Largest variance of its residual within a window \[m²\].
    pub largest_swing_m2: f64,
}

/// A reference that does not fit the module.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReferenceProblem {
    /// Written by another version.
    #[error("its version is {0}; this program reads version {REFERENCE_VERSION}: commission again")]
    Version(u32),
    /// Another module's.
    #[error("it is the reference of `{found}`; give that of `{expected}`")]
    OtherModule {
        /// Whose it is.
        found: ModuleName,
        /// Whose it should be.
        expected: ModuleName,
    },
    /// Made with other settings.
    #[error(
        "it was made with other settings of structure, hydraulics, sampling or residual (fingerprint {found}, now {expected}): commission again"
    )]
    OtherSettings {
        /// Its fingerprint.
        found: String,
        /// That of the module as it is configured.
        expected: String,
    },
    /// It lists other components than the module has.
    #[error("its components are not those of the module and its peers: commission again")]
    Components,
    /// A length or a figure that cannot be.
    #[error("{0}: commission again")]
    Figures(String),
}

/// Distinguishes settings that residuals depend on from others.
#[must_use]
pub fn residual_settings(setup: &ModuleSetup) -> String {
    let ModuleSetup { structure, hydraulics, step_s, detection, .. } = setup;
    let residual = detection.actuator_residual;
    let hydraulics = hydraulics.as_ref().map_or_else(String::new, |figures| format!("{figures:?}"));
    let text = format!("{}\n{hydraulics}\n{step_s:?}\n{residual:?}", structure.to_toml());
    fingerprint(&text)
}

/// Distinguishes a text from others. FNV-1a: the same on every machine and in every version.
#[must_use]
pub fn fingerprint(text: &str) -> String {
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

impl Reference {
    /// Distinguishes it from other references.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        fingerprint(&format!("{self:?}"))
    }

    /// Everything that keeps it from being used with a module.
    #[must_use]
    pub fn problems(&self, setup: &ModuleSetup) -> Vec<ReferenceProblem> {
        if self.version != REFERENCE_VERSION {
            return vec![ReferenceProblem::Version(self.version)];
        }
        if self.module != setup.module {
            let (found, expected) = (self.module.clone(), setup.module.clone());
            return vec![ReferenceProblem::OtherModule { found, expected }];
        }
        let mut problems = Vec::new();
        let expected = residual_settings(setup);
        if self.settings != expected {
            let found = self.settings.clone();
            problems.push(ReferenceProblem::OtherSettings { found, expected });
        }
        let components = setup.components();
        let own = components.iter().filter(|component| matches!(component, Component::Sensor(_)));
        let own_gages = self.gages_of(&self.module).map(|path| &path.component);
        let known_peer =
            |path: &ComponentPath| path.module == self.module || setup.peers.contains(&path.module);
        let fits = own.eq(own_gages)
            && self.forces_of(&self.module).count() == setup.actuators()
            && self.gages.iter().chain(self.forces.iter().map(|f| &f.actuator)).all(known_peer);
        if !fits {
            problems.push(ReferenceProblem::Components);
        }
        problems.extend(self.figure_problems());
        problems
    }

    /// Everything in its lengths and figures that cannot be right, whatever the module's settings are.
    #[must_use]
    pub fn figure_problems(&self) -> Vec<ReferenceProblem> {
        let (gages, cylinders) =
            (self.gages_of(&self.module).count(), self.forces_of(&self.module).count());
        let figures = [
            figure("hours", self.hours, NOT_NEGATIVE),
            figure("false_alarms_per_hour", self.false_alarms_per_hour, POSITIVE),
            figure("cylinder_threshold", self.cylinder_threshold, POSITIVE),
        ];
        let of_forces = self.forces.iter().flat_map(|force| {
            let ForceRange { least_n, largest_n, .. } = *force;
            let is_range = least_n <= largest_n || least_n.is_nan() || largest_n.is_nan();
            let order =
                format!("`least_n` is {least_n}; use a number up to `largest_n`, {largest_n}");
            [
                figure("least_n", least_n, FINITE),
                figure("largest_n", largest_n, FINITE),
                (!is_range).then_some(order),
            ]
        });
        let count = (self.cylinders.len() != cylinders)
            .then(|| format!("`cylinders` are {}; use {cylinders}", self.cylinders.len()));
        let of_gages = (self.reconstructions.len() != gages)
            .then(|| format!("`reconstructions` are {}; use {gages}", self.reconstructions.len()));
        let of_reconstructions = self.reconstructions.iter().flat_map(|error| {
            [
                figure("alone_m", error.alone_m, POSITIVE),
                figure("alone_held_m", error.alone_held_m, POSITIVE),
                figure("with_peers_m", error.with_peers_m, POSITIVE),
                figure("with_peers_held_m", error.with_peers_held_m, POSITIVE),
            ]
        });
        let of_cylinders =
            self.cylinders.iter().filter_map(|cylinder| cylinder.problem("cylinders", 4));
        let values = self.gages.len() + self.forces.len();
        let of_means =
            [("short", &self.short), ("long", &self.long)].into_iter().flat_map(|(name, means)| {
                let problems = means.problems(gages, values).into_iter();
                problems.map(move |problem| format!("{name}: {problem}"))
            });
        let of_moving = self.moving.problem("moving", values);
        let all = figures
            .into_iter()
            .chain(of_forces)
            .chain(of_reconstructions)
            .chain([count, of_gages])
            .flatten();
        all.chain(of_cylinders)
            .chain(of_means)
            .chain(of_moving)
            .map(ReferenceProblem::Figures)
            .collect()
    }

    /// The peers that it knows, in the order of its values.
    pub fn peers(&self) -> impl Iterator<Item = &ModuleName> {
        let mut peers: Vec<&ModuleName> = Vec::new();
        for path in self.gages.iter().chain(self.forces.iter().map(|force| &force.actuator)) {
            if path.module != self.module && !peers.contains(&&path.module) {
                peers.push(&path.module);
            }
        }
        peers.into_iter()
    }

    /// The smallest bias of each of its own gages that is found \[m\], on average: without any peer, and with all.
    #[must_use]
    pub fn smallest_biases_m(&self) -> [Vec<f64>; 2] {
        let own_gages = self.long.own_gages.len();
        let forces = self.gages.len();
        let alone: Vec<usize> =
            (0..own_gages).chain(forces..forces + self.cylinders.len()).collect();
        let together: Vec<usize> = (0..forces + self.forces.len()).collect();
        let MeansReference { means, gage_threshold, gage_threshold_alone, .. } = &self.long;
        [(alone, gage_threshold_alone), (together, gage_threshold)].map(|(places, threshold)| {
            let mut all = means.smallest_displacements(&places, *threshold);
            all.truncate(own_gages);
            all
        })
    }

    /// Where the module's own gages and forces stand among the values of `means`.
    pub(crate) fn own_places(&self) -> Vec<usize> {
        let forces = self.gages.len();
        (0..self.long.own_gages.len()).chain(forces..forces + self.cylinders.len()).collect()
    }

    /// Gages and forces over windows of this length.
    pub(crate) fn over(&self, length: WindowLength) -> &MeansReference {
        match length {
            WindowLength::Short => &self.short,
            WindowLength::Long => &self.long,
        }
    }

    /// The gages of one module.
    pub(crate) fn gages_of<'a>(
        &'a self,
        module: &'a ModuleName,
    ) -> impl Iterator<Item = &'a ComponentPath> {
        self.gages.iter().filter(move |path| path.module == *module)
    }

    /// The forces of one module.
    pub(crate) fn forces_of<'a>(
        &'a self,
        module: &'a ModuleName,
    ) -> impl Iterator<Item = &'a ForceRange> {
        self.forces.iter().filter(move |force| force.actuator.module == *module)
    }
}
