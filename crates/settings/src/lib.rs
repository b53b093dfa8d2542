//! Settings files: TOML read into types, with every mistake at its line and all of them at once.

mod document;
mod error;

pub use document::Document;
pub use error::{ConfigError, ConfigErrors};
