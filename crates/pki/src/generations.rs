//! The generation of each holder's present certificate.

use std::collections::BTreeMap;

use crate::generation::Generation;
use crate::holder::{Holder, Issued};

/// By holder; one of whom nothing is known has the first, or would get it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Generations(BTreeMap<Holder, Generation>);

impl Generations {
    /// After those that are revoked, and not before those that are present.
    pub(crate) fn of_all(revoked: Vec<Issued>, present: Vec<Issued>) -> Self {
        let after = |revoked: Issued| Issued { generation: revoked.generation.next(), ..revoked };
        let mut latest = BTreeMap::new();
        for Issued { holder, generation } in revoked.into_iter().map(after).chain(present) {
            let known = latest.entry(holder).or_insert(generation);
            *known = generation.max(*known);
        }
        Self(latest)
    }

    /// A holder by the present certificate, or by the one that would be issued.
    #[must_use]
    pub fn of(&self, holder: Holder) -> Issued {
        let generation = self.0.get(&holder).copied().unwrap_or(Generation::FIRST);
        Issued { holder, generation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_present_one_comes_after_every_revoked_one() {
        let all = |texts: &[&str]| texts.iter().map(|text| text.parse().unwrap()).collect();
        let revoked = all(&["module1~2", "module1", "operator.ada"]);
        let generations = Generations::of_all(revoked, all(&["module1~2", "module2~5", "plant"]));
        for text in ["module1~3", "operator.ada~2", "module2~5", "plant", "observer.wall"] {
            let issued: Issued = text.parse().unwrap();
            assert_eq!(generations.of(issued.holder.clone()), issued);
        }
    }
}
