//! `trusswatch notify`: sends notifications of incidents.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use ::notify::{HttpRecipient, MailRecipient, Notify, NotifyConfig, NotifySettings};
use settings::{ConfigErrors, SettingsFile};
use shell::health::HealthFlags;
use shell::shutdown::ShutdownFlags;
use shell::{logging, runtime};
use vocabulary::ModuleName;

use crate::failure::Failure;
use crate::link::Link;
use crate::model;

/// Send notifications of incidents: by webhook, Alertmanager, mail and ntfy
///
/// Each recipient gets one message when an incident opens, one if it is not acknowledged in time, and one when it is
/// resolved; none while it is acknowledged, shelved or suppressed. A message contains kind and size of the fault, its
/// effects, its place, and a link to the page. Loss of contact with all modules is an incident too. Deliveries are recorded
/// in the state directory: after a crash at most the message being sent is repeated. Failed deliveries are retried without a
/// limit.
///
/// Recipients with a secret (a token, a password) are named in FILE, which names files with the secrets, e.g. credentials
/// of the unit.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Settings with recipients (TOML); further ones come from the flags
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Send JSON to this address; may be repeated
    #[arg(long, value_name = "URL")]
    webhook: Vec<String>,
    /// Send alerts to this Alertmanager (API version 2); acknowledged ones are silenced there; may be repeated
    #[arg(long, value_name = "URL")]
    alertmanager: Vec<String>,
    /// Send to this topic of ntfy; may be repeated
    #[arg(long, value_name = "URL")]
    ntfy: Vec<String>,
    /// Send mail to this address; may be repeated
    #[arg(long, value_name = "ADDRESS")]
    mail: Vec<String>,
    /// The server for `--mail`
    #[arg(long, value_name = "URL", default_value = "smtp://localhost:25", requires = "mail")]
    smtp: String,
    /// The sender of `--mail`
    #[arg(long, value_name = "ADDRESS", default_value = "trusswatch@localhost", requires = "mail")]
    mail_from: String,
    /// Escalate a fault that is not acknowledged within this time, e.g. `10m`
    #[arg(long, value_name = "SPAN")]
    escalate_after: Option<String>,
    /// Address of the web page, to which messages link
    #[arg(long, value_name = "URL")]
    page: Option<String>,
    /// Description of the structure (TOML): messages say where a component is, with a drawing
    #[arg(long, value_name = "FILE")]
    drawing: Option<PathBuf>,
    /// Modules that should be present
    #[arg(long, value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// A certificate of another process, such as the router: people are told 21 days before it expires, as of modules'
    /// certificates and of this process's own; may be repeated
    #[arg(long, value_name = "FILE")]
    certificate: Vec<PathBuf>,
    /// Directory of open incidents and pending notifications
    #[arg(
        long,
        value_name = "DIRECTORY",
        env = "STATE_DIRECTORY",
        default_value = "/var/lib/trusswatch-notify"
    )]
    state_dir: PathBuf,
    #[command(flatten)]
    health: HealthFlags,
    #[command(flatten)]
    shutdown: ShutdownFlags,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let notify = recipients(arguments)?;
    if notify.recipients.is_empty() {
        return Err(Failure::usage(
            "no recipients; give FILE, --webhook, --alertmanager, --ntfy or --mail",
        ));
    }
    for file in &arguments.certificate {
        pki::Certificate::read(file)
            .map_err(|error| Failure::input(format!("{}: {error}", file.display())))?;
    }
    let mut errors = ConfigErrors(Vec::new());
    let health: Option<SocketAddr> = arguments.health.address_or(None, &mut errors);
    let health = errors.or(health)?;
    let drawing = arguments.drawing.as_deref().map(model::read).transpose()?;
    logging::start();
    let target = arguments.link.target()?;
    let config = NotifyConfig {
        network: target.network().clone(),
        structure: target.structure.clone(),
        expected: arguments.expect.clone(),
        notify,
        drawing,
        state_dir: arguments.state_dir.clone(),
        health,
        timeout: target.timeout,
        certificates: arguments.certificate.clone(),
    };
    Ok(runtime::until_done(arguments.shutdown, |shutdown| ::notify::run(config, shutdown))?)
}

/// Those of the file and those of the flags.
fn recipients(arguments: &Arguments) -> Result<Notify, Failure> {
    let mut all = match &arguments.file {
        Some(file) => Notify::read(file)?,
        None => Notify::default(),
    };
    let http = |urls: &[String]| -> Vec<HttpRecipient> {
        let of = |url: &String| HttpRecipient {
            url: url.clone(),
            token_file: None,
            ca: None,
            only_escalated: false,
        };
        urls.iter().map(of).collect()
    };
    let mail = MailRecipient {
        to: arguments.mail.clone(),
        from: arguments.mail_from.clone(),
        server: arguments.smtp.clone(),
        user: None,
        password_file: None,
        only_escalated: false,
    };
    let flags = NotifySettings {
        escalate_after: arguments.escalate_after.clone(),
        page: arguments.page.clone(),
        webhook: http(&arguments.webhook),
        alertmanager: http(&arguments.alertmanager),
        ntfy: http(&arguments.ntfy),
        mail: if arguments.mail.is_empty() { Vec::new() } else { vec![mail] },
    };
    let document = SettingsFile { file: Path::new("command line").to_owned(), text: String::new() };
    let flags = Notify::of(&flags, &document, None).map_err(|e| Failure::usage(e.to_string()))?;
    all.recipients.extend(flags.recipients);
    all.escalate_after = flags.escalate_after.or(all.escalate_after);
    all.page = flags.page.or(all.page);
    Ok(all)
}
