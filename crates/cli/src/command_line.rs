//! The command line: subcommands and their arguments.

use clap::{CommandFactory, Parser, Subcommand};

use crate::failure::EXIT_CODES;
use crate::{
    calibrate, certificates, check, commission, demo, detect, export, fault, faults, follow,
    generate, health, history, import, inject, join, learn, model, new, notify, order, record,
    replay, replicate, router, schema, simulate, stroke, study, watch, web,
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
    pub(crate) command: TopCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum TopCommand {
    Faults(faults::Arguments),
    Fault(fault::Arguments),
    Follow(follow::Arguments),
    Watch(watch::Arguments),
    #[command(visible_alias = "acknowledge")]
    Ack(order::AcknowledgeArguments),
    Reset(order::ResetArguments),
    History(history::Arguments),
    Health(health::Arguments),
    Router(router::Arguments),
    Record(Box<record::Arguments>),
    Web(Box<web::Arguments>),
    Notify(Box<notify::Arguments>),
    Check(check::Arguments),
    Model(model::Arguments),
    New(new::Arguments),
    Pki(certificates::Arguments),
    Join(join::Arguments),
    Replicate(replicate::Arguments),
    Schema(schema::Arguments),
    Completions(generate::CompletionsArguments),
    Demo(demo::Arguments),
    Inject(inject::Arguments),
    Stroke(stroke::Arguments),
    Simulate(simulate::Arguments),
    Study(Box<study::Arguments>),
    Replay(Box<replay::Arguments>),
    Export(export::Arguments),
    Import(import::Arguments),
    Learn(learn::Arguments),
    Detect(detect::Arguments),
    Calibrate(calibrate::Arguments),
    Commission(Box<commission::Arguments>),
    #[command(hide = true)]
    Generate(generate::Arguments),
}

/// The subcommands, grouped by type of user.
const GROUPS: [(&str, &[&str]); 4] = [
    (
        "Operate",
        &[
            "faults", "fault", "follow", "watch", "web", "ack", "reset", "history", "health",
            "router", "record", "notify",
        ],
    ),
    ("Configure", &["new", "check", "model", "pki", "join", "replicate", "schema", "completions"]),
    ("Simulate", &["demo", "inject", "stroke", "simulate"]),
    (
        "Analyse",
        &["replay", "export", "study", "import", "learn", "detect", "calibrate", "commission"],
    ),
];

/// The command line with its subcommands grouped in the help.
pub(crate) fn command() -> clap::Command {
    let command = CommandLine::command();
    let groups: Vec<String> = GROUPS.iter().map(|group| listed(&command, group)).collect();
    let template = format!(
        "{{about}}\n\n{{usage-heading}} {{usage}}\n\n{}\nOptions:\n{{options}}{{after-help}}",
        groups.join("\n")
    );
    command.help_template(template)
}

fn listed(command: &clap::Command, (heading, names): &(&str, &[&str])) -> String {
    let line = |name: &&str| {
        let about = command.find_subcommand(name).and_then(clap::Command::get_about);
        format!("  {name:<12} {}\n", about.map_or_else(String::new, ToString::to_string))
    };
    format!("{heading}:\n{}", names.iter().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_visible_subcommand_is_in_one_group() {
        let command = CommandLine::command();
        let visible = command.get_subcommands().filter(|sub| !sub.is_hide_set());
        let mut visible: Vec<&str> = visible.map(clap::Command::get_name).collect();
        let mut grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        visible.sort_unstable();
        grouped.sort_unstable();
        assert_eq!(visible, grouped);
    }

    #[test]
    fn the_help_names_groups_subcommands_and_exit_codes() {
        let help = command().render_help().to_string();
        for text in
            ["Operate:\n", "Analyse:\n", "  faults       Show present", "Exit codes", "--version"]
        {
            assert!(help.contains(text), "{text} is not in {help}");
        }
    }
}
