//! Sends one notification to one recipient, as its service expects it, over HTTP or SMTP. Blocking.

use std::time::Duration;

use lettre::message::{Attachment, Mailbox, MultiPart, SinglePart, header::ContentType};
use lettre::transport::smtp::authentication::Credentials;
use lettre::{Message, SmtpTransport, Transport};
use observer::calls::{Call, CalledIncident, Occasion, OpenIncident, Severity};
use serde_json::{Value, json};
use truss::Structure;
use ureq::Agent;
use ureq::tls::{Certificate, PemItem, RootCerts, TlsConfig, parse_pem};
use vocabulary::words::utc;

use crate::settings::{Recipient, Service};

/// Longest time for one message.
const WITHIN: Duration = Duration::from_secs(10);
/// Longest part of an answer that is shown, in bytes.
const SHOWN: u64 = 300;
/// For how long Alertmanager holds an alert for active unless it hears of it again; twice the time between reminders.
const ACTIVE_FOR_NS: u64 = 150_000_000_000;
/// End of a silence that lasts until it is taken back \[ns\].
const SILENT_FOR_NS: u64 = 30 * 86_400_000_000_000;
/// Label that Alertmanager identifies an incident by.
const INCIDENT: &str = "incident";
/// Who silences.
const AUTHOR: &str = "trusswatch";

/// Why a notification was not delivered.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TellError {
    /// It may work later.
    #[error("{0}")]
    Later(String),
    /// The recipient says that the message is wrong, so that repeating it is of no use.
    #[error("{0}")]
    Refused(String),
}

/// What messages say beside the incident.
#[derive(Debug, Clone, Default)]
pub struct MessageContext {
    /// The described structure.
    pub structure: Option<Structure>,
    /// Address of the web page.
    pub page: Option<String>,
}

impl MessageContext {
    /// Where the component is, in words.
    fn place(&self, incident: &CalledIncident) -> Option<String> {
        let structure = self.structure_of(incident)?;
        Some(structure.place_of(incident.component.as_ref()?)?.to_string())
    }

    fn drawing(&self, incident: &CalledIncident) -> Option<String> {
        let structure = self.structure_of(incident)?;
        let component = incident.component.as_ref()?;
        structure.place_of(component)?;
        Some(figure::structure::drawing_of_one(structure, component))
    }

    fn structure_of(&self, incident: &CalledIncident) -> Option<&Structure> {
        self.structure.as_ref().filter(|known| incident.structure.as_ref() == Some(&known.name))
    }

    fn link(&self, incident: &CalledIncident) -> Option<String> {
        let page = self.page.as_ref()?.trim_end_matches('/');
        Some(match (&incident.component, &incident.module) {
            (Some(component), _) => format!("{page}/component/{component}"),
            (None, Some(module)) => format!("{page}/module/{module}"),
            (None, None) => format!("{page}/"),
        })
    }
}

/// The message as JSON: what webhooks get.
#[must_use]
pub fn document(call: &Call, around: &MessageContext) -> Value {
    let incident = &call.incident;
    json!({
        "v": vocabulary::VERSION,
        "call": call.occasion.as_str(),
        "number": call.number,
        "title": headline(call),
        "incident": incident,
        "since": utc(incident.since_unix_ns),
        "time": utc(call.time_unix_ns),
        "place": around.place(incident),
        "link": around.link(incident),
        "drawing": around.drawing(incident),
    })
}

/// In one line: what it is about, and what happened to it.
#[must_use]
pub fn headline(call: &Call) -> String {
    let title = call.incident.title();
    match call.occasion {
        Occasion::Opened => title,
        Occasion::Escalated => format!("NOT ACKNOWLEDGED: {title}"),
        Occasion::Returned => format!("AGAIN: {title}"),
        Occasion::Quieted => format!("acknowledged: {title}"),
        Occasion::Resolved => format!("resolved: {title}"),
    }
}

/// The message as lines of text.
#[must_use]
pub fn text(call: &Call, around: &MessageContext) -> String {
    let incident = &call.incident;
    let said = |name: &str, words: &str| (!words.is_empty()).then(|| format!("{name}: {words}"));
    let lines = [
        Some(headline(call)),
        Some(format!("state: {}", incident.state)),
        said("why", &incident.why),
        said("with it", &incident.extent),
        around.place(incident).map(|place| format!("where: {place}")),
        Some(format!("since: {}", utc(incident.since_unix_ns))),
        incident.structure.as_ref().map(|name| format!("structure: {name}")),
        around.link(incident),
        Some(format!("incident: {}", incident.id)),
    ];
    lines.into_iter().flatten().collect::<Vec<_>>().join("\n") + "\n"
}

/// Sends a notification.
///
/// # Errors
/// It was not delivered.
pub fn tell(recipient: &Recipient, call: &Call, around: &MessageContext) -> Result<(), TellError> {
    if recipient.only_escalated && matches!(call.occasion, Occasion::Opened | Occasion::Returned) {
        return Ok(());
    }
    match recipient.service {
        Service::Alertmanager => alertmanager(recipient, call, around),
        _ if call.occasion == Occasion::Quieted => Ok(()),
        Service::Webhook => {
            Http::of(recipient)?.post("", &document(call, around).to_string(), &JSON).map(drop)
        }
        Service::Ntfy => ntfy(recipient, call, around),
        Service::Mail => mail(recipient, call, around),
    }
}

/// Sends all active alerts to an Alertmanager again, which resolves an alert that it does not hear of.
///
/// # Errors
/// They were not delivered.
pub fn remind<'a>(
    recipient: &Recipient,
    open: impl Iterator<Item = &'a OpenIncident>,
    now_unix_ns: u64,
    around: &MessageContext,
) -> Result<(), TellError> {
    let alert = |open: &OpenIncident| {
        let end = now_unix_ns + ACTIVE_FOR_NS;
        alert(&open.incident, end, around)
    };
    let alerts: Vec<Value> = open.filter(|open| open.is_called()).map(alert).collect();
    if alerts.is_empty() {
        return Ok(());
    }
    Http::of(recipient)?.post(ALERTS, &Value::from(alerts).to_string(), &JSON).map(drop)
}

const JSON: [(&str, &str); 1] = [("Content-Type", "application/json")];
const ALERTS: &str = "/api/v2/alerts";
const SILENCES: &str = "/api/v2/silences";

fn alertmanager(
    recipient: &Recipient,
    call: &Call,
    around: &MessageContext,
) -> Result<(), TellError> {
    let (http, incident) = (Http::of(recipient)?, &call.incident);
    if recipient.only_escalated && call.occasion == Occasion::Quieted {
        return Ok(());
    }
    match call.occasion {
        Occasion::Quieted => silence(&http, call),
        Occasion::Opened | Occasion::Escalated | Occasion::Returned | Occasion::Resolved => {
            if matches!(call.occasion, Occasion::Returned | Occasion::Resolved) {
                end_silences(&http, incident)?;
            }
            let end = match call.occasion {
                Occasion::Resolved => call.time_unix_ns,
                _ => call.time_unix_ns + ACTIVE_FOR_NS,
            };
            let alerts = Value::from(vec![alert(incident, end, around)]).to_string();
            http.post(ALERTS, &alerts, &JSON).map(drop)
        }
    }
}

fn alert(incident: &CalledIncident, end_unix_ns: u64, around: &MessageContext) -> Value {
    let name = match (&incident.component, &incident.module) {
        (Some(_), _) if incident.severity == Severity::Critical => "TrusswatchFault",
        (Some(_), _) => "TrusswatchPossibleFault",
        (None, Some(_)) => "TrusswatchModule",
        (None, None) => "TrusswatchMonitoring",
    };
    let text = |value: &Option<String>| value.clone().unwrap_or_default();
    let description = [incident.why.as_str(), &incident.extent];
    let description = description.into_iter().filter(|part| !part.is_empty());
    let description = description.collect::<Vec<_>>().join("; ");
    json!({
        "labels": {
            "alertname": name,
            INCIDENT: incident.id,
            "severity": incident.severity.as_str(),
            "structure": incident.structure.as_ref().map(ToString::to_string).unwrap_or_default(),
            "module": incident.module.as_ref().map(ToString::to_string).unwrap_or_default(),
            "component": incident.component.as_ref().map(ToString::to_string).unwrap_or_default(),
        },
        "annotations": {
            "summary": incident.title(),
            "description": description,
            "place": text(&around.place(incident)),
        },
        "startsAt": utc(incident.since_unix_ns),
        "endsAt": utc(end_unix_ns),
        "generatorURL": text(&around.link(incident)),
    })
}

fn silence(http: &Http, call: &Call) -> Result<(), TellError> {
    let incident = &call.incident;
    let silence = json!({
        "matchers": [{ "name": INCIDENT, "value": incident.id, "isRegex": false, "isEqual": true }],
        "startsAt": utc(call.time_unix_ns),
        "endsAt": utc(call.time_unix_ns + SILENT_FOR_NS),
        "createdBy": AUTHOR,
        "comment": format!("{}: {}", incident.state, incident.why),
    });
    end_silences(http, incident)?;
    http.post(SILENCES, &silence.to_string(), &JSON).map(drop)
}

/// Ends the silences of an incident that were made here.
fn end_silences(http: &Http, incident: &CalledIncident) -> Result<(), TellError> {
    let answer = http.get(SILENCES)?;
    let silences: Vec<Value> = serde_json::from_str(&answer).map_err(|error| {
        TellError::Later(format!("its list of silences cannot be read: {error}"))
    })?;
    let is_own = |silence: &&Value| {
        silence["createdBy"] == AUTHOR
            && silence["status"]["state"] != "expired"
            && silence["matchers"].as_array().is_some_and(|matchers| {
                matchers.iter().any(|m| m["name"] == INCIDENT && m["value"] == incident.id)
            })
    };
    for silence in silences.iter().filter(is_own) {
        if let Some(id) = silence["id"].as_str() {
            http.delete(&format!("/api/v2/silence/{id}"))?;
        }
    }
    Ok(())
}

fn ntfy(recipient: &Recipient, call: &Call, around: &MessageContext) -> Result<(), TellError> {
    let (priority, tag) = match (call.occasion, call.incident.severity) {
        (Occasion::Escalated, _) => ("5", "rotating_light"),
        (Occasion::Resolved, _) => ("3", "white_check_mark"),
        (_, Severity::Critical) => ("5", "rotating_light"),
        (_, Severity::Warning) => ("4", "warning"),
    };
    // A header holds ASCII; what is beyond is written as RFC 2047 has it.
    let title = encoded_word(&headline(call));
    let link = around.link(&call.incident);
    let mut headers = vec![("Title", title.as_str()), ("Priority", priority), ("Tags", tag)];
    headers.extend(link.as_deref().map(|link| ("Click", link)));
    Http::of(recipient)?.post("", &text(call, around), &headers).map(drop)
}

fn encoded_word(text: &str) -> String {
    if text.is_ascii() {
        return text.to_owned();
    }
    use std::fmt::Write;
    let mut word = String::from("=?UTF-8?Q?");
    for byte in text.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' => word.push(char::from(byte)),
            b' ' => word.push('_'),
            other => {
                // Writing to a string does not fail.
                let _ = write!(word, "={other:02X}");
            }
        }
    }
    word + "?="
}

fn mail(recipient: &Recipient, call: &Call, around: &MessageContext) -> Result<(), TellError> {
    let refused = |error: &dyn std::fmt::Display| TellError::Refused(error.to_string());
    let mailbox = |text: &str| text.parse::<Mailbox>().map_err(|error| refused(&error));
    let incident = &call.incident;
    let host = recipient.from.split_once('@').map_or("localhost", |(_, host)| host);
    // The same incident and call have the same identifier, so that a repeated message is known as one.
    let thread: String =
        incident.id.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '.' }).collect();
    let id = |number: &str| format!("<{thread}.{number}@{host}>");
    let own = id(&call.number.to_string());
    let mut message = Message::builder()
        .from(mailbox(&recipient.from)?)
        .subject(headline(call))
        .message_id(Some(own));
    if call.occasion != Occasion::Opened {
        message = message.references(id("incident")).in_reply_to(id("incident"));
    }
    for to in recipient.address.split(',') {
        message = message.to(mailbox(to)?);
    }
    let text = SinglePart::plain(text(call, around));
    let body = match around.drawing(incident) {
        Some(drawing) => {
            let kind = ContentType::parse("image/svg+xml").map_err(|error| refused(&error))?;
            let drawing = Attachment::new("place.svg".to_owned()).body(drawing, kind);
            MultiPart::mixed().singlepart(text).singlepart(drawing)
        }
        None => MultiPart::mixed().singlepart(text),
    };
    let message = message.multipart(body).map_err(|error| refused(&error))?;
    let later = |error: lettre::transport::smtp::Error| match error.is_permanent() {
        true => TellError::Refused(error.to_string()),
        false => TellError::Later(error.to_string()),
    };
    let mut server =
        SmtpTransport::from_url(&recipient.server).map_err(later)?.timeout(Some(WITHIN));
    if let (Some(user), Some(password)) = (&recipient.user, &recipient.secret) {
        server = server.credentials(Credentials::new(user.clone(), password.clone()));
    }
    server.build().send(&message).map(drop).map_err(later)
}

/// Requests to one address.
struct Http {
    agent: Agent,
    url: String,
    token: Option<String>,
}

impl Http {
    fn of(recipient: &Recipient) -> Result<Self, TellError> {
        let mut tls = TlsConfig::builder();
        if let Some(ca) = &recipient.ca {
            let certificates: Vec<Certificate<'static>> = parse_pem(ca)
                .filter_map(|item| match item {
                    Ok(PemItem::Certificate(certificate)) => Some(certificate),
                    _ => None,
                })
                .collect();
            tls = tls.root_certs(RootCerts::from(certificates));
        }
        let agent = Agent::config_builder()
            .timeout_global(Some(WITHIN))
            .http_status_as_error(false)
            .max_redirects(0)
            .user_agent("trusswatch")
            .tls_config(tls.build())
            .build();
        let (url, token) = (recipient.address.clone(), recipient.secret.clone());
        Ok(Self { agent: agent.into(), url, token })
    }

    fn post(&self, path: &str, body: &str, headers: &[(&str, &str)]) -> Result<String, TellError> {
        let mut request = self.agent.post(format!("{}{path}", self.url));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        if let Some(bearer) = self.bearer() {
            request = request.header("Authorization", bearer);
        }
        answer(request.send(body))
    }

    fn get(&self, path: &str) -> Result<String, TellError> {
        let mut request = self.agent.get(format!("{}{path}", self.url));
        if let Some(bearer) = self.bearer() {
            request = request.header("Authorization", bearer);
        }
        answer(request.call())
    }

    fn delete(&self, path: &str) -> Result<String, TellError> {
        let mut request = self.agent.delete(format!("{}{path}", self.url));
        if let Some(bearer) = self.bearer() {
            request = request.header("Authorization", bearer);
        }
        answer(request.call())
    }

    fn bearer(&self) -> Option<String> {
        self.token.as_ref().map(|token| format!("Bearer {token}"))
    }
}

/// The body of a successful answer.
fn answer(
    answer: Result<ureq::http::Response<ureq::Body>, ureq::Error>,
) -> Result<String, TellError> {
    let mut answer = answer.map_err(|error| TellError::Later(error.to_string()))?;
    let status = answer.status();
    if status.is_success() {
        return answer
            .body_mut()
            .with_config()
            .limit(16 << 20)
            .read_to_string()
            .map_err(|error| TellError::Later(error.to_string()));
    }
    let body = answer.body_mut().with_config().limit(SHOWN).read_to_string().unwrap_or_default();
    let words = vocabulary::printable(&format!("it answers {status}: {}", body.trim()));
    // The service may be overloaded, being restarted, or not set up yet; only a message that cannot be read stays so.
    Err(match status.as_u16() {
        400 | 413 | 422 => TellError::Refused(words),
        _ => TellError::Later(words),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn call(occasion: Occasion) -> Call {
        let incident = CalledIncident {
            id: "tower/module1/sensor/g1@4-17".to_owned(),
            severity: Severity::Critical,
            structure: Some("tower".parse().unwrap()),
            module: Some("module1".parse().unwrap()),
            component: Some("module1/sensor/g1".parse().unwrap()),
            name: "module1/sensor/g1".to_owned(),
            state: "latched".to_owned(),
            kind: "bias of +45.1 µm".to_owned(),
            extent: "2 effects".to_owned(),
            why: "changed at step 17".to_owned(),
            since_unix_ns: 1_000_000_000,
        };
        Call { number: 7, occasion, incident, time_unix_ns: 2_000_000_000 }
    }

    fn around() -> MessageContext {
        let structure = Structure::from_toml(include_str!("../../../configs/tower.toml")).unwrap();
        MessageContext {
            structure: Some(structure),
            page: Some("https://tower.example.org/".to_owned()),
        }
    }

    #[test]
    fn a_message_says_what_where_and_since_when() {
        let text = text(&call(Occasion::Opened), &around());
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "module1/sensor/g1: bias of +45.1 µm");
        for part in [
            "why: changed at step 17",
            "since: 1970-01-01T00:00:01",
            "/component/module1/sensor/g1",
            "@4-17",
        ] {
            assert!(text.contains(part), "{text}");
        }
        assert_eq!(lines[3], "with it: 2 effects");
        assert!(lines[4].starts_with("where: level "), "{text}");
        let document = document(&call(Occasion::Resolved), &around());
        assert_eq!(
            (&document["call"], &document["incident"]["id"]),
            (&json!("resolved"), &json!("tower/module1/sensor/g1@4-17"))
        );
        assert!(document["drawing"].as_str().unwrap().starts_with("<svg"));
    }

    #[test]
    fn another_structure_has_no_place_in_this_one() {
        let mut other = call(Occasion::Escalated);
        other.incident.structure = Some("mast".parse().unwrap());
        let document = document(&other, &around());
        assert!(document["place"].is_null() && document["drawing"].is_null());
        assert!(document["title"].as_str().unwrap().starts_with("NOT ACKNOWLEDGED: "));
    }

    #[test]
    fn a_title_beyond_ascii_is_an_encoded_word() {
        assert_eq!(encoded_word("bias of 3 um"), "bias of 3 um");
        assert_eq!(encoded_word("3 µm"), "=?UTF-8?Q?3_=C2=B5m?=");
    }
}
