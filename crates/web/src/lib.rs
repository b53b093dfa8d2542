//! The web page: what operators look at, and the orders that they give.
//!
//! | file | what |
//! |---|---|
//! | `config` | where it is served, and what it shows |
//! | `server` | the process, from its start to its end |
//! | `router` | which path leads where |
//! | `app` | what every request sees, and what is counted |
//! | `access` | who it is, and what he may do |
//! | `orders` | forms that order something |
//! | `listener` | addresses, TLS, limits |
//! | `view` | a scene with the links that lead on from it |
//! | `look`, `drawing` | how a state looks; the structure drawn with the states of its components |
//! | `layout`, `assets` | what all pages have in common; style sheet and script |
//! | `overview`, `component`, `module`, `history`, `events` | the pages |
//! | `forms` | the forms in which orders are given |
//! | `live_page`, `part` | which page is kept up to date, and its parts |
//! | `stream` | parts of pages as they change |
//! | `observed` | the scene, and what is asked of modules, once for all pages |
//! | `hub` | work that goes on only while somebody looks |
//! | `metrics` | `/metrics` and `/healthz` |

mod access;
mod app;
mod assets;
mod component;
mod config;
mod drawing;
mod events;
mod forms;
mod history;
mod hub;
mod layout;
mod listener;
mod live_page;
mod look;
mod metrics;
mod module;
mod observed;
mod orders;
mod overview;
mod part;
mod router;
mod server;
mod stream;
#[cfg(test)]
mod test_server;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod view;

pub use access::{LinkError, NoRandomness, PersonName, PersonNameError, VALID, one_time_link};
pub use config::WebConfig;
pub use listener::{ListenError, ListenerSettings, Origin, OriginError, TlsFiles};
pub use server::run;
