//! Queries a module about its components: its journal page by page, the kind of a component's fault with the signature,
//! and the freeze frames of its latest faults.

use std::time::Duration;

use tokio::time::{Instant, timeout_at};
use vocabulary::{
    ComponentPath, FaultTransition, FreezeFrame, FreezeFrameQuestion, HistoryQuestion,
    Identification, Key, ModuleName, StructureName, Topic, printable,
};
use zenoh::Session;
use zenoh::query::ConsolidationMode;

use super::request::{ask, read, senseless};
use observer::{ModuleHistory, QueryError, is_frame_of};

/// Reads a module's journal from the sequence number `since` on. `timeout` applies to each page. Pages read before a
/// failure are kept.
pub async fn history(
    session: &Session,
    structure: &StructureName,
    module: &ModuleName,
    since: u64,
    timeout: Duration,
) -> ModuleHistory {
    let key = Key::of_module(structure, module, Topic::History);
    let mut history = ModuleHistory::new(structure, module, since);
    let mut next = Some(since);
    while let Some(asked) = next {
        let parameters = HistoryQuestion::since(asked).to_parameters();
        let page = ask(session, &key, &parameters, timeout).await;
        match page.and_then(|page| history.accept(asked, page)) {
            Ok(following) => next = following,
            Err(error) => {
                history.broken_off = Some(error);
                return history;
            }
        }
    }
    history
}

/// The latest identification of a component's fault with its signature. `None` if its module has none or does not
/// answer within `timeout`.
///
/// # Errors
/// A refusal, or an invalid answer.
pub async fn identification(
    session: &Session,
    structure: &StructureName,
    component: &ComponentPath,
    timeout: Duration,
) -> Result<Option<Identification>, QueryError> {
    let topic = Topic::Identification(component.component.clone());
    let key = Key::of_module(structure, &component.module, topic);
    match ask::<Identification>(session, &key, "", timeout).await {
        Ok(found) if found.component == *component => Ok(Some(found)),
        Ok(found) => Err(senseless(format!("the reply belongs to `{}`", found.component))),
        Err(QueryError::Unanswered(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The freeze frame of the transition with this number.
///
/// # Errors
/// A refusal, which names the frames that exist; no answer within `timeout`; an invalid answer.
pub async fn freeze_frame(
    session: &Session,
    structure: &StructureName,
    module: &ModuleName,
    transition: u64,
    timeout: Duration,
) -> Result<FreezeFrame, QueryError> {
    let key = Key::of_module(structure, module, Topic::FreezeFrame);
    let parameters = FreezeFrameQuestion { transition: Some(transition) }.to_parameters();
    let frame = ask::<FreezeFrame>(session, &key, &parameters, timeout).await?;
    if frame.signals.sequence != transition {
        return Err(senseless(format!(
            "the frame belongs to transition {}",
            frame.signals.sequence
        )));
    }
    check(frame)
}

/// Every freeze frame in a module's store, newest first, without steps and traces.
///
/// # Errors
/// A refusal, e.g. because there are no frames; no answer within `timeout`; an invalid answer.
pub async fn freeze_frames(
    session: &Session,
    structure: &StructureName,
    module: &ModuleName,
    timeout: Duration,
) -> Result<Vec<FreezeFrame>, QueryError> {
    let key = Key::of_module(structure, module, Topic::FreezeFrame).to_string();
    let deadline = Instant::now() + timeout;
    // All frames have the same key, so Zenoh must not consolidate the replies.
    let query = session.get(key).consolidation(ConsolidationMode::None).timeout(timeout);
    let replies = query.await.map_err(senseless)?;
    let mut frames = Vec::new();
    while let Ok(Ok(reply)) = timeout_at(deadline, replies.recv_async()).await {
        frames.push(check(read(&reply, timeout)?)?);
    }
    if frames.is_empty() { Err(QueryError::Unanswered(timeout)) } else { Ok(frames) }
}

/// The freeze frame of a component's present fault.
///
/// # Errors
/// A printable reason.
pub async fn freeze_frame_of(
    session: &Session,
    found: &FaultTransition,
    timeout: Duration,
) -> Result<FreezeFrame, String> {
    let (structure, module) = (&found.structure, &found.module);
    let kept = freeze_frames(session, structure, module, timeout).await;
    let kept = kept.map_err(|error| why(&error))?;
    let Some(head) = kept.iter().find(|frame| is_frame_of(frame, found)) else {
        return Err("frames are complete two seconds after latching, and only the latest are kept"
            .to_owned());
    };
    let frame = freeze_frame(session, structure, module, head.signals.sequence, timeout).await;
    match frame {
        Ok(frame) if is_frame_of(&frame, found) => Ok(frame),
        Ok(frame) => Err(format!("the reply belongs to another fault, of {}", frame.component)),
        Err(error) => Err(why(&error)),
    }
}

fn why(error: &QueryError) -> String {
    match error {
        QueryError::Refused(reason) => printable(reason),
        QueryError::Unanswered(_) => "its module does not provide one".to_owned(),
        other => printable(&other.to_string()),
    }
}

/// Checks that every trace has a value for every step.
fn check(frame: FreezeFrame) -> Result<FreezeFrame, QueryError> {
    let steps = frame.signals.steps.len();
    match frame.signals.traces.iter().find(|trace| trace.values.len() != steps) {
        None => Ok(frame),
        Some(trace) => {
            let (name, values) = (&trace.name, trace.values.len());
            Err(senseless(format!("`{name}` has {values} values for {steps} steps")))
        }
    }
}
