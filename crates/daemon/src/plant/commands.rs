//! Commands from the network (faults, repairs, strokes): queued, carried out by the plant's thread, answered.

use std::sync::mpsc as std_mpsc;
use std::sync::mpsc::TrySendError;

use plant::Plant;
use tokio::sync::mpsc;
use vocabulary::{
    ComponentPath, DecodeError, Injected, Injection, Key, Mention, PlantTopic, Refused, Step,
    Stroke, StrokeBegun, StructureName,
};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};

use super::agenda::{Agenda, ScheduledChange};

/// Commands, and replies, that may wait.
pub(crate) const QUEUE: usize = 256;

/// What the plant is to do.
#[derive(Debug)]
pub(crate) enum PlantCommand {
    Inject(Injection),
    Stroke(Stroke),
}

/// A command and where its reply goes.
#[derive(Debug)]
pub(crate) struct PendingCommand {
    pub(crate) command: PlantCommand,
    pub(crate) query: Query,
}

/// A reply on its way: the encoded message, or why the command was refused.
#[derive(Debug)]
pub(crate) struct CommandReply {
    pub(crate) outcome: Result<Vec<u8>, String>,
    pub(crate) query: Query,
}

/// Decodes the commands of one key.
type Decode = fn(&[u8]) -> Result<PlantCommand, DecodeError>;

/// The keys that take commands.
const KEYS: [(PlantTopic, Decode); 2] = [
    (PlantTopic::Inject, |bytes| vocabulary::decode(bytes).map(PlantCommand::Inject)),
    (PlantTopic::Stroke, |bytes| vocabulary::decode(bytes).map(PlantCommand::Stroke)),
];

impl PlantCommand {
    /// The component that it is about.
    pub(crate) fn component(&self) -> &Mention {
        match self {
            PlantCommand::Inject(injection) => &injection.component,
            PlantCommand::Stroke(stroke) => &stroke.component,
        }
    }

    /// Carries it out, or puts it on the agenda. Returns the reply.
    pub(crate) fn carry_out(
        self,
        plant: &mut Plant,
        agenda: &mut Agenda,
    ) -> Result<Vec<u8>, String> {
        let reply = match self {
            PlantCommand::Inject(order) => vocabulary::encode(&inject(order, plant, agenda)?),
            PlantCommand::Stroke(order) => vocabulary::encode(&begin_stroke(&order, plant)?),
        };
        reply.map_err(|error| error.to_string())
    }
}

/// Gives a component a fault or repairs it, now or at a later step.
fn inject(
    injection: Injection,
    plant: &mut Plant,
    agenda: &mut Agenda,
) -> Result<Injected, String> {
    let Injection { component, fault, at_step } = injection;
    let component = component_of(&component, plant)?;
    let next_step = plant.next_step();
    let step = at_step.unwrap_or(next_step);
    if step < next_step {
        return Err(format!("step {step} has passed; the next one is {next_step}"));
    }
    let change = ScheduledChange { step, component: component.clone(), fault };
    // A command for later is tried on a copy, so that it can be refused now.
    if step == next_step {
        apply(&change, plant)?;
    } else {
        apply(&change, &mut plant.clone())?;
        agenda.add(change);
    }
    tracing::info!(%component, ?fault, %step, "command carried out");
    Ok(Injected { component, effective_step: step })
}

fn apply(change: &ScheduledChange, plant: &mut Plant) -> Result<(), String> {
    let done = match change.fault {
        Some(fault) => plant.inject(&change.component, fault),
        None => plant.clear(&change.component),
    };
    done.map_err(|error| error.to_string())
}

/// Applies all changes that are due before `step` is computed. Were there any?
pub(crate) fn catch_up(agenda: &mut Agenda, plant: &mut Plant, step: Step) -> bool {
    let mut any = false;
    while let Some(change) = agenda.next_due(step) {
        any = true;
        let done = if change.fault.is_some() { "fault injected" } else { "repaired" };
        match apply(&change, plant) {
            Ok(()) => {
                tracing::info!(component = %change.component, %step, fault = ?change.fault, "{done}")
            }
            Err(error) => {
                tracing::error!(component = %change.component, %step, "not {done}: {error}")
            }
        }
    }
    any
}

/// Begins a stroke with the next step.
fn begin_stroke(order: &Stroke, plant: &mut Plant) -> Result<StrokeBegun, String> {
    let component = component_of(&order.component, plant)?;
    let stroke = plant::StrokeTest {
        actuator: component.clone(),
        force_n: order.force_n,
        duration_s: order.duration_s,
        largest_strain: order.largest_strain,
    };
    let first_step = plant.next_step();
    let last_step = plant.begin_stroke(stroke).map_err(|error| error.to_string())?;
    tracing::info!(%component, force_n = order.force_n, %first_step, %last_step, "stroke begins");
    Ok(StrokeBegun { component, first_step, last_step })
}

/// The component that is mentioned: where no module is given, the only one of that name.
fn component_of(mention: &Mention, plant: &Plant) -> Result<ComponentPath, String> {
    if let Mention { module: Some(module), component } = mention {
        return Ok(ComponentPath { module: module.clone(), component: component.clone() });
    }
    let all: Vec<_> = plant.components().filter(|path| mention.may_be(path)).collect();
    match all.as_slice() {
        [only] => Ok((*only).clone()),
        [] => Err(format!("no module has a component `{mention}`")),
        several => {
            let paths: Vec<String> = several.iter().map(|path| format!("`{path}`")).collect();
            Err(format!("`{mention}` may be {}; write which", paths.join(" or ")))
        }
    }
}

/// Takes commands on every key that there is for them. What cannot be decoded is refused on the spot.
pub(crate) async fn declare(
    session: &Session,
    structure: &StructureName,
    commands: std_mpsc::SyncSender<PendingCommand>,
    replies: mpsc::Sender<CommandReply>,
) -> zenoh::Result<Vec<Queryable<()>>> {
    let mut queryables = Vec::with_capacity(KEYS.len());
    for (topic, decode) in KEYS {
        let (commands, replies) = (commands.clone(), replies.clone());
        let queryable = session
            .declare_queryable(Key::of_plant(structure, topic).to_string())
            .complete(true)
            .callback(move |query| take(query, decode, &commands, &replies));
        queryables.push(queryable.await?);
    }
    Ok(queryables)
}

fn take(
    query: Query,
    decode: Decode,
    commands: &std_mpsc::SyncSender<PendingCommand>,
    replies: &mpsc::Sender<CommandReply>,
) {
    let payload = query.payload().map(|payload| payload.to_bytes().into_owned());
    let (query, reason) = match decode(&payload.unwrap_or_default()) {
        Ok(command) => match commands.try_send(PendingCommand { command, query }) {
            Ok(()) => return,
            Err(TrySendError::Full(full)) => (full.query, "too many commands are waiting".into()),
            Err(TrySendError::Disconnected(late)) => (late.query, "the plant is ending".into()),
        },
        Err(error) => (query, error.to_string()),
    };
    // A full queue leaves the query without a reply, which a client does not take for consent.
    let _ = replies.try_send(CommandReply { outcome: Err(reason), query });
}

/// Sends replies, one after the other.
pub(crate) async fn reply(mut replies: mpsc::Receiver<CommandReply>) {
    while let Some(CommandReply { outcome, query }) = replies.recv().await {
        let sent = match outcome {
            Ok(bytes) => {
                let key = query.key_expr().clone();
                query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).await
            }
            Err(reason) => match vocabulary::encode(&Refused { reason }) {
                Ok(bytes) => query.reply_err(bytes).encoding(Encoding::APPLICATION_JSON).await,
                Err(error) => Err(error.into()),
            },
        };
        if let Err(error) = sent {
            tracing::debug!("reply to a command not sent: {error}");
        }
    }
}
