//! Tests of the whole: what is rendered of a scene, and what a real server sends.

mod pages;
pub(crate) mod server;
mod serving;
