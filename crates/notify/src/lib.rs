//! Sends notifications of incidents: by webhook, Alertmanager, mail and ntfy.
//!
//! | file | what |
//! |---|---|
//! | `settings` | recipients, from a file and from flags |
//! | `process` | observes, saves what is to be sent, and retries until it is delivered |
//! | `recipients` | the message that each service expects |
//!
//! What is sent, and when, is decided in [`observer::calls`].

mod process;
mod recipients;
mod settings;

pub use process::{NotifyConfig, run};
pub use settings::{HttpRecipient, MailRecipient, Notify, NotifySettings, Recipient, Service};
