//! Determines which modules are peers.
//!
//! Members are numbered copy by copy, and within a copy in the order of the templates.

use truss::copy_prefix;
use vocabulary::ModuleName;

use super::template::Template;

pub(super) struct Neighbourhood {
    /// Names of the modules of the original, and for each the indices of the peers in its configuration.
    kinds: Vec<(ModuleName, Vec<usize>)>,
    copies: usize,
    /// Number of copies on either side whose modules are peers; `None` for the peers in the configuration.
    reach: Option<usize>,
}

impl Neighbourhood {
    pub(super) fn new(
        templates: &[Template],
        copies: usize,
        reach: Option<usize>,
    ) -> Neighbourhood {
        let place = |name: &ModuleName| templates.iter().position(|other| other.module() == name);
        let kinds = templates.iter().map(|template| {
            (template.module().clone(), template.peers().iter().filter_map(place).collect())
        });
        Neighbourhood { kinds: kinds.collect(), copies, reach }
    }

    /// The number of modules.
    pub(super) fn members(&self) -> usize {
        self.copies * self.kinds.len()
    }

    /// Copy and template of a member.
    pub(super) fn place(&self, member: usize) -> (usize, usize) {
        (member / self.kinds.len(), member % self.kinds.len())
    }

    /// The members that a member queries, ascending.
    fn peers(&self, member: usize) -> Vec<usize> {
        let (copy, kind) = self.place(member);
        let in_copy = |copy: usize| copy * self.kinds.len();
        match self.reach {
            None => {
                let mut named: Vec<usize> =
                    self.kinds[kind].1.iter().map(|other| in_copy(copy) + other).collect();
                named.sort_unstable();
                named
            }
            Some(reach) => {
                let first = copy.saturating_sub(reach);
                let last = copy.saturating_add(reach).min(self.copies - 1);
                (in_copy(first)..in_copy(last + 1)).filter(|other| *other != member).collect()
            }
        }
    }

    /// The names of the members that a member queries.
    pub(super) fn peer_names(&self, member: usize) -> Vec<String> {
        self.peers(member).into_iter().map(|other| self.name(other)).collect()
    }

    /// The members that a member queries or is queried by, ascending.
    pub(super) fn linked(&self, member: usize) -> Vec<usize> {
        match self.reach {
            // The relation is symmetric.
            Some(_) => self.peers(member),
            None => {
                let (copy, kind) = self.place(member);
                let (count, own) = (self.kinds.len(), &self.kinds[kind].1);
                let links =
                    |other: &usize| own.contains(other) || self.kinds[*other].1.contains(&kind);
                (0..count).filter(links).map(|other| copy * count + other).collect()
            }
        }
    }

    fn name(&self, member: usize) -> String {
        let (copy, kind) = self.place(member);
        format!("{}{}", copy_prefix(copy, self.copies), self.kinds[kind].0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three copies of two modules, of which only the second asks the first.
    fn neighbourhood(reach: Option<usize>) -> Neighbourhood {
        let kinds = [("a", vec![]), ("b", vec![0])];
        let kinds = kinds.into_iter().filter_map(|(name, peers)| Some((name.parse().ok()?, peers)));
        Neighbourhood { kinds: kinds.collect(), copies: 3, reach }
    }

    #[test]
    fn peers_are_those_that_the_configuration_names_in_the_same_copy() {
        let row = neighbourhood(None);
        assert_eq!(row.members(), 6);
        assert_eq!(row.peer_names(2), Vec::<String>::new());
        assert_eq!(row.peer_names(3), ["t02-a"]);
        // Both ends of a question have to be linked.
        assert_eq!((row.linked(2), row.linked(3)), (vec![3], vec![2]));
    }

    #[test]
    fn peers_are_all_within_reach_but_oneself() {
        let row = neighbourhood(Some(0));
        assert_eq!(row.peer_names(2), ["t02-b"]);
        let row = neighbourhood(Some(1));
        assert_eq!(row.peer_names(0), ["t01-b", "t02-a", "t02-b"]);
        assert_eq!(row.peer_names(3), ["t01-a", "t01-b", "t02-a", "t03-a", "t03-b"]);
        let row = neighbourhood(Some(usize::MAX));
        assert_eq!(row.linked(5), [0, 1, 2, 3, 4]);
    }
}
