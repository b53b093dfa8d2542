//! `trusswatch web link`: creates a link that admits a user once.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::Duration;

use anstyle::{AnsiColor, Style};
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use web::{LinkError, PageAddress, PersonName};

use crate::failure::Failure;
use crate::output;

/// Make a link with which a person signs in to the page once
///
/// Prints the link; send it to the person over a private channel, or have a phone read the QR code from the terminal.
/// Run this on the computer of `trusswatch web`, as
/// root or as the user that runs it. The journals record the person's name with every command.
#[derive(Debug, clap::Args)]
pub(super) struct OneTimeLinkArguments {
    /// Name of the person, recorded in the journals
    #[arg(value_name = "PERSON")]
    person: PersonName,
    /// The --state-dir of `trusswatch web`
    #[arg(long, value_name = "DIRECTORY", default_value = "/var/lib/trusswatch-web")]
    state_dir: PathBuf,
    /// Read-only access
    #[arg(long)]
    view_only: bool,
    /// Validity of the link, from 1s to 24h
    #[arg(long, value_name = "SPAN", default_value = "10m", value_parser = valid)]
    valid: Duration,
    /// Print the link as a QR code too, as on a terminal
    #[arg(long)]
    qr: bool,
    /// Address of the page in the person's browser
    #[arg(long, value_name = "ADDRESS", default_value = "http://127.0.0.1:8480")]
    address: PageAddress,
}

/// Runs `trusswatch web link`.
pub(super) fn run(arguments: &OneTimeLinkArguments) -> Result<(), Failure> {
    let OneTimeLinkArguments { person, state_dir, view_only, valid, qr, address } = arguments;
    let link = web::one_time_link(state_dir, person, !view_only, *valid)?;
    let link = format!("{address}{link}");
    let mut out = output::stdout();
    writeln!(out, "{link}")?;
    if *qr || std::io::stdout().is_terminal() {
        // Light on dark whatever the colours of the terminal are: not every camera reads an inverted code.
        let style = Style::new()
            .fg_color(Some(AnsiColor::BrightWhite.into()))
            .bg_color(Some(AnsiColor::Black.into()));
        for line in qr_code(&link).unwrap_or_default().lines() {
            writeln!(out, "{style}{line}{style:#}")?;
        }
    }
    Ok(())
}

/// The QR code of a text, two modules to a character, drawn with light on a dark ground; `None` if it is too long.
fn qr_code(text: &str) -> Option<String> {
    let code = QrCode::new(text).ok()?;
    // Named by what they draw: light modules with the foreground.
    let (light, dark) = (Dense1x2::Dark, Dense1x2::Light);
    Some(code.render::<Dense1x2>().light_color(light).dark_color(dark).build())
}

fn valid(text: &str) -> Result<Duration, String> {
    let span = humantime::parse_duration(text).ok().filter(|span| web::VALID.contains(span));
    span.ok_or_else(|| "write a time span from 1s to 24h, e.g. 10m".to_owned())
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Failure {
        match error {
            LinkError::Randomness(_) => Failure::runtime(error.to_string()),
            LinkError::Valid(_) => Failure::usage(error.to_string()),
            LinkError::Directory { .. } | LinkError::TooMany(_) => {
                Failure::input(error.to_string())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Read by another library, from the characters.
    #[test]
    fn a_phone_reads_the_link_from_the_terminal() {
        let secret = "0123456789abcdef".repeat(4);
        let link = format!("https://tower.example.org:8480/shm/sign-in?link={secret}");
        let drawn = qr_code(&link).unwrap();
        let lines: Vec<Vec<char>> = drawn.lines().map(|line| line.chars().collect()).collect();
        assert!(lines.len() < 30 && lines[0].len() < 80, "{drawn}");
        let is_light = |x: usize, y: usize| match lines[y / 2][x] {
            '█' => true,
            '▀' => y.is_multiple_of(2),
            '▄' => !y.is_multiple_of(2),
            _ => false,
        };
        const PIXELS: usize = 4;
        let (width, height) = (PIXELS * lines[0].len(), PIXELS * 2 * lines.len());
        let gray = |x, y| if is_light(x / PIXELS, y / PIXELS) { 255 } else { 0 };
        let mut image = rqrr::PreparedImage::prepare_from_greyscale(width, height, gray);
        let found = image.detect_grids();
        assert_eq!(found.len(), 1, "{drawn}");
        assert_eq!(found[0].decode().unwrap().1, link);
    }
}
