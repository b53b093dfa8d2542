//! The command line: subcommands and what they take.

use clap::{Parser, Subcommand};

use crate::failure::EXIT_CODES;
use crate::{
    calibrate, certificates, check, demo, detect, faults, follow, generate, health, history,
    inject, join, model, order, repeat, router, schema, study,
};

/// Distributed fault diagnosis of adaptive structures.
#[derive(Debug, Parser)]
#[command(
    name = "trusswatch",
    version,
    max_term_width = 100,
    arg_required_else_help = true,
    after_help = EXIT_CODES
)]
pub(crate) struct CommandLine {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Model(model::Arguments),
    Detect(detect::Arguments),
    Demo(demo::Arguments),
    Calibrate(calibrate::Arguments),
    Check(check::Arguments),
    Faults(faults::Arguments),
    Follow(follow::Arguments),
    #[command(visible_alias = "acknowledge")]
    Ack(order::AcknowledgeArguments),
    Reset(order::ResetArguments),
    #[command(hide = true)]
    Generate(generate::Arguments),
    Health(health::Arguments),
    History(history::Arguments),
    Inject(inject::Arguments),
    Study(Box<study::Arguments>),
    Repeat(repeat::Arguments),
    Pki(certificates::Arguments),
    Join(join::Arguments),
    Router(router::Arguments),
    Schema(schema::Arguments),
}
