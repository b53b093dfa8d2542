//! A part of a page, with the number of its latest change; and the parts of all viewed pages.

use std::sync::Arc;

use maud::Markup;
use serde::Serialize;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::hub::{Hub, LINGER};
use crate::live_page::LivePage;

/// A rendered part: the identifier of its element, and the content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct PagePart {
    pub(crate) id: &'static str,
    pub(crate) html: String,
}

pub(crate) fn part(id: &'static str, html: Markup) -> PagePart {
    PagePart { id, html: html.into_string() }
}

/// The parts of a page, each ready to be sent.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parts(Vec<Ready>);

#[derive(Debug, Clone)]
struct Ready {
    part: PagePart,
    /// JSON, encoded once for all viewers.
    json: Arc<str>,
    /// The version in which the part last changed.
    version: u64,
}

impl Parts {
    /// The version of the latest change; 0 before the first.
    pub(crate) fn version(&self) -> u64 {
        self.0.iter().map(|ready| ready.version).max().unwrap_or_default()
    }

    /// The next version, if a part has changed. Unchanged parts keep their version.
    pub(crate) fn next(&self, parts: Vec<PagePart>) -> Option<Parts> {
        let version = self.version() + 1;
        let next: Vec<Ready> = parts
            .into_iter()
            .map(|part| {
                let known = self.0.iter().find(|ready| ready.part.id == part.id);
                match known.filter(|ready| ready.part == part) {
                    Some(same) => same.clone(),
                    None => {
                        // Two strings can always be encoded.
                        let json = serde_json::to_string(&part).unwrap_or_default().into();
                        Ready { part, json, version }
                    }
                }
            })
            .collect();
        let next = Parts(next);
        (next.version() == version).then_some(next)
    }

    /// The parts changed since a version, as a JSON list; `None` if there are none.
    pub(crate) fn since(&self, version: u64) -> Option<String> {
        let changed: Vec<&str> = self
            .0
            .iter()
            .filter(|ready| ready.version > version)
            .map(|ready| &*ready.json)
            .collect();
        (!changed.is_empty()).then(|| format!("[{}]", changed.join(",")))
    }
}

/// Most streams at a time; further pages poll.
pub(crate) const MOST: usize = 256;

/// The pages being viewed, and permits for streams.
#[derive(Debug)]
pub(crate) struct Streams {
    pub(crate) pages: Hub<LivePage, Arc<Parts>>,
    places: Arc<Semaphore>,
}

impl Default for Streams {
    fn default() -> Self {
        Self { pages: Hub::new(LINGER), places: Arc::new(Semaphore::new(MOST)) }
    }
}

impl Streams {
    /// The number of open streams.
    pub(crate) fn open(&self) -> u64 {
        (MOST - self.places.available_permits()) as u64
    }

    /// A permit for a stream, unless the maximum is reached.
    pub(crate) fn place(&self) -> Option<OwnedSemaphorePermit> {
        Arc::clone(&self.places).try_acquire_owned().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(html: &str) -> PagePart {
        PagePart { id: if html.len() > 1 { "long" } else { "short" }, html: html.to_owned() }
    }

    #[test]
    fn only_what_has_changed_is_sent() {
        let first = Parts::default().next(vec![of("a"), of("bb")]).unwrap();
        let all = r#"[{"id":"short","html":"a"},{"id":"long","html":"bb"}]"#;
        assert_eq!(first.since(0).as_deref(), Some(all));
        assert!(first.next(vec![of("a"), of("bb")]).is_none());
        let second = first.next(vec![of("a"), of("b\"b")]).unwrap();
        let changed = r#"[{"id":"long","html":"b\"b"}]"#;
        assert_eq!(second.since(first.version()).as_deref(), Some(changed));
        assert_eq!(second.since(second.version()), None);
        let everything = second.since(0).unwrap();
        assert!(everything.contains("short") && everything.contains("long"));
    }
}
