//! What an operator orders a diagnoser to do, and what becomes of it.
//!
//! An order is the payload of a query on `{module}/command/{kind}` or, under an operator's name,
//! `{module}/command/{kind}/{operator}`. The reply is [`Obeyed`], which says whether the transition is in the journal, or [`crate::Refused`].

use crate::{Component, Mention};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::fault_state::FaultState;
use crate::given_order::{GivenOrder, GivenOrderKind};
use crate::shelving::{SHELVING_SECONDS, Span};

/// Longest name and longest note that are accepted, in bytes.
pub const MAX_ORDER_TEXT: usize = 500;

/// What is ordered; the key says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderKind {
    /// A person has seen the fault.
    Acknowledge,
    /// The component is repaired.
    Reset,
    /// Its alarm is shelved for a time.
    Shelve,
    /// Its alarm counts again.
    Unshelve,
    /// The alarms of all components of a module are suppressed while it is maintained.
    Suppress,
    /// They count again.
    Unsuppress,
    /// A faulty cylinder is shut off: both chambers are emptied into the tank.
    ShutOff,
    /// It is put back.
    PutBack,
    /// A person knows the component to be faulty.
    Declare,
}

impl OrderKind {
    /// Each of them.
    pub const ALL: [OrderKind; 9] = [
        OrderKind::Acknowledge,
        OrderKind::Reset,
        OrderKind::Shelve,
        OrderKind::Unshelve,
        OrderKind::Suppress,
        OrderKind::Unsuppress,
        OrderKind::ShutOff,
        OrderKind::PutBack,
        OrderKind::Declare,
    ];

    /// Whether it is about a module with all its components.
    #[must_use]
    pub fn is_of_module(self) -> bool {
        matches!(self, OrderKind::Suppress | OrderKind::Unsuppress)
    }

    /// Whether it is about the verdict, not about the alarm alone.
    #[must_use]
    pub fn is_about_verdict(self) -> bool {
        matches!(self, OrderKind::Acknowledge | OrderKind::Reset | OrderKind::Declare)
    }

    /// Whether it begins something that has an end and a reason.
    #[must_use]
    pub fn sets_aside(self) -> bool {
        matches!(self, OrderKind::Shelve | OrderKind::Suppress)
    }

    /// The name in keys and messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            OrderKind::Acknowledge => "acknowledge",
            OrderKind::Reset => "reset",
            OrderKind::Shelve => "shelve",
            OrderKind::Unshelve => "unshelve",
            OrderKind::Suppress => "suppress",
            OrderKind::Unsuppress => "unsuppress",
            OrderKind::ShutOff => "shut-off",
            OrderKind::PutBack => "put-back",
            OrderKind::Declare => "declare",
        }
    }
}

/// An order concerning one component, or a module with all its components.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Order {
    /// The component, with its module or without: the key says which it is. None if the order is about the module.
    pub component: Option<Mention>,
    /// Who issued the command.
    pub by: String,
    /// In whose name, if `by` is a program that a person uses, such as the web page.
    pub on_behalf_of: Option<String>,
    /// The reason. Required to shelve, suppress or declare.
    pub note: Option<String>,
    /// Duration of shelving or suppression, from 1 s to 31 days \[s\].
    pub for_s: Option<u64>,
    /// Reset even though the evidence is still there.
    #[serde(default)]
    pub force: bool,
    /// Reset, for the component was replaced and what it measures now is right: its reference is shifted by that.
    #[serde(default)]
    pub re_tare: bool,
}

impl Order {
    /// What is wrong with an order of this kind, if anything is.
    ///
    /// # Errors
    /// No name is given, a text is too long, something that the kind needs is missing or out of range, or two manners
    /// exclude each other.
    pub fn check(&self, kind: OrderKind) -> Result<(), String> {
        self.check_subject(kind)?;
        self.check_time(kind)?;
        if self.force && self.re_tare {
            return Err("`force` and `re_tare` exclude each other; use one".to_owned());
        }
        if self.by.trim().is_empty() {
            return Err("`by` is empty; state who issues the command".to_owned());
        }
        let texts = [
            ("by", Some(&self.by)),
            ("on_behalf_of", self.on_behalf_of.as_ref()),
            ("note", self.note.as_ref()),
        ];
        for (name, text) in texts {
            let length = text.map_or(0, String::len);
            if length > MAX_ORDER_TEXT {
                return Err(format!("`{name}` has {length} bytes; use at most {MAX_ORDER_TEXT}"));
            }
        }
        Ok(())
    }

    /// The order given at this time \[ns since 1970\], by whom and why.
    #[must_use]
    pub fn given(self, kind: OrderKind, now_unix_ns: u64) -> GivenOrder {
        let seconds = self.for_s.unwrap_or(0);
        let span = Span {
            since_unix_ns: now_unix_ns,
            until_unix_ns: now_unix_ns.saturating_add(seconds.saturating_mul(1_000_000_000)),
        };
        let kind = match kind {
            OrderKind::Acknowledge => GivenOrderKind::Acknowledge,
            OrderKind::Reset if self.re_tare => GivenOrderKind::ReTare,
            OrderKind::Reset => GivenOrderKind::Reset { force: self.force },
            OrderKind::Shelve => GivenOrderKind::Shelve(span),
            OrderKind::Unshelve => GivenOrderKind::Unshelve,
            OrderKind::Suppress => GivenOrderKind::Suppress(span),
            OrderKind::Unsuppress => GivenOrderKind::Unsuppress,
            OrderKind::ShutOff => GivenOrderKind::ShutOff { since_unix_ns: now_unix_ns },
            OrderKind::PutBack => GivenOrderKind::PutBack,
            OrderKind::Declare => GivenOrderKind::Declare,
        };
        let Self { by, on_behalf_of, note, .. } = self;
        GivenOrder { kind, by, on_behalf_of, note }
    }

    fn check_subject(&self, kind: OrderKind) -> Result<(), String> {
        let order = kind.as_str();
        match (&self.component, kind.is_of_module()) {
            (None, false) => Err(format!("`component` is missing; name what to {order}")),
            (Some(component), true) => Err(format!(
                "`{order}` is about the whole module; leave `component` out, here `{component}`"
            )),
            _ => Ok(()),
        }
    }

    fn has_reason(&self) -> bool {
        self.note.as_ref().is_some_and(|note| !note.trim().is_empty())
    }

    fn check_time(&self, kind: OrderKind) -> Result<(), String> {
        let (order, range) = (kind.as_str(), SHELVING_SECONDS);
        let (least, most) = (range.start(), range.end());
        match self.for_s {
            Some(_) if !kind.sets_aside() => {
                Err(format!("`{order}` takes no `for_s`; leave it out"))
            }
            Some(seconds) if !range.contains(&seconds) => {
                Err(format!("`for_s` is {seconds}; use {least} to {most} seconds"))
            }
            None if kind.sets_aside() => {
                Err(format!("`{order}` always ends; give `for_s`, {least} to {most} seconds"))
            }
            _ if kind == OrderKind::Declare && !self.has_reason() => {
                Err("`declare` needs a reason in `note`".to_owned())
            }
            Some(_) if !self.has_reason() => Err(format!("`{order}` needs a reason in `note`")),
            _ => Ok(()),
        }
    }
}

/// The order was obeyed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Obeyed {
    /// The component; none if the order was about the module.
    pub component: Option<Component>,
    /// Its state now; of a module, that of its component with the latest transition.
    pub state: FaultState,
    /// The sequence number of the transition; of the last of several.
    pub sequence: u64,
    /// Whether the journal has it. If not, a disk is full or hangs, and a restart may forget the order.
    pub durable: bool,
}

impl Message for Order {
    const WHAT: &'static str = "order";
}

impl Message for Obeyed {
    const WHAT: &'static str = "order's reply";
}
