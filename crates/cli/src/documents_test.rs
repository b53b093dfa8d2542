//! Tests that the program accepts every command line printed in a document.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use clap::error::ErrorKind;

use crate::command_line::CommandLine;

/// Folders with documents, from the workspace's root.
const FOLDERS: [&str; 13] = [
    ".",
    "configs",
    "crates",
    "crates/cli/walkthrough",
    "crates/diagnosis",
    "crates/pki",
    "crates/study",
    "crates/vocabulary",
    "deploy",
    "deploy/compose",
    "deploy/debian",
    "deploy/systemd",
    "tests",
];

fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let files = FOLDERS.iter().flat_map(|folder| fs::read_dir(root.join(folder)).unwrap());
    let paths = files.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

/// Commands typed in full, from fenced blocks, and those named in running text, with placeholders.
fn commands(text: &str) -> (Vec<String>, Vec<String>) {
    let (mut typed, mut named) = (Vec::new(), Vec::new());
    let text = text.replace("\\\n", " ");
    for (number, part) in text.split("\n```").enumerate() {
        if number % 2 == 1 {
            let lines = part.lines().skip(1).filter(|_| part.starts_with("sh\n"));
            typed.extend(lines.flat_map(|line| line.split("&&")).map(ToOwned::to_owned));
            let prompts = part.lines().filter_map(|line| line.strip_prefix("$ "));
            typed.extend(prompts.map(ToOwned::to_owned));
        } else {
            let spans = part.split('`').skip(1).step_by(2);
            named.extend(spans.map(|span| span.replace('\n', " ")));
        }
    }
    let ours = |line: &String| arguments(line).first().is_some_and(|word| word == "trusswatch");
    (typed.into_iter().filter(ours).collect(), named.into_iter().filter(ours).collect())
}

/// The words of a command up to a redirection, quotes taken off.
fn arguments(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for letter in line.trim().replace("./target/release/", "").replace(":PORT", ":7447").chars() {
        match letter {
            '"' => quoted = !quoted,
            '>' | '|' | '&' | '#' if !quoted => break,
            ' ' if !quoted => words.push(String::new()),
            letter => words.last_mut().unwrap().push(letter),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn every_command_of_a_document_is_one_that_the_program_takes() {
    let mut seen = 0;
    for document in documents() {
        let text = fs::read_to_string(&document).unwrap();
        let (typed, named) = commands(&text);
        seen += typed.len() + named.len();
        for line in typed {
            if let Err(error) = CommandLine::try_parse_from(arguments(&line)) {
                panic!("{}: `{line}`: {error}", document.display());
            }
        }
        for line in named {
            let words: Vec<String> =
                arguments(&line).iter().map(|word| word.replace(['…', ','], "")).collect();
            let unknown = [ErrorKind::UnknownArgument, ErrorKind::InvalidSubcommand];
            if let Err(error) = CommandLine::try_parse_from(words)
                && unknown.contains(&error.kind())
            {
                panic!("{}: `{line}`: {error}", document.display());
            }
        }
    }
    assert!(seen > 50, "only {seen} commands in the documents");
}

/// `a/{b,c}` as `a/b`, `a/c`.
fn alternatives(path: &str) -> Vec<String> {
    let Some((before, (inside, after))) =
        path.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)))
    else {
        return vec![path.to_owned()];
    };
    let one = |part: &str| alternatives(&format!("{before}{part}{after}"));
    inside.split(',').flat_map(one).collect()
}

#[test]
fn the_files_that_prove_a_claim_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let text = fs::read_to_string(root.join("tests/README.md")).unwrap();
    let is_path = |span: &&str| span.contains('/') && !span.contains([' ', '<', '=']);
    let places = ["", "tests", "tests/tests"];
    let named = text.lines().filter(|line| line.starts_with('|'));
    let named = named.flat_map(|line| line.split('`').skip(1).step_by(2)).filter(is_path);
    let named: Vec<String> = named.flat_map(alternatives).collect();
    assert!(named.len() > 50, "{named:?}");
    for path in named {
        let exists = places.iter().any(|place| root.join(place).join(&path).exists());
        assert!(exists, "tests/README.md names `{path}`, which does not exist");
    }
}
