//! The web page for operators: shows the structure and sends orders.
//!
//! | file | what |
//! |---|---|
//! | `server` | configuration; the process, from start to shutdown |
//! | `app` | the state shared by all request handlers; maps paths to them |
//! | `access` | authentication and authorization |
//! | `orders` | handles submitted orders |
//! | `listener` | addresses, TLS, limits |
//! | `view` | a scene with links to pages |
//! | `look`, `drawing` | how states look; draws the structure with the states of its components |
//! | `layout`, `assets` | the common layout; style sheet and script |
//! | `overview`, `component`, `module`, `history`, `events` | the pages |
//! | `report` | a period, and a fault, for the files |
//! | `forms` | forms for orders |
//! | `live_page`, `part` | a page that is kept up to date, and its parts |
//! | `stream` | sends changed parts of pages |
//! | `observed` | the scene and answers of modules, shared by all pages |
//! | `records` | the page's own records: events and margins |
//! | `hub` | background work shared by viewers |
//! | `metrics` | `/metrics` and `/healthz` |

mod access;
mod app;
mod assets;
mod component;
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
mod notifier;
mod observed;
mod orders;
mod overview;
mod part;
mod records;
mod report;
mod server;
mod stream;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod view;
mod wall;

pub use access::{
    Device, LinkError, NoRandomness, PersonName, PersonNameError, VALID, devices, one_time_link,
    sign_out_devices,
};
pub use listener::{ListenError, PageAccess, PageAddress, PageAddressError};
pub use server::{WebConfig, run};
