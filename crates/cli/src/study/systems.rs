//! The systems and campaigns that requests ask for: the shipped diagnosers, the paper's, or the user's own, on a plant.

use std::path::{Path, PathBuf};

use daemon::config::{PlantConfig, PlantFlags, load_diagnoser, load_plant};
use diagnosis::ModuleSetup;
use settings::ConfigErrors;
use study::System;
use study::conditions::{ConditionCampaign, HiddenFaults, Situation};
use study::identification::{IdentificationCampaign, IdentificationCases};
use study::limits::LimitCampaign;
use study::rivals::RivalCampaign;
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use study::tolerance::{Impediments, ToleranceCampaign};
use vocabulary::{ComponentKind, fault::FaultKind};

use super::arguments::{
    CampaignRequest, ConditionArguments, HIDDEN, HISTORIES, IdentifyArguments, LimitArguments,
    PresetName, RivalArguments, ScenarioArguments, SystemArguments, ToleranceArguments, Weather,
};
use crate::failure::Failure;
use crate::shipped::{
    MODULES, OTHERS, PAPER_MODULES, PLANT, Shipped, WEATHER_ALIKE, WEATHER_UNEVEN,
    temporary_directory,
};

const COMMISSIONED_MISMATCH: f64 = 0.1;

impl Weather {
    const ALL: [Self; 3] = [Self::None, Self::Alike, Self::Uneven];

    fn plant(self) -> Shipped {
        match self {
            Self::None => PLANT,
            Self::Alike => WEATHER_ALIKE,
            Self::Uneven => WEATHER_UNEVEN,
        }
    }

    fn as_str(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Alike => "alike",
            Self::Uneven => "uneven",
        }
    }
}

impl CampaignRequest {
    /// The same with every default written out.
    pub(super) fn resolved(mut self) -> Self {
        let (system, mismatch, weather) = match &mut self {
            Self::Run(of) => (&mut of.of.system, 0.0, &[Weather::None][..]),
            Self::Conditions(of) if of.has_histories() => {
                (&mut of.system, 0.0, &[Weather::None][..])
            }
            Self::Rivals(of) => (&mut of.system, COMMISSIONED_MISMATCH, &[Weather::None][..]),
            Self::Limits(of) if of.isolation => (&mut of.system, 0.0, &[Weather::None][..]),
            Self::Limits(of) => (&mut of.system, COMMISSIONED_MISMATCH, &Weather::ALL[..]),
            Self::Conditions(ConditionArguments { system, .. })
            | Self::Identify(IdentifyArguments { system, .. })
            | Self::Tolerance(ToleranceArguments { system, .. }) => {
                (system, COMMISSIONED_MISMATCH, &[Weather::Alike][..])
            }
        };
        system.mismatch.get_or_insert(mismatch);
        if system.plant.is_none() && system.weather.is_empty() {
            system.weather.extend(weather);
        }
        self
    }
}

impl SystemArguments {
    /// One system for each weather.
    pub(super) fn systems(&self) -> Result<Vec<System>, Failure> {
        let shipped = match self.preset {
            PresetName::Paper => PAPER_MODULES,
            PresetName::Default => MODULES,
        };
        let system = |name: &str, (plant, setups): (PlantConfig, Vec<ModuleSetup>)| System {
            name: name.to_owned(),
            structure: plant.structure,
            parameters: plant.parameters,
            setups,
            mismatch: self.mismatch.unwrap_or_default(),
            controllers: self.controllers.clone(),
            seed: self.seed,
        };
        match (&self.plant, &self.modules[..]) {
            (Some(plant), []) => {
                let own = |_: &Path, modules: &[PathBuf]| read(plant, modules);
                Ok(vec![system("own", with_shipped(PLANT, shipped, own)?)])
            }
            (Some(plant), modules) => Ok(vec![system("own", read(plant, modules)?)]),
            (None, _) if self.weather.is_empty() => {
                Ok(vec![system("none", with_shipped(PLANT, shipped, read)?)])
            }
            (None, _) => Weather::ALL
                .into_iter()
                .filter(|weather| self.weather.contains(weather))
                .map(|of| Ok(system(of.as_str(), with_shipped(of.plant(), shipped, read)?)))
                .collect(),
        }
    }

    fn only_system(&self) -> Result<System, Failure> {
        let mut systems = self.systems()?;
        match (systems.pop(), systems.is_empty()) {
            (Some(only), true) => Ok(only),
            _ => Err(Failure::usage("`--weather` names several; only `study limits` takes them")),
        }
    }
}

impl ScenarioArguments {
    pub(super) fn campaign(&self) -> Result<ScenarioCampaign, Failure> {
        let system = self.system.only_system()?;
        let ranges = ScenarioRanges { nominal_s: self.nominal_seconds, ..Default::default() };
        Ok(ScenarioCampaign {
            ranges: ranges.watched(&system),
            system,
            scenarios: self.scenarios,
            nominal: self.nominal,
        })
    }
}

impl ConditionArguments {
    fn situations(&self) -> Vec<Situation> {
        match self.situations.as_str() {
            HIDDEN => Situation::HIDDEN.to_vec(),
            HISTORIES => Situation::HISTORIES.to_vec(),
            name => {
                let all = Situation::HIDDEN.into_iter().chain(Situation::HISTORIES);
                all.filter(|situation| situation.as_str() == name).collect()
            }
        }
    }

    fn has_histories(&self) -> bool {
        self.situations().iter().any(|situation| situation.is_history())
    }

    pub(super) fn campaign(&self) -> Result<ConditionCampaign, Failure> {
        let mut system = self.system.only_system()?;
        if self.alone {
            system.setups.iter_mut().for_each(|setup| setup.peers.clear());
        }
        let hidden = HiddenFaults {
            bias_strain: self.bias_microstrain.map(|size| size * 1e-6),
            leak_m2: self.leak_area_m2,
            healthy_s: self.healthy_seconds,
        };
        let (situations, plants, cases) = (self.situations(), self.plants.get(), self.cases.get());
        Ok(ConditionCampaign { system, situations, hidden, plants, cases, alone: self.alone })
    }
}

impl LimitArguments {
    pub(super) fn campaign(&self) -> Result<LimitCampaign, Failure> {
        let (plants, runs) = (self.plants.get(), self.runs.get());
        Ok(LimitCampaign::new(self.system.systems()?, plants, runs, self.isolation))
    }
}

impl IdentifyArguments {
    pub(super) fn campaign(&self) -> Result<IdentificationCampaign, Failure> {
        let Self { kind, without, situation, in_limits, .. } = *self;
        Ok(IdentificationCampaign {
            system: self.system.only_system()?,
            of: IdentificationCases { kind, situation, in_limits },
            without,
            plants: self.plants.get(),
            cases: self.cases.get(),
        })
    }
}

impl ToleranceArguments {
    pub(super) fn campaign(&self) -> Result<ToleranceCampaign, Failure> {
        let (plants, cases) = (self.plants.get(), self.cases.get());
        let components =
            if self.cylinders { ComponentKind::Actuator } else { ComponentKind::Sensor };
        let all = ToleranceCampaign::kinds_of(components);
        // Kinds that have a size, which is negligible.
        let kind = self.kind.or(self.wrong.then_some(match components {
            ComponentKind::Actuator => FaultKind::InternalLeakage,
            ComponentKind::Sensor => FaultKind::Bias,
        }));
        let kinds = kind.map_or(all, |kind| vec![kind]);
        let situation = self.situation.or(self.wrong.then_some(Situation::Alone));
        let Self { late_s, wrong, silent_peers, lost, softened, counted_s, .. } = *self;
        let impediments = Impediments { late_s, wrong, silent_peers, lost, softened };
        let system = self.system.only_system()?;
        Ok(ToleranceCampaign { system, plants, cases, kinds, situation, counted_s, impediments })
    }
}

impl RivalArguments {
    pub(super) fn campaign(&self) -> Result<RivalCampaign, Failure> {
        let most = 3600.0 / self.nominal_seconds;
        if self.per_hour > most {
            return Err(Failure::usage(format!(
                "`--per-hour` is {}, but a run without a fault counts one alarm at most: with `--nominal-seconds {}` at \
                 most {most:.0}",
                self.per_hour, self.nominal_seconds
            )));
        }
        let system = self.system.only_system()?;
        let paper = SystemArguments {
            preset: PresetName::Paper,
            modules: Vec::new(),
            ..self.system.clone()
        };
        let paper = paper.only_system()?;
        let ranges = ScenarioRanges { nominal_s: self.nominal_seconds, ..Default::default() };
        let ranges = ranges.across_the_limit().watched(&system).watched(&paper);
        let (scenarios, nominal) = (self.scenarios, self.nominal);
        let of = ScenarioCampaign { system, ranges, scenarios, nominal };
        Ok(RivalCampaign::new(of, paper, self.per_hour))
    }
}

/// Lays out shipped files in a directory of their own for as long as `take` needs.
fn with_shipped<T>(
    plant: Shipped,
    modules: [Shipped; 2],
    take: impl FnOnce(&Path, &[PathBuf]) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let directory = temporary_directory("trusswatch-study-")?;
    for file in OTHERS {
        file.write(directory.path())?;
    }
    let modules: Vec<PathBuf> =
        modules.iter().map(|file| file.write(directory.path())).collect::<Result<_, _>>()?;
    take(&plant.write(directory.path())?, &modules)
}

/// Reads a plant and its diagnosers.
fn read(plant: &Path, modules: &[PathBuf]) -> Result<(PlantConfig, Vec<ModuleSetup>), Failure> {
    let plant = load_plant(plant, &PlantFlags::default()).map_err(|errors| unusable(&errors))?;
    let mut setups = Vec::new();
    for module in modules {
        let config = load_diagnoser(module).map_err(|errors| unusable(&errors))?;
        // Each run draws a plant of its own, of which no reference is known.
        setups.push(ModuleSetup { reference: None, ..config.module_setup() });
    }
    Ok((plant, setups))
}

fn unusable(errors: &ConfigErrors) -> Failure {
    Failure::inputs(errors.0.iter().map(ToString::to_string).collect())
}
