//! Key expressions that access control uses for fleets: what crosses the link between a structure's gateway and the
//! fleet's router.
//!
//! Samples, divergences, changes, progress, statuses and peers' questions do not.

use crate::{OperatorName, StructureName};

use crate::keys::{ROOT, Topic};

/// What crosses, of one structure or of any.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Crossing {
    structure: String,
}

impl Crossing {
    /// What a structure may say and is asked for.
    #[must_use]
    pub fn of(structure: &StructureName) -> Self {
        Self { structure: structure.to_string() }
    }

    /// What a fleet asks for: its subscriptions and queries are about several structures at once.
    #[must_use]
    pub fn of_any() -> Self {
        Self { structure: "*".to_owned() }
    }

    /// What is published: verdicts, kinds of faults, phases.
    #[must_use]
    pub fn news(&self) -> Vec<String> {
        self.of_modules(&["fault/**", "identification/**", &Topic::Phase.to_string()])
    }

    /// Liveliness tokens.
    #[must_use]
    pub fn tokens(&self) -> Vec<String> {
        self.of_modules(&[&Topic::Alive.to_string()])
    }

    /// Read-only queries: what is published, as it is at present, and the journals.
    #[must_use]
    pub fn questions(&self) -> Vec<String> {
        let mut expressions = self.news();
        expressions.extend(self.of_modules(&[&Topic::History.to_string()]));
        expressions
    }

    /// Commands to modules, under the name of this operator. There are none to the plant.
    #[must_use]
    pub fn commands_of(&self, operator: &OperatorName) -> Vec<String> {
        self.of_modules(&[&format!("command/*/{operator}")])
    }

    /// Where modules take the commands of every operator.
    #[must_use]
    pub fn commands(&self) -> Vec<String> {
        self.of_modules(&["command/*/*"])
    }

    fn of_modules(&self, topics: &[&str]) -> Vec<String> {
        topics.iter().map(|topic| format!("{ROOT}/{}/*/{topic}", self.structure)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_verdicts_kinds_phases_presence_journals_and_commands_cross() {
        let crossing = Crossing::of(&"tower".parse().unwrap());
        let ada = "ada".parse().unwrap();
        let all = [crossing.questions(), crossing.tokens(), crossing.commands_of(&ada)].concat();
        let expected = [
            "trusswatch/tower/*/fault/**",
            "trusswatch/tower/*/identification/**",
            "trusswatch/tower/*/phase",
            "trusswatch/tower/*/history",
            "trusswatch/tower/*/alive",
            "trusswatch/tower/*/command/*/ada",
        ];
        assert_eq!(all, expected);
        assert_eq!(Crossing::of_any().tokens(), ["trusswatch/*/*/alive"]);
    }
}
