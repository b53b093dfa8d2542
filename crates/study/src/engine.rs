//! Runs the cases of any campaign in parallel, skipping those that are done, until stopped.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::campaign::Campaign;
use crate::case::{CampaignCase, CaseRun, Watch};
use crate::error::StudyError;
use crate::journal::{CampaignJournal, Done};
use crate::parallel;
use crate::rig::Rig;
use crate::system::CommissionedPlant;

/// A lengthy piece of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineWork {
    /// Commissioning of plants, in snippets.
    Commissioning,
    /// Cases.
    Cases,
}

/// Starts a progress report on this much work; the returned function is called after every piece.
pub type Begin<'a> = &'a dyn Fn(EngineWork, u64) -> Box<dyn Fn() + Sync>;

/// How cases are run, which does not affect the results.
#[derive(Clone, Copy)]
pub struct Engine<'a> {
    /// The number of parallel cases.
    pub jobs: usize,
    /// Stops the engine: no new work is started once it is set.
    pub stop: &'a AtomicBool,
    /// Reports progress.
    pub begin: Begin<'a>,
}

/// Commissioned plants, by system and number.
pub(crate) type Plants = BTreeMap<(usize, u64), CommissionedPlant>;

impl Engine<'_> {
    /// Runs the cases that are not done yet, and adds them to the results and to the journal.
    ///
    /// # Errors
    /// A plant or diagnosers cannot be created, or the journal cannot be written.
    pub fn run<C: Campaign>(
        &self,
        campaign: &C,
        cases: Range<u64>,
        done: &mut Done<C::Row>,
        mut journal: Option<&mut CampaignJournal>,
    ) -> Result<(), StudyError> {
        let missing: Vec<u64> = cases.filter(|case| !done.rows.contains_key(case)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let plants = self.commission(campaign, &missing)?;
        for (id, plant) in &plants {
            let row = plant.row(&campaign.systems()[id.0]);
            if done.plants.insert(*id, row.clone()).is_none() {
                journal.as_mut().map_or(Ok(()), |journal| journal.plant(*id, &row))?;
            }
        }
        let advance = (self.begin)(EngineWork::Cases, missing.len() as u64);
        let keep = |case: &u64, row: C::Row| {
            journal.as_mut().map_or(Ok(()), |journal| journal.case(*case, &row))?;
            done.rows.insert(*case, row);
            advance();
            Ok(())
        };
        let work = |case: &u64| run_case(campaign, *case, &plants, &mut |_, _| Ok(()));
        parallel::for_each(&missing, self.jobs, self.stop, work, keep)
    }

    /// Runs one case and calls `watch` after every step.
    ///
    /// # Errors
    /// A plant or diagnosers cannot be created, or `watch` failed.
    pub fn watch<C: Campaign>(
        &self,
        campaign: &C,
        case: u64,
        watch: Watch,
    ) -> Result<C::Row, StudyError> {
        let plants = self.commission(campaign, &[case])?;
        run_case(campaign, case, &plants, watch)
    }

    /// Commissions the plants of these cases one by one, until stopped.
    pub(crate) fn commission(
        &self,
        campaign: &impl Campaign,
        cases: &[u64],
    ) -> Result<Plants, StudyError> {
        let ids = cases.iter().map(|case| campaign.plant_of(*case));
        let ids: BTreeSet<(usize, u64)> =
            ids.filter_map(|(system, plant)| Some((system, plant?))).collect();
        let mut plants = Plants::new();
        if ids.is_empty() {
            return Ok(plants);
        }
        let snippets = ids.iter().map(|id| campaign.systems()[id.0].snippets_per_plant()).sum();
        let advance = (self.begin)(EngineWork::Commissioning, snippets);
        for id in ids {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            let mut plant = campaign.systems()[id.0].commission(id.1, self.jobs, &*advance)?;
            campaign.alter(&mut plant);
            plants.insert(id, plant);
        }
        Ok(plants)
    }
}

fn run_case<C: Campaign>(
    campaign: &C,
    number: u64,
    plants: &Plants,
    watch: Watch,
) -> Result<C::Row, StudyError> {
    let (case, rig) = prepare(campaign, number, plants)?;
    campaign.judge(&case, &mut CaseRun::new(&case, rig, watch))
}

/// Draws a case and its rig.
pub(crate) fn prepare<C: Campaign>(
    campaign: &C,
    number: u64,
    plants: &Plants,
) -> Result<(CampaignCase<C::Kind>, Rig), StudyError> {
    let (system, plant) = campaign.plant_of(number);
    let plant = plant.map(|plant| plants.get(&(system, plant)).ok_or(StudyError::Interrupted));
    let plant = plant.transpose()?;
    let case = campaign.draw(number, plant)?;
    let rig = match plant {
        Some(plant) => plant.rig(case.seed, case.faults.clone()),
        None => campaign.systems()[system].rig(case.seed, case.faults.clone()),
    };
    Ok((case, rig?))
}

/// A part of a campaign that runs separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Its number, from 0.
    pub number: u64,
    /// The number of parts.
    pub of: u64,
}

impl Shard {
    /// Its share of so many cases.
    #[must_use]
    pub fn cases(self, all: u64) -> Range<u64> {
        let end = |number: u64| (u128::from(all) * u128::from(number) / u128::from(self.of)) as u64;
        end(self.number)..end(self.number + 1)
    }
}

/// `2/8`
impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once('/').and_then(|(number, of)| {
            Some(Self { number: number.parse().ok()?, of: of.parse().ok()? })
        });
        parts
            .filter(|shard| shard.number < shard.of)
            .ok_or_else(|| "use K/N with K from 0 to N-1, e.g. 0/8".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_all_cases_among_themselves() {
        for all in [0, 1, 7, 100] {
            for of in [1, 3, 8] {
                let shards = (0..of).map(|number| Shard { number, of });
                let cases: Vec<u64> = shards.flat_map(|shard| shard.cases(all)).collect();
                assert_eq!(cases, (0..all).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn shards_are_read_as_they_are_written() {
        assert_eq!("2/8".parse::<Shard>().unwrap().to_string(), "2/8");
        for wrong in ["8/8", "-1/8", "2", "2/", "a/b", "0/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
