//! The diagnosers that must be there before the first step.

use vocabulary::ModuleName;

use super::attendance::Attendance;
use super::status::Board;

/// Whom is waited for, and what was last said of it.
#[derive(Debug)]
pub(crate) struct Awaited {
    modules: Vec<ModuleName>,
    announced: Option<Vec<ModuleName>>,
}

impl Awaited {
    pub(crate) fn new(modules: Vec<ModuleName>) -> Self {
        Self { modules, announced: None }
    }

    /// Are all there? If not, log and status say who is not, once.
    pub(crate) fn are_there(&mut self, attendance: &Attendance, board: &Board) -> bool {
        let missing = attendance.missing(&self.modules);
        if missing.is_empty() {
            return true;
        }
        if self.announced.as_ref() != Some(&missing) {
            let names: Vec<String> = missing.iter().map(ToString::to_string).collect();
            tracing::info!(missing = names.join(", "), "waiting for diagnosers");
            board.waiting(missing.clone());
            self.announced = Some(missing);
        }
        false
    }
}
