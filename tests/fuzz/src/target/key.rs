//! Keys, and the names in them.

use std::fmt::Display;
use std::str::FromStr;

use daemon::config::Speed;
use vocabulary::{Component, ComponentPath, Key, ModuleName};
use zenoh::key_expr::keyexpr;

use crate::refusal::is_bearable;

/// What is a key or a name prints as it was read; a key is one to the network too, without wildcards.
pub(super) fn check(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if prints_as_read::<Key>(text) {
        let expression = keyexpr::new(text).unwrap();
        assert!(!expression.is_wild(), "{text} has wildcards");
    }
    prints_as_read::<ComponentPath>(text);
    prints_as_read::<Component>(text);
    prints_as_read::<ModuleName>(text);
    speed(text);
}

fn prints_as_read<T: FromStr + Display>(text: &str) -> bool
where
    T::Err: Display,
{
    match text.parse::<T>() {
        Ok(read) => {
            assert_eq!(read.to_string(), text);
            true
        }
        Err(error) => {
            is_bearable(&error.to_string());
            false
        }
    }
}

/// A number has many spellings, so a speed is compared as a value.
fn speed(text: &str) {
    match text.parse::<Speed>() {
        Ok(speed) => assert_eq!(speed.to_string().parse(), Ok(speed)),
        Err(error) => is_bearable(&error.to_string()),
    }
}
