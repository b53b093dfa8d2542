//! What the controller does about faults that diagnosers name: it uses corrected readings of faulty gages, lets the other
//! cylinders make up for one that is hard over or shut off, and shuts one off whose module says so.
//!
//! A module that falls silent leaves its gages to themselves: the controller uses their own readings again. The limit on
//! innovations needs no diagnoser. What is known of a cylinder stays, because silence repairs none.

use std::collections::BTreeSet;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use vocabulary::{
    Ability, Capability, Component, ComponentPath, Corrected, CorrectedReadings,
    CylinderCapability, ModuleName, Occurrences, ReadingSource, RunId, Step,
};

use crate::plant::Plant;

/// The table `[tolerance]`: what the controller does about faults that diagnosers name. Each measure is off unless it is
/// switched on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ToleranceSettings {
    /// It uses corrected readings in place of those of faulty gages.
    pub corrected_readings: bool,
    /// It limits what a reading may differ from what it expects to this strain.
    pub largest_innovation: Option<f64>,
    /// The other cylinders make up for one that is hard over or shut off.
    pub reallocation: bool,
    /// So many cylinders are shut off at a time when their modules say so: 0.
    pub most_shut_off: u64,
    /// A corrected reading is used for so long; then the gage's own is used again \[ms\]: 250.
    pub stale_after_ms: u64,
}

impl Default for ToleranceSettings {
    fn default() -> Self {
        Self {
            corrected_readings: false,
            largest_innovation: None,
            reallocation: false,
            most_shut_off: 0,
            stale_after_ms: 250,
        }
    }
}

/// What a module says of its components.
#[derive(Debug)]
pub enum ModuleMessage {
    /// Of its gages.
    Readings(Corrected),
    /// Of its cylinders.
    Cylinders(Capability),
}

/// What the controller is told, and what it makes of it.
#[derive(Debug)]
pub struct Tolerance {
    run: RunId,
    reallocates: bool,
    most_shut_off: usize,
    shut_off: BTreeSet<ComponentPath>,
    /// A reading is used for so many steps.
    fresh_steps: u64,
    modules: Vec<KnownModule>,
    done_without: BTreeSet<ComponentPath>,
    refused: u64,
    refusals: Occurrences,
}

#[derive(Debug)]
struct KnownModule {
    module: ModuleName,
    /// In the order of its samples.
    gages: Vec<ComponentPath>,
    cylinders: Vec<ComponentPath>,
    /// What its gages should read, as of when.
    readings: Option<(Step, CorrectedReadings)>,
}

impl Tolerance {
    /// For a plant, whose innovations are limited from now on if that is wanted.
    #[must_use]
    pub fn new(settings: &ToleranceSettings, step_s: f64, run: RunId, plant: &mut Plant) -> Self {
        plant.limit_innovations(settings.largest_innovation);
        let components = |module: &ModuleName, is_gage: bool| {
            let own = plant.components().filter(|path| path.module == *module);
            let alike =
                own.filter(|path| matches!(path.component, Component::Sensor(_)) == is_gage);
            alike.cloned().collect()
        };
        let known = |module: &ModuleName| KnownModule {
            module: module.clone(),
            gages: components(module, true),
            cylinders: components(module, false),
            readings: None,
        };
        Self {
            run,
            reallocates: settings.reallocation,
            most_shut_off: usize::try_from(settings.most_shut_off).unwrap_or(usize::MAX),
            shut_off: BTreeSet::new(),
            fresh_steps: (settings.stale_after_ms as f64 * 1e-3 / step_s).round() as u64,
            modules: plant.modules().map(known).collect(),
            done_without: BTreeSet::new(),
            refused: 0,
            refusals: Occurrences::default(),
        }
    }

    /// Takes what has come, or why it cannot be read, and lets the controller act on it from the next step on. Has anything
    /// changed but values?
    pub fn follow(
        &mut self,
        news: impl IntoIterator<Item = Result<ModuleMessage, String>>,
        plant: &mut Plant,
        now: Instant,
    ) -> bool {
        let (known, refused) = (self.done_without.clone(), self.refused);
        for news in news {
            if let Err(why) = news.and_then(|news| self.take(news, plant)) {
                self.refused += 1;
                if let Some(times) = self.refusals.note(now) {
                    tracing::warn!(times, "the controller ignores a message: {why}");
                }
            }
        }
        self.replace(plant);
        known != self.done_without || refused != self.refused
    }

    /// The cylinders that are shut off.
    pub fn shut_off_cylinders(&self) -> impl Iterator<Item = &ComponentPath> {
        self.shut_off.iter()
    }

    /// The components that the controller does without.
    pub fn done_without(&self) -> impl Iterator<Item = &ComponentPath> {
        self.done_without.iter()
    }

    /// Messages that could not be used.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    fn take(&mut self, news: ModuleMessage, plant: &mut Plant) -> Result<(), String> {
        let module = match &news {
            ModuleMessage::Readings(message) if message.run != self.run => return Ok(()),
            ModuleMessage::Readings(message) => &message.module,
            ModuleMessage::Cylinders(message) => &message.module,
        };
        let known = self.modules.iter_mut().find(|known| known.module == *module);
        let known = known.ok_or_else(|| format!("`{module}` has nothing that it controls"))?;
        match news {
            ModuleMessage::Readings(message) => known.take_readings(message, plant.next_step()),
            ModuleMessage::Cylinders(message) => {
                known.check_cylinders(&message)?;
                let cylinders = known.cylinders.clone().into_iter().zip(&message.cylinders);
                for (cylinder, said) in cylinders {
                    self.shut_off(&cylinder, said.ability == Ability::ShutOff, plant)?;
                    self.reallocate(cylinder, said, plant)?;
                }
                Ok(())
            }
        }
    }

    /// Shuts a cylinder off, or puts it back.
    fn shut_off(
        &mut self,
        cylinder: &ComponentPath,
        is_wanted: bool,
        plant: &mut Plant,
    ) -> Result<(), String> {
        if is_wanted == self.shut_off.contains(cylinder) || self.most_shut_off == 0 {
            return Ok(());
        }
        if is_wanted && self.shut_off.len() >= self.most_shut_off {
            let most = self.most_shut_off;
            return Err(format!(
                "{most} cylinders are shut off, and `{cylinder}` would be another"
            ));
        }
        plant.shut_off(cylinder, is_wanted).map_err(|error| error.to_string())?;
        let done = if is_wanted { "shut off" } else { "put back" };
        tracing::info!(%cylinder, step = %plant.next_step(), "{done}");
        if is_wanted {
            self.shut_off.insert(cylinder.clone());
        } else {
            self.shut_off.remove(cylinder);
        }
        // Otherwise the others make up for it, which is noted there.
        if !self.reallocates {
            self.note(cylinder.clone(), is_wanted, plant.next_step());
        }
        Ok(())
    }

    /// Lets the others make up for a cylinder that is of no use, or counts on it again.
    fn reallocate(
        &mut self,
        cylinder: ComponentPath,
        said: &CylinderCapability,
        plant: &mut Plant,
    ) -> Result<(), String> {
        let is_lost = said.decided && matches!(said.ability, Ability::HardOver | Ability::ShutOff);
        if !self.reallocates || is_lost == self.done_without.contains(&cylinder) {
            return Ok(());
        }
        plant.reallocate(&cylinder, is_lost).map_err(|error| error.to_string())?;
        self.note(cylinder, is_lost, plant.next_step());
        Ok(())
    }

    /// Gives the controller what gages should read, as far as that is known.
    fn replace(&mut self, plant: &mut Plant) {
        let next_step = plant.next_step();
        let mut changed = Vec::new();
        for known in &self.modules {
            let readings = known.readings.as_ref();
            let fresh = readings.filter(|(step, _)| next_step.since(*step) <= self.fresh_steps);
            for (place, gage) in known.gages.iter().enumerate() {
                let replaced_m = fresh.and_then(|(_, readings)| {
                    readings.elongations_m[place]
                        .filter(|_| readings.source[place] == ReadingSource::Replaced)
                });
                let was_replaced = self.done_without.contains(gage);
                if replaced_m.is_none() && !was_replaced {
                    continue;
                }
                if let Err(error) = plant.replace_reading(gage, replaced_m) {
                    tracing::error!("{error}");
                }
                if was_replaced != replaced_m.is_some() {
                    changed.push((gage.clone(), replaced_m.is_some()));
                }
            }
        }
        for (gage, is_lost) in changed {
            self.note(gage, is_lost, next_step);
        }
    }

    fn note(&mut self, component: ComponentPath, is_lost: bool, step: Step) {
        let does = if is_lost { "does without it" } else { "uses it again" };
        tracing::info!(%component, %step, "the controller {does}");
        if is_lost {
            self.done_without.insert(component);
        } else {
            self.done_without.remove(&component);
        }
    }
}

impl KnownModule {
    /// Takes readings that may be true: for every gage, as of a step that was measured, within their intervals.
    fn take_readings(&mut self, message: Corrected, next_step: Step) -> Result<(), String> {
        let Corrected { step, readings, .. } = message;
        let (module, gages) = (&self.module, self.gages.len());
        let CorrectedReadings { elongations_m, low_m, high_m, source } = &readings;
        let counts = [elongations_m.len(), low_m.len(), high_m.len(), source.len()];
        if counts != [gages; 4] {
            return Err(format!("readings of `{module}` have {counts:?} entries, not {gages}"));
        }
        if step >= next_step {
            return Err(format!("readings of `{module}` are of step {step}, which is to come"));
        }
        let within = elongations_m.iter().zip(low_m.iter().zip(high_m));
        let is_within = |(value, (low, high)): (&Option<f64>, (&Option<f64>, &Option<f64>))| {
            value.is_none_or(|value| *low <= Some(value) && Some(value) <= *high)
        };
        if !within.clone().all(is_within) {
            return Err(format!("readings of `{module}` are not within their intervals"));
        }
        if self.readings.as_ref().is_none_or(|(latest, _)| *latest < step) {
            self.readings = Some((step, readings));
        }
        Ok(())
    }

    /// Does it speak of its own cylinders?
    fn check_cylinders(&self, message: &Capability) -> Result<(), String> {
        let said = message.cylinders.iter().map(|said| Component::Actuator(said.name.clone()));
        let is_its = said.eq(self.cylinders.iter().map(|path| path.component.clone()));
        is_its.then_some(()).ok_or_else(|| format!("`{}` has other cylinders", self.module))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlantParameters;
    use std::cell::RefCell;
    use truss::Structure;

    const GAGE: &str = "module1/sensor/g2";

    /// What reaches the controller with the next step.
    #[derive(Default)]
    struct NextNews(RefCell<Vec<Result<ModuleMessage, String>>>);

    impl NextNews {
        fn send(&self, news: Result<ModuleMessage, String>) {
            self.0.borrow_mut().push(news);
        }
    }

    fn follow(tolerance: &mut Tolerance, news: &NextNews, plant: &mut Plant) -> bool {
        tolerance.follow(news.0.take(), plant, Instant::now())
    }

    /// The shipped tower, and what reaches its controller.
    fn rig() -> (Plant, Tolerance, NextNews) {
        let tower = Structure::from_toml(include_str!("../../../configs/tower.toml")).unwrap();
        let mut plant = Plant::new(&tower, &PlantParameters::default(), 1).unwrap();
        let settings = ToleranceSettings {
            stale_after_ms: 10,
            reallocation: true,
            most_shut_off: 1,
            ..ToleranceSettings::default()
        };
        let tolerance = Tolerance::new(&settings, 1e-3, RunId(1), &mut plant);
        (plant, tolerance, NextNews::default())
    }

    fn readings(step: u64, source: ReadingSource) -> Corrected {
        let mut readings = CorrectedReadings::default();
        (0..8).for_each(|gage| {
            readings.push(1e-5, 1e-6, if gage == 1 { source } else { ReadingSource::Own });
        });
        Corrected {
            structure: "tower".parse().unwrap(),
            module: "module1".parse().unwrap(),
            run: RunId(1),
            step: Step(step),
            time_unix_ns: 0,
            readings,
            forces_n: vec![Some(0.0); 4],
        }
    }

    /// All is well with the cylinders of module 1; what can be said of this one is told.
    fn said(name: &str) -> Capability {
        let cylinder = |other: &str| CylinderCapability {
            name: other.parse().unwrap(),
            ability: Ability::Full,
            decided: true,
            ends_in_s: None,
        };
        assert!(["a1", "a2", "a3", "a4"].contains(&name));
        Capability {
            structure: "tower".parse().unwrap(),
            module: "module1".parse().unwrap(),
            cylinders: ["a1", "a2", "a3", "a4"].map(cylinder).into(),
            time_unix_ns: 0,
        }
    }

    fn capability(name: &str, ability: Ability, decided: bool) -> ModuleMessage {
        let mut said = said(name);
        let cylinder = said.cylinders.iter_mut().find(|cylinder| cylinder.name.as_str() == name);
        let cylinder = cylinder.unwrap();
        (cylinder.ability, cylinder.decided) = (ability, decided);
        ModuleMessage::Cylinders(said)
    }

    fn without(tolerance: &Tolerance) -> Vec<String> {
        tolerance.done_without().map(ToString::to_string).collect()
    }

    #[test]
    fn a_corrected_reading_is_used_while_it_comes() {
        let (mut plant, mut tolerance, news) = rig();
        let mut step = |plant: &mut Plant, said: Option<Corrected>| {
            plant.advance();
            said.into_iter().for_each(|said| news.send(Ok(ModuleMessage::Readings(said))));
            let changed = follow(&mut tolerance, &news, plant);
            (changed, without(&tolerance))
        };
        let replaced = |step| Some(readings(step, ReadingSource::Replaced));
        assert_eq!(step(&mut plant, replaced(0)), (true, vec![GAGE.to_owned()]));
        for _ in 1..10 {
            assert_eq!(step(&mut plant, None), (false, vec![GAGE.to_owned()]));
        }
        assert_eq!(step(&mut plant, None), (true, vec![]), "what it should read is too old");
        assert_eq!(step(&mut plant, replaced(11)), (true, vec![GAGE.to_owned()]));
        let own = Some(readings(12, ReadingSource::Own));
        assert_eq!(step(&mut plant, own), (true, vec![]));
        // An earlier message that comes late changes nothing, and neither does one of another run.
        assert_eq!(step(&mut plant, replaced(11)), (false, vec![]));
        let other = replaced(13).map(|said| Corrected { run: RunId(2), ..said });
        assert_eq!(step(&mut plant, other), (false, vec![]));
        assert_eq!(tolerance.refused(), 0);
    }

    #[test]
    fn readings_that_cannot_be_true_are_refused_and_counted() {
        let (mut plant, mut tolerance, news) = rig();
        plant.advance();
        let replaced = |step| readings(step, ReadingSource::Replaced);
        let (mut short, mut outside) = (replaced(0), replaced(0));
        short.readings.source.pop();
        outside.readings.high_m[1] = Some(0.0);
        let unknown = Corrected { module: "module9".parse().unwrap(), ..replaced(0) };
        for said in [short, outside, unknown, replaced(1)] {
            news.send(Ok(ModuleMessage::Readings(said)));
        }
        news.send(Err("no JSON".into()));
        assert!(follow(&mut tolerance, &news, &mut plant));
        assert_eq!((tolerance.refused(), without(&tolerance)), (5, vec![]));
    }

    #[test]
    fn others_make_up_for_a_cylinder_that_is_known_to_be_hard_over_or_is_shut_off() {
        let (mut plant, mut tolerance, news) = rig();
        for (said, expected) in [
            (capability("a1", Ability::HardOver, false), &[][..]),
            (capability("a1", Ability::HardOver, true), &["module1/actuator/a1"]),
            (capability("a1", Ability::Leaking, true), &[]),
            (capability("a1", Ability::ShutOff, true), &["module1/actuator/a1"]),
        ] {
            news.send(Ok(said));
            follow(&mut tolerance, &news, &mut plant);
            assert_eq!(without(&tolerance), expected);
        }
        assert_eq!((tolerance.refused(), tolerance.shut_off.len()), (0, 1));
    }

    #[test]
    fn no_more_cylinders_are_shut_off_than_may_be_and_what_is_put_back_pushes_again() {
        let (mut plant, mut tolerance, news) = rig();
        tolerance.reallocates = false;
        // None of the tower's cylinders is without force under wind.
        let force_n = |plant: &mut Plant, tolerance: &mut Tolerance| {
            follow(tolerance, &news, plant);
            for _ in 0..300 {
                plant.advance();
            }
            let pressures_pa = plant.signals().modules[0].pressures_pa[1];
            pressures_pa.map(|pa| (pa / 1e5).round())
        };
        news.send(Ok(capability("a2", Ability::ShutOff, true)));
        assert_eq!(force_n(&mut plant, &mut tolerance), [1.0; 2], "bar: both chambers are empty");
        assert_eq!(without(&tolerance), ["module1/actuator/a2"]);
        let mut of_other = Capability { module: "module2".parse().unwrap(), ..said("a1") };
        of_other.cylinders[0].ability = Ability::ShutOff;
        news.send(Ok(ModuleMessage::Cylinders(of_other)));
        follow(&mut tolerance, &news, &mut plant);
        assert_eq!((tolerance.refused(), tolerance.shut_off.len()), (1, 1));
        news.send(Ok(capability("a2", Ability::Full, true)));
        let [bar_a, bar_b] = force_n(&mut plant, &mut tolerance);
        assert!(bar_a > 10.0 && bar_b > 10.0, "{bar_a} {bar_b}");
        assert_eq!((tolerance.shut_off.len(), without(&tolerance)), (0, vec![]));
    }
}
