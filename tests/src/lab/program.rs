//! The program `ip`.

use std::process::Command;

/// Runs it; its error output if it fails.
pub(super) fn ip(arguments: &[&str]) -> Result<String, String> {
    let output = Command::new("ip").args(arguments).output().map_err(|error| error.to_string())?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let words = String::from_utf8_lossy(&output.stderr).trim().to_string();
    Err(format!("`ip {}`: {words}", arguments.join(" ")))
}
