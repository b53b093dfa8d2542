//! The web page: what operators look at, and the orders that they give.
//!
//! | file | what |
//! |---|---|
//! | `app` | what every request sees |
//! | `access` | who it is, and what he may do |

mod access;
mod app;
