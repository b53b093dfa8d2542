//! The name of who issues a command.

use vocabulary::OperatorName;

use crate::failure::Failure;

/// The name that is recorded: that of the operator whose certificate is shown, else the one that was given, else
/// `USER@HOST`.
pub(crate) fn name(by: Option<&str>, operator: Option<&OperatorName>) -> Result<String, Failure> {
    if let (Some(by), Some(operator)) = (by, operator)
        && by != operator.as_str()
    {
        return Err(Failure::usage(format!(
            "--by {by}: the certificate is that of `{operator}`, whose name is recorded; leave --by out, or \
             show the certificate of `{by}`"
        )));
    }
    let shown = operator.map(ToString::to_string);
    let by = shown.or_else(|| by.map(str::to_owned)).or_else(from_environment);
    by.ok_or_else(|| Failure::usage("the issuer is unknown; use --by WHO"))
}

/// `USER@HOST` from the environment; `None` if it names no user.
fn from_environment() -> Option<String> {
    let variable = |name| std::env::var(name).ok().filter(|user: &String| !user.trim().is_empty());
    let user = variable("USER").or_else(|| variable("LOGNAME"))?;
    let host = nix::unistd::gethostname().ok()?;
    Some(format!("{user}@{}", host.to_string_lossy()))
}
