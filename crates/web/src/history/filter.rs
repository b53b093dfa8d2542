//! Filters for the history page, taken from the URL.

use maud::{Markup, html};
use observer::{JournalEntry, ModuleView};
use serde::Deserialize;
use vocabulary::words::parse_utc;
use vocabulary::{ComponentPath, FaultState, ModuleName};

use crate::view::LinkedScene;

const STATES: [FaultState; 6] = [
    FaultState::Normal,
    FaultState::Tentative,
    FaultState::Unconfirmed,
    FaultState::Explained,
    FaultState::Latched,
    FaultState::Acknowledged,
];

/// Query parameters. Empty ones count as absent, because a form sends them.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub(crate) struct HistoryParameters {
    from: String,
    to: String,
    module: String,
    component: String,
    state: String,
}

/// The parsed parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct HistoryFilter {
    from_unix_ns: Option<u64>,
    to_unix_ns: Option<u64>,
    module: Option<ModuleName>,
    component: Option<ComponentPath>,
    state: Option<FaultState>,
}

impl HistoryParameters {
    /// Parses the parameters, or reports which one is invalid and what is expected.
    pub(super) fn filter(&self) -> Result<HistoryFilter, String> {
        let state = |text: &str| {
            let known = STATES.into_iter().find(|state| state.as_str() == text);
            known.ok_or_else(|| {
                format!("unknown state `{text}`: expected one of {}", names_of_states())
            })
        };
        Ok(HistoryFilter {
            from_unix_ns: given("from", &self.from, parse_utc)?,
            to_unix_ns: given("to", &self.to, parse_utc)?,
            module: given("module", &self.module, |text| {
                text.parse().map_err(|e: vocabulary::NameError| e.to_string())
            })?,
            component: given("component", &self.component, |text| {
                text.parse().map_err(|error: vocabulary::ComponentError| error.to_string())
            })?,
            state: given("state", &self.state, state)?,
        })
    }

    /// The form with the filters.
    pub(super) fn form(&self, view: &LinkedScene<'_>) -> Markup {
        let modules = view.scene.modules.iter().map(|module| module.module.as_str());
        html! {
            form.filter method="get" action="/history" {
                label { "From [UTC]" input type="datetime-local" step="1" name="from" value=(local(&self.from)); }
                label { "To [UTC]" input type="datetime-local" step="1" name="to" value=(local(&self.to)); }
                label { "Module" select name="module" {
                    option value="" { "all" }
                    @for name in modules { option value=(name) selected[name == self.module] { (name) } }
                } }
                label { "Component" input type="text" name="component" value=(self.component) placeholder="module1/sensor/g1"; }
                label { "State" select name="state" {
                    option value="" { "all" }
                    @for state in STATES { option value=(state) selected[state.as_str() == self.state] { (state) } }
                } }
                button type="submit" { "Show" }
                a href="/history" { "No filter" }
            }
        }
    }
}

impl HistoryFilter {
    pub(super) fn wants_module(&self, module: &ModuleView) -> bool {
        let name = &module.module;
        self.module.as_ref().is_none_or(|wanted| wanted == name)
            && self.component.as_ref().is_none_or(|wanted| wanted.module == *name)
    }

    pub(super) fn wants(&self, entry: &JournalEntry<'_>) -> bool {
        let time = entry.time_unix_ns();
        self.from_unix_ns.is_none_or(|from| time >= from)
            && self.to_unix_ns.is_none_or(|to| time <= to)
            && self.component.as_ref().is_none_or(|wanted| entry.concerns(wanted))
            && self.state.is_none_or(|wanted| entry.state() == Some(wanted))
    }
}

fn given<T>(
    name: &str,
    text: &str,
    read: impl Fn(&str) -> Result<T, String>,
) -> Result<Option<T>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    read(text).map(Some).map_err(|problem| format!("{name}: {problem}"))
}

/// The time in the format of an HTML time field.
fn local(text: &str) -> &str {
    text.trim_end_matches('Z')
}

fn names_of_states() -> String {
    STATES.map(|state| format!("`{state}`")).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(from: &str, component: &str, state: &str) -> HistoryParameters {
        let [from, component, state] = [from, component, state].map(str::to_owned);
        HistoryParameters { from, component, state, ..HistoryParameters::default() }
    }

    #[test]
    fn what_is_wrong_is_named_with_what_would_be_right() {
        for (asked, words) in [
            (asked("yesterday", "", ""), "from: invalid time `yesterday`: expected UTC, e.g."),
            (asked("1960-01-01T00:00:00Z", "", ""), "from: invalid time `1960-01-01T00:00:00Z`"),
            (asked("", "g1", ""), "component: "),
            (asked("", "", "healthy"), "state: unknown state `healthy`: expected one of `normal`"),
        ] {
            let problem = asked.filter().unwrap_err();
            assert!(problem.starts_with(words), "{problem}");
        }
    }

    #[test]
    fn an_empty_form_wants_everything() {
        assert_eq!(asked("", "", "").filter(), Ok(HistoryFilter::default()));
    }
}
