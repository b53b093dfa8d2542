//! Recipients: from a file, from flags, or from both.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;
use settings::{ConfigErrors, SettingsFile};

/// Where systemd puts the credentials of a unit.
const CREDENTIALS: &str = "CREDENTIALS_DIRECTORY";
/// Longest secret that is read, in bytes.
const LONGEST_SECRET: u64 = 4096;
/// What a URL begins with.
const HTTP: [&str; 2] = ["http://", "https://"];
const SMTP: [&str; 2] = ["smtp://", "smtps://"];

/// The settings file.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NotifySettings {
    /// Time without acknowledgement after which a fault is escalated, e.g. `10m`.
    pub escalate_after: Option<String>,
    /// Address of the web page, to which messages link.
    pub page: Option<String>,
    /// Receivers of JSON over HTTP.
    pub webhook: Vec<HttpRecipient>,
    /// Alertmanagers, API version 2.
    pub alertmanager: Vec<HttpRecipient>,
    /// Topics of ntfy.
    pub ntfy: Vec<HttpRecipient>,
    /// Mail.
    pub mail: Vec<MailRecipient>,
}

/// A receiver over HTTP.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HttpRecipient {
    /// Its address.
    pub url: String,
    /// A file with its bearer token: a credential of the unit, or beside the settings file.
    pub token_file: Option<PathBuf>,
    /// A file with the certificates of the authorities that it is trusted by, in PEM; otherwise those of the web.
    pub ca: Option<PathBuf>,
    /// Send only escalations, and that they are resolved.
    #[serde(default)]
    pub only_escalated: bool,
}

/// Recipients of mail.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MailRecipient {
    /// Their addresses.
    pub to: Vec<String>,
    /// The sender's address.
    pub from: String,
    /// The mail server: `smtp://HOST:PORT`, with `?tls=required` after it for STARTTLS, or `smtps://HOST:PORT`.
    pub server: String,
    /// The name by which to sign in.
    pub user: Option<String>,
    /// A file with the password: a credential of the unit, or beside the settings file.
    pub password_file: Option<PathBuf>,
    /// Send only escalations, and that they are resolved.
    #[serde(default)]
    pub only_escalated: bool,
}

/// The service that reaches a recipient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Service {
    /// JSON over HTTP.
    Webhook,
    /// Alertmanager's API, version 2.
    Alertmanager,
    /// Ntfy.
    Ntfy,
    /// SMTP.
    Mail,
}

impl Service {
    /// Its name in reports and metrics.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Webhook => "webhook",
            Self::Alertmanager => "alertmanager",
            Self::Ntfy => "ntfy",
            Self::Mail => "mail",
        }
    }
}

/// A recipient, with what is needed to reach it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recipient {
    /// The service.
    pub service: Service,
    /// What identifies it in the state directory: service and address.
    pub key: String,
    /// What it is called in reports: service and host, without what may be a secret.
    pub name: String,
    /// URL, or addresses separated by commas.
    pub address: String,
    /// The mail server.
    pub server: String,
    /// The sender of mail.
    pub from: String,
    /// Name to sign in with.
    pub user: Option<String>,
    /// Bearer token or password.
    pub secret: Option<String>,
    /// Certificates in PEM.
    pub ca: Option<Vec<u8>>,
    /// See [`HttpRecipient::only_escalated`].
    pub only_escalated: bool,
}

/// What to do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Notify {
    /// Whom to tell.
    pub recipients: Vec<Recipient>,
    /// See [`NotifySettings::escalate_after`].
    pub escalate_after: Option<Duration>,
    /// See [`NotifySettings::page`].
    pub page: Option<String>,
}

impl Notify {
    /// Reads a settings file.
    ///
    /// # Errors
    /// All mistakes in it, each with its line.
    pub fn read(file: &Path) -> Result<Self, ConfigErrors> {
        let document = SettingsFile::read(file)?;
        let settings: NotifySettings = document.parse()?;
        Self::of(&settings, &document, std::env::var_os(CREDENTIALS).map(PathBuf::from).as_deref())
    }

    /// Checks settings, and reads the secrets that they name.
    ///
    /// # Errors
    /// All mistakes.
    pub fn of(
        settings: &NotifySettings,
        document: &SettingsFile,
        credentials: Option<&Path>,
    ) -> Result<Self, ConfigErrors> {
        let mut errors = ConfigErrors(Vec::new());
        let mut recipients = Vec::new();
        let reader = Reader { document, credentials };
        for (service, table, of_service) in [
            (Service::Webhook, "webhook", &settings.webhook),
            (Service::Alertmanager, "alertmanager", &settings.alertmanager),
            (Service::Ntfy, "ntfy", &settings.ntfy),
        ] {
            for http in of_service {
                recipients.extend(reader.http(service, table, http, &mut errors));
            }
        }
        for mail in &settings.mail {
            recipients.extend(reader.mail(mail, &mut errors));
        }
        let escalate_after = settings.escalate_after.as_ref().and_then(|text| {
            let span = span(text);
            errors.collect(span.map_err(|problem| {
                ConfigErrors::one(&document.file, document.line(&["escalate_after"]), problem)
            }))
        });
        let page = settings.page.clone().filter(|page| {
            let right = is_url(page, &HTTP);
            if !right {
                let problem = format!("`page` is `{page}`; write e.g. `https://tower.example.org`");
                errors.add(&document.file, document.line(&["page"]), problem);
            }
            right
        });
        for (place, recipient) in recipients.iter().enumerate() {
            if recipients[..place].iter().any(|other: &Recipient| other.key == recipient.key) {
                let problem =
                    format!("{} is given twice; name each recipient once", recipient.name);
                errors.add(&document.file, None, problem);
            }
        }
        errors.or(Self { recipients, escalate_after, page })
    }
}

/// A time span above 0.
///
/// # Errors
/// Not a time span.
fn span(text: &str) -> Result<Duration, String> {
    let span = humantime::parse_duration(text).ok().filter(|span| !span.is_zero());
    span.ok_or_else(|| format!("`{text}` is not a time span; write e.g. `10m`"))
}

fn is_url(text: &str, schemes: &[&str]) -> bool {
    let rest = schemes.iter().find_map(|scheme| text.strip_prefix(scheme));
    let host = rest.map(|rest| rest.split(['/', '?']).next().unwrap_or_default());
    host.is_some_and(|host| !host.is_empty())
        && text.is_ascii()
        && !text.contains(char::is_whitespace)
}

/// Host and port of a URL.
fn host(url: &str) -> &str {
    let rest = url.split_once("://").map_or(url, |(_, rest)| rest);
    rest.split(['/', '?']).next().unwrap_or_default()
}

/// Reads what settings name.
struct Reader<'a> {
    document: &'a SettingsFile,
    credentials: Option<&'a Path>,
}

impl Reader<'_> {
    fn http(
        &self,
        service: Service,
        table: &str,
        http: &HttpRecipient,
        errors: &mut ConfigErrors,
    ) -> Option<Recipient> {
        let url = self.url((table, "url"), &http.url, &HTTP, errors)?;
        let secret = self.secret((table, "token_file"), http.token_file.as_deref(), errors);
        let ca = self.read((table, "ca"), http.ca.as_deref(), errors);
        Some(Recipient {
            service,
            key: format!("{} {url}", service.as_str()),
            name: format!("{} {}", service.as_str(), host(&url)),
            address: url,
            server: String::new(),
            from: String::new(),
            user: None,
            secret: secret?,
            ca: ca?,
            only_escalated: http.only_escalated,
        })
    }

    fn mail(&self, mail: &MailRecipient, errors: &mut ConfigErrors) -> Option<Recipient> {
        let server = self.url(("mail", "server"), &mail.server, &SMTP, errors)?;
        let secret = self.secret(("mail", "password_file"), mail.password_file.as_deref(), errors);
        let all = mail.to.iter().chain([&mail.from]);
        let is_wrong = |address: &&String| address.parse::<lettre::Address>().is_err();
        let wrong: Vec<&String> = all.filter(is_wrong).collect();
        for address in &wrong {
            let problem =
                format!("`{address}` is not a mail address; write e.g. `ops@example.org`");
            errors.add(&self.document.file, self.document.line(&["mail"]), problem);
        }
        if mail.to.is_empty() {
            let problem = "`to` is empty; name at least one address";
            errors.add(&self.document.file, self.document.line(&["mail"]), problem);
        }
        if mail.user.is_some() != mail.password_file.is_some() {
            let problem = "`user` and `password_file` belong together; give both or none";
            errors.add(&self.document.file, self.document.line(&["mail"]), problem);
        }
        let address = mail.to.join(",");
        Some(Recipient {
            service: Service::Mail,
            key: format!("mail {address} {server}"),
            name: format!("mail {address}"),
            address,
            server,
            from: mail.from.clone(),
            user: mail.user.clone(),
            secret: secret?,
            ca: None,
            only_escalated: mail.only_escalated,
        })
        .filter(|_| wrong.is_empty())
    }

    fn url(
        &self,
        (table, key): (&str, &str),
        url: &str,
        schemes: &[&str],
        errors: &mut ConfigErrors,
    ) -> Option<String> {
        let line = self.document.line(&[table]);
        if !is_url(url, schemes) {
            let example = format!("{}example.org", schemes[schemes.len() - 1]);
            let problem = format!("`{key}` of `{table}` is `{url}`; write e.g. `{example}`");
            errors.add(&self.document.file, line, problem);
            return None;
        }
        if host(url).contains('@') {
            let problem = format!(
                "`{key}` of `{table}` contains a name or a password; name a file with the secret instead"
            );
            errors.add(&self.document.file, line, problem);
            return None;
        }
        Some(url.trim_end_matches('/').to_owned())
    }

    /// The secret in a file, if one is named; `None` if it cannot be read.
    fn secret(
        &self,
        key: (&str, &str),
        file: Option<&Path>,
        errors: &mut ConfigErrors,
    ) -> Option<Option<String>> {
        let Some(bytes) = self.read(key, file, errors)? else { return Some(None) };
        let text = String::from_utf8_lossy(&bytes).trim().to_owned();
        let is_secret = !text.is_empty() && text.chars().all(|c| !c.is_control());
        if !is_secret {
            let (table, key) = key;
            let problem = format!("`{key}` of `{table}`: the file holds no secret on one line");
            errors.add(&self.document.file, self.document.line(&[table]), problem);
        }
        is_secret.then_some(Some(text))
    }

    fn read(
        &self,
        (table, key): (&str, &str),
        file: Option<&Path>,
        errors: &mut ConfigErrors,
    ) -> Option<Option<Vec<u8>>> {
        let Some(file) = file else { return Some(None) };
        let credential = self.credentials.map(|directory| directory.join(file));
        let file = credential
            .filter(|credential| credential.is_file())
            .unwrap_or_else(|| self.document.beside(file));
        let found = std::fs::metadata(&file).and_then(|about| {
            if about.len() > LONGEST_SECRET * 256 {
                return Err(std::io::Error::other("it is too large"));
            }
            std::fs::read(&file)
        });
        found
            .map(Some)
            .map_err(|error| {
                let problem = format!("`{key}` of `{table}`: {}: {error}", file.display());
                errors.add(&self.document.file, self.document.line(&[table]), problem);
            })
            .ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, credentials: Option<&Path>) -> Result<Notify, ConfigErrors> {
        let document = SettingsFile { file: "notify.toml".into(), text: text.into() };
        Notify::of(&document.parse()?, &document, credentials)
    }

    #[test]
    fn each_recipient_has_a_key_and_a_name_without_secrets() {
        let text = "escalate_after = \"10m\"\npage = \"https://tower.example.org\"\n\
            [[webhook]]\nurl = \"https://example.org/hooks/s3cret/\"\n\
            [[ntfy]]\nurl = \"http://127.0.0.1:80/topic\"\nonly_escalated = true\n\
            [[mail]]\nto = [\"ada@example.org\", \"bob@example.org\"]\nfrom = \"tower@example.org\"\nserver = \"smtp://mail.example.org:25\"\n";
        let notify = read(text, None).unwrap();
        let names: Vec<&str> = notify.recipients.iter().map(|one| one.name.as_str()).collect();
        assert_eq!(
            names,
            ["webhook example.org", "ntfy 127.0.0.1:80", "mail ada@example.org,bob@example.org"]
        );
        assert_eq!(notify.recipients[0].key, "webhook https://example.org/hooks/s3cret");
        assert_eq!(notify.escalate_after, Some(Duration::from_secs(600)));
        assert!(notify.recipients[1].only_escalated);
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        for (text, words) in [
            ("escalate_after = \"soon\"", "notify.toml:1: `soon` is not a time span"),
            (
                "[[webhook]]\nurl = \"example.org\"",
                "notify.toml:1: `url` of `webhook` is `example.org`",
            ),
            ("[[ntfy]]\nurl = \"https://ada:pw@example.org/x\"", "contains a name or a password"),
            (
                "[[webhook]]\nurl = \"http://x\"\ntoken_file = \"missing\"",
                "`token_file` of `webhook`: missing: ",
            ),
            (
                "[[mail]]\nto = [\"ada\"]\nfrom = \"t@x.org\"\nserver = \"smtp://x\"",
                "`ada` is not a mail address",
            ),
            ("[[mail]]\nto = []\nfrom = \"t@x.org\"\nserver = \"smtp://x\"", "`to` is empty"),
            (
                "[[mail]]\nto = [\"a@x.org\"]\nfrom = \"t@x.org\"\nserver = \"http://x\"",
                "`server` of `mail`",
            ),
            (
                "[[mail]]\nto = [\"a@x.org\"]\nfrom = \"t@x.org\"\nserver = \"smtp://x\"\nuser = \"t\"",
                "belong together",
            ),
            ("[[webhook]]\nurl = \"http://x\"\n[[webhook]]\nurl = \"http://x/\"", "given twice"),
            ("[[hook]]\nurl = \"http://x\"", "unknown field `hook`"),
        ] {
            let error = read(text, None).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn secrets_come_from_credentials_or_from_beside_the_file() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("token"), "s3cret\n").unwrap();
        let text = "[[webhook]]\nurl = \"http://x\"\ntoken_file = \"token\"\n";
        let notify = read(text, Some(directory.path())).unwrap();
        assert_eq!(notify.recipients[0].secret.as_deref(), Some("s3cret"));
        std::fs::write(directory.path().join("token"), "\n").unwrap();
        let error = read(text, Some(directory.path())).unwrap_err().to_string();
        assert!(error.contains("no secret"), "{error}");
    }
}
