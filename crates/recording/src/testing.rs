//! Messages for tests.

use crate::Recorded;
use crate::channels::entry_of;

/// The catalogue's example of the message on this topic.
pub(crate) fn example(topic: &str) -> Recorded {
    let payload = entry_of(topic).unwrap().example().as_bytes().to_vec();
    Recorded::received(topic.to_owned(), payload, 1)
}
