//! Takes one snapshot of a structure, once every module has answered.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, timeout_at};
use vocabulary::{ModuleName, StructureName};
use zenoh::Session;

use super::Live;
use crate::client::presence::AttendanceError;
use observer::{ModuleView, Scene};

/// A module sends a status every second; a first status may arrive this long after the first message.
const STATUS_WITHIN: Duration = Duration::from_millis(1300);
/// How long after the first message to wait for modules that no other module names as a peer.
const OTHERS_WITHIN: Duration = Duration::from_millis(200);

/// Takes a snapshot of a structure, or of all structures. `expected` lists modules that should be running; so does
/// every module's list of peers. A missing module appears in the scene as unknown: silence never counts as healthy.
///
/// Returns as soon as every known module has sent its status and the states of its components. Waits for modules that
/// send nothing until about a second after the first message, and never longer than `timeout`.
///
/// # Errors
/// Zenoh cannot declare a subscriber.
pub async fn present(
    session: &Session,
    structure: Option<&StructureName>,
    expected: &[ModuleName],
    timeout: Duration,
) -> Result<Arc<Scene>, AttendanceError> {
    let live = Live::over(session, structure.cloned(), expected.to_vec()).await?;
    scene_of(live, timeout, hold).await
}

/// Like [`present`], without waiting for the states of components: lists which modules are running or should be.
///
/// # Errors
/// Zenoh cannot declare a subscriber.
pub async fn attendance(
    session: &Session,
    structure: Option<&StructureName>,
    timeout: Duration,
) -> Result<Arc<Scene>, AttendanceError> {
    let live = Live::events(session, structure.cloned()).await?;
    scene_of(live, timeout, |scene, _| hold_for_statuses(scene)).await
}

async fn scene_of(
    live: Live,
    timeout: Duration,
    hold: fn(&Scene, Duration) -> Duration,
) -> Result<Arc<Scene>, AttendanceError> {
    let mut scenes = live.scenes();
    let end = Instant::now() + timeout;
    let mut first_message = None;
    loop {
        let scene = scenes.borrow_and_update().clone();
        live.network().await?;
        if scene.has_heard_a_module() {
            first_message.get_or_insert_with(Instant::now);
        }
        let until = first_message.map_or(end, |first| end.min(first + hold(&scene, timeout)));
        if Instant::now() >= until {
            return Ok(scene);
        }
        // The next look at the scene and the clock shows whether it changed.
        let _ = timeout_at(until, scenes.changed()).await;
    }
}

/// How long after the first message to wait for more.
fn hold(scene: &Scene, timeout: Duration) -> Duration {
    let is_mute = |module: &ModuleView| module.present && module.components.is_empty();
    let may_answer = scene.is_asking || scene.modules.iter().any(is_mute);
    if may_answer { timeout } else { hold_for_statuses(scene) }
}

fn hold_for_statuses(scene: &Scene) -> Duration {
    let all_reported = scene.modules.iter().all(|module| module.status.is_some());
    if all_reported { OTHERS_WITHIN } else { STATUS_WITHIN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use observer::testing;
    use vocabulary::FaultTransition;

    #[test]
    fn it_waits_until_every_present_or_expected_module_has_answered() {
        let (mut scene, timeout) = (Scene::default(), Duration::from_secs(9));
        let mut first = ModuleView::new(None, "m1".parse().unwrap());
        first.present = true;
        scene.modules.push(first);
        assert_eq!(hold(&scene, timeout), timeout, "the module is present");
        let state = FaultTransition::untouched(
            "tower".parse().unwrap(),
            "m1/sensor/g1".parse().unwrap(),
            0,
        );
        scene.modules[0].components.push(state);
        assert_eq!(hold(&scene, timeout), STATUS_WITHIN, "its status may come");
        scene.modules[0].status = Some(testing::status("m1", &["m2"]));
        assert_eq!(hold(&scene, timeout), OTHERS_WITHIN);
        scene.is_asking = true;
        assert_eq!(hold(&scene, timeout), timeout, "another process may answer, too");
        scene.is_asking = false;
        scene.modules.push(ModuleView::new(None, "m2".parse().unwrap()));
        assert_eq!(hold(&scene, timeout), STATUS_WITHIN, "a peer was named");
    }
}
