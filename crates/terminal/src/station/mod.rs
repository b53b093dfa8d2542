//! Everything that blocks: keyboard, screen, signals, network. The model alone decides what is drawn.
//!
//! | file | what |
//! |---|---|
//! | `screen` | takes over the terminal, and restores it however the process ends |
//! | `keyboard` | reads keys on a separate thread |
//! | `signals` | signals that end, suspend and continue the process |
//! | `tasks` | orders and queries, each a task |

mod keyboard;
mod screen;
mod signals;
mod tasks;

use std::fmt::Display;
use std::future::Future;
use std::io;
use std::time::Duration;

use session::client::Live;
use shell::clock::unix_ns;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};
use zenoh::Session;

use crate::ViewSettings;
use crate::model::{Model, ModelEffect};
use keyboard::KeyboardInput;
use screen::Screen;
use signals::{ProcessSignal, ProcessSignals};
use tasks::Tasks;

/// Shortest interval between drawings.
const DRAW_EVERY: Duration = Duration::from_millis(100);
/// Interval at which ages are updated.
const TICK: Duration = Duration::from_secs(1);

/// An error that ended the view.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The terminal cannot be taken over, or cannot be drawn on any more.
    #[error("the terminal cannot be used: {0}")]
    Terminal(#[from] io::Error),
    /// The keyboard cannot be read any more.
    #[error("the keyboard cannot be read: {0}")]
    Keyboard(String),
    /// A part of the program panicked; its message is printed above.
    #[error("internal error; please report it with the output above")]
    Panicked,
}

/// Shows the view until a key or a signal ends it; retries `open` until it returns a session. Always restores the
/// terminal.
///
/// # Errors
/// The terminal or the keyboard cannot be used, or a part of the program panicked.
pub async fn run<F, E>(
    settings: ViewSettings,
    open: impl Fn() -> F + Send + 'static,
) -> Result<(), ViewError>
where
    F: Future<Output = Result<Session, E>> + Send + 'static,
    E: Display + Send + 'static,
{
    let mut signals = ProcessSignals::new()?;
    let live = Live::start(open, settings.structure.clone(), settings.expected.clone());
    let mut screen = Screen::enter()?;
    let mut station = Station {
        tasks: Tasks::new(settings.timeout),
        model: Model::new(settings, unix_ns()),
        live,
    };
    let outcome = station.attend(&mut screen, &mut signals).await;
    // Restores the terminal before anything is printed.
    drop(screen);
    outcome
}

struct Station {
    model: Model,
    live: Live,
    tasks: Tasks,
}

/// How the loop continues.
enum LoopControl {
    Go,
    Quit,
    Suspend,
}

impl Station {
    async fn attend(
        &mut self,
        screen: &mut Screen,
        signals: &mut ProcessSignals,
    ) -> Result<(), ViewError> {
        let mut keys = keyboard::start()?;
        let mut scenes = self.live.scenes();
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (mut drawn, mut is_drawn) = (Instant::now(), false);
        loop {
            let next = tokio::select! {
                // Keys first, so that a flood of messages cannot prevent quitting.
                biased;
                signal = signals.next() => match signal {
                    ProcessSignal::End => return Ok(()),
                    ProcessSignal::Suspend => LoopControl::Suspend,
                    ProcessSignal::Continued => {
                        screen.enter_again()?;
                        LoopControl::Go
                    }
                },
                input = keys.recv() => match input {
                    Some(KeyboardInput::Press(key)) => self.carry_out(|model| model.on_key(key)),
                    Some(KeyboardInput::Control(letter)) => {
                        self.carry_out(|model| model.on_control(letter))
                    }
                    Some(KeyboardInput::Resized) => LoopControl::Go,
                    Some(KeyboardInput::Broken(reason)) => return Err(ViewError::Keyboard(reason)),
                    None => return Err(ViewError::Keyboard("it is closed".to_owned())),
                },
                () = sleep_until(drawn + DRAW_EVERY), if !is_drawn => {
                    if screen::has_panicked() {
                        return Err(ViewError::Panicked);
                    }
                    screen.draw(&self.model)?;
                    (drawn, is_drawn) = (Instant::now(), true);
                    continue;
                }
                Ok(()) = scenes.changed() => {
                    let scene = scenes.borrow_and_update().clone();
                    self.carry_out(|model| model.on_scene(scene, unix_ns()))
                }
                Some(answer) = self.tasks.next() => {
                    self.model.on_answer(answer);
                    LoopControl::Go
                }
                _ = ticks.tick() => self.carry_out(|model| model.on_tick(unix_ns())),
            };
            is_drawn = false;
            match next {
                LoopControl::Go => {}
                LoopControl::Quit => return Ok(()),
                LoopControl::Suspend => screen.suspend()?,
            }
        }
    }

    /// Carries out the effects that the model requests. Does not block.
    fn carry_out(&mut self, change: impl FnOnce(&mut Model) -> Vec<ModelEffect>) -> LoopControl {
        let mut next = LoopControl::Go;
        for effect in change(&mut self.model) {
            match effect {
                ModelEffect::Quit => next = LoopControl::Quit,
                ModelEffect::Suspend => next = LoopControl::Suspend,
                other => self.tasks.send(other, self.live.session()),
            }
        }
        next
    }
}
