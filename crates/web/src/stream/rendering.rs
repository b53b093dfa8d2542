//! Renders the parts of a page while it is viewed.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch::{Receiver, Sender};
use tokio::time::{MissedTickBehavior, interval, sleep};

use crate::access::Viewer;
use crate::app::Shared;
use crate::component::ComponentWatch;
use crate::live_page::LivePage;
use crate::part::{PagePart, Parts, part};
use crate::view::LinkedScene;
use crate::{events, layout, module, overview, wall};

/// Shortest interval between renderings, which users still perceive as immediate.
const PAUSE: Duration = Duration::from_millis(150);
/// Longest interval, because ages grow.
const AT_LEAST_EVERY: Duration = Duration::from_secs(1);

/// Subscribes to the parts of a page.
pub(super) fn subscribe(app: &Shared, page: &LivePage) -> Receiver<Arc<Parts>> {
    let work = |sender| render(Arc::clone(app), page.clone(), sender);
    app.streams.pages.subscribe(page.clone(), Arc::default(), work)
}

/// The part that depends on the viewer, as JSON.
pub(super) fn person(app: &Shared, viewer: &Viewer) -> String {
    let mut person = part("person", layout::person(viewer));
    person.html = app.access.site().based(&person.html);
    // Two strings can always be encoded.
    serde_json::to_string(&person).unwrap_or_default()
}

/// Renders until the last viewer has left.
async fn render(app: Shared, page: LivePage, parts: Sender<Arc<Parts>>) {
    let mut scenes = app.observed.live.scenes();
    let mut watch = match &page {
        LivePage::Component(id) => Some(ComponentWatch::new(&app.observed, id.clone())),
        _ => None,
    };
    let mut ticks = interval(AT_LEAST_EVERY);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let rendered = rendered(&app, &page, watch.as_mut());
        let next = parts.borrow().next(rendered);
        if let Some(next) = next {
            parts.send_replace(Arc::new(next));
        }
        sleep(PAUSE).await;
        tokio::select! {
            changed = scenes.changed() => if changed.is_err() { return },
            () = news(watch.as_mut()) => {}
            _ = ticks.tick() => {}
        }
    }
}

async fn news(watch: Option<&mut ComponentWatch>) {
    match watch {
        Some(watch) => watch.news().await,
        None => std::future::pending().await,
    }
}

fn rendered(app: &Shared, page: &LivePage, watch: Option<&mut ComponentWatch>) -> Vec<PagePart> {
    let scene = app.observed.scene();
    let view = LinkedScene::new(&scene);
    let mut parts = match (page, watch) {
        (LivePage::Overview, _) => overview::parts(&view, app.drawing.as_ref()),
        (LivePage::Wall, _) => wall::parts(&view, app.drawing.as_ref()),
        (LivePage::Events, _) => events::parts(&view),
        (LivePage::Module(id), _) => module::parts(&view, id),
        (LivePage::Component(_), Some(watch)) => watch.parts(&view),
        (LivePage::Component(_), None) => Vec::new(),
    };
    let title = match page {
        LivePage::Overview | LivePage::Wall => Some(scene.summary()),
        LivePage::Events => Some(events::TITLE.to_owned()),
        LivePage::Module(id) => Some(module::title(id)),
        LivePage::Component(id) => scene.state_of(id).map(observer::title),
    };
    parts.extend(title.map(|title| part("title", layout::title(&scene, &title))));
    for part in &mut parts {
        part.html = app.access.site().based(&part.html);
    }
    if *page == LivePage::Overview {
        parts.push(part("notifier", app.troubles()));
    }
    parts.push(part("icon", layout::icon(&scene)));
    parts.push(part("network", layout::network(&scene)));
    parts.push(part("clock", layout::clock(&scene)));
    parts
}
