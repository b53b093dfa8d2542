//! Whether a cylinder may be shut off, but for its verdict, which the diagnosis asks for: so many of the structure at a time.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::{Ability, CylinderCapability, ModuleName};

/// The limit, and what peers have shut off.
#[derive(Debug, Clone)]
pub struct ShutOffInterlock {
    /// Cylinders of the structure that may be shut off at a time.
    most: u64,
    /// What a peer says counts for so long.
    fresh: Duration,
    /// How many cylinders each has shut off, and when it said so.
    peers: BTreeMap<ModuleName, Option<(u64, Instant)>>,
}

impl ShutOffInterlock {
    /// With this limit; nothing is known of these peers.
    #[must_use]
    pub fn new(most: u64, fresh: Duration, peers: &[ModuleName]) -> Self {
        Self { most, fresh, peers: peers.iter().map(|peer| (peer.clone(), None)).collect() }
    }

    /// May any cylinder be shut off?
    #[must_use]
    pub fn permits_any(&self) -> bool {
        self.most > 0
    }

    /// A peer says what its cylinders can do.
    pub fn hear(&mut self, peer: &ModuleName, cylinders: &[CylinderCapability], now: Instant) {
        if let Some(known) = self.peers.get_mut(peer) {
            *known = Some((shut_off(cylinders), now));
        }
    }

    /// May another cylinder be shut off, beside what is shut off of the module's own?
    ///
    /// # Errors
    /// Why not.
    pub fn check(&self, own: &[CylinderCapability], now: Instant) -> Result<(), String> {
        if self.most == 0 {
            return Err("no cylinder may be shut off; `most_shut_off` in the table `[tolerance]` \
                        of the module's configuration permits it"
                .to_owned());
        }
        let mut count = shut_off(own);
        for (peer, known) in &self.peers {
            match known {
                Some((of_peer, at)) if now.saturating_duration_since(*at) <= self.fresh => {
                    count += of_peer;
                }
                _ => {
                    return Err(format!(
                        "how many cylinders of `{peer}` are shut off is not known; start its diagnoser, or wait for it"
                    ));
                }
            }
        }
        if count < self.most {
            return Ok(());
        }
        let most = self.most;
        Err(format!("{count} of at most {most} cylinders are shut off; put one back first"))
    }
}

fn shut_off(cylinders: &[CylinderCapability]) -> u64 {
    cylinders.iter().filter(|cylinder| cylinder.ability == Ability::ShutOff).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cylinders(abilities: &[Ability]) -> Vec<CylinderCapability> {
        let cylinder = |(number, ability): (usize, &Ability)| CylinderCapability {
            name: format!("a{number}").parse().unwrap(),
            ability: *ability,
            decided: true,
            ends_in_s: None,
        };
        abilities.iter().enumerate().map(cylinder).collect()
    }

    #[test]
    fn at_most_so_many_cylinders_of_the_structure_are_shut_off_as_far_as_is_known() {
        let (peer, start): (ModuleName, _) = ("m2".parse().unwrap(), Instant::now());
        let fresh = Duration::from_secs(3);
        let mut interlock = ShutOffInterlock::new(1, fresh, std::slice::from_ref(&peer));
        let own = cylinders(&[Ability::HardOver, Ability::Full]);
        let refusal = |interlock: &ShutOffInterlock, own: &[_], after_s| {
            interlock.check(own, start + Duration::from_secs(after_s)).err()
        };
        let unknown = "how many cylinders of `m2` are shut off is not known; start its diagnoser, or wait for it";
        assert_eq!(refusal(&interlock, &own, 0).as_deref(), Some(unknown));
        interlock.hear(&peer, &cylinders(&[Ability::Full]), start);
        interlock.hear(&"m3".parse().unwrap(), &cylinders(&[Ability::ShutOff]), start);
        assert_eq!(refusal(&interlock, &own, 3), None, "m3 is not a peer");
        assert_eq!(refusal(&interlock, &own, 4).as_deref(), Some(unknown), "m2 is silent");
        let full = "1 of at most 1 cylinders are shut off; put one back first";
        let own_off = cylinders(&[Ability::HardOver, Ability::ShutOff]);
        assert_eq!(refusal(&interlock, &own_off, 3).as_deref(), Some(full));
        interlock.hear(&peer, &cylinders(&[Ability::ShutOff]), start);
        assert_eq!(refusal(&interlock, &own, 3).as_deref(), Some(full));
    }

    #[test]
    fn none_is_shut_off_unless_that_is_permitted() {
        let interlock = ShutOffInterlock::new(0, Duration::ZERO, &[]);
        assert!(!interlock.permits_any());
        let refusal = interlock.check(&[], Instant::now()).unwrap_err();
        assert!(refusal.contains("`most_shut_off`"), "{refusal}");
    }
}
