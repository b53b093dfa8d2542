//! Unauthorised clients: connection attempts without valid credentials.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pki::{Authority, Holder, Identity, Lifetime};
use time::{Duration as Span, OffsetDateTime};
use zenoh::Config;

use super::stand::Stand;

/// An unauthorised client that is not connected by then is refused, or the machine is too busy to say so: then it tries
/// again.
const TIMEOUT_MS: u64 = 2500;
/// Longer for an authorised one, also on a busy machine.
const RIGHT_MS: u64 = 30_000;
/// An opened session alone is no access: an authorised client receives liveliness tokens of modules.
const LISTENING: Duration = Duration::from_secs(30);

/// The credentials presented.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Papers {
    /// Those of a module, as they should be.
    Right,
    /// The same name, signed by another authority.
    WrongAuthority,
    /// None.
    Missing,
    /// Those of a module whose time is over.
    Expired,
    /// None, over plain TCP.
    PlainTcp,
}

impl Papers {
    /// Tries to connect; whether anything was received.
    pub async fn knock(self, stand: &Stand) -> bool {
        let mut settings = self.settings(stand);
        let timeout_ms = if self == Papers::Right { RIGHT_MS } else { TIMEOUT_MS };
        insert(&mut settings, "connect/timeout_ms", &timeout_ms.to_string());
        insert(&mut settings, "connect/exit_on_failure", "true");
        let Ok(session) = zenoh::open(settings).await else { return false };
        let tokens = session.liveliness().get("trusswatch/*/*/alive").timeout(LISTENING);
        let heard = match tokens.await {
            Ok(tokens) => tokens.recv_async().await.is_ok_and(|token| token.result().is_ok()),
            Err(_) => false,
        };
        // A refused client has nothing to close.
        let _ = session.close().await;
        heard
    }

    fn settings(self, stand: &Stand) -> Config {
        let mut settings = stand.settings("module1");
        match self {
            Papers::Right => {}
            Papers::WrongAuthority => {
                let library = stand.library.join("elsewhere");
                let authority =
                    Authority::create(&library, "tower".parse().unwrap(), Lifetime::of_days(2));
                let forged = issue(&authority.unwrap(), &library, Lifetime::of_days(2));
                show(&mut settings, &forged);
            }
            Papers::Missing => insert(&mut settings, "transport/link/tls/enable_mtls", "false"),
            Papers::Expired => {
                let now = OffsetDateTime::now_utc();
                let past = Lifetime { from: now - Span::minutes(9), until: now - Span::minutes(1) };
                let authority = Authority::open(&stand.library).unwrap();
                let expired = issue(&authority, &stand.library.join("expired"), past);
                show(&mut settings, &expired);
            }
            Papers::PlainTcp => {
                let endpoint = stand.door_of("module1").replace("tls/", "tcp/");
                insert(&mut settings, "transport/link/protocols", "[\"tcp\"]");
                insert(&mut settings, "connect/endpoints", &format!("[\"{endpoint}\"]"));
            }
        }
        settings
    }
}

fn issue(authority: &Authority, library: &Path, lifetime: Lifetime) -> Identity {
    let holder: Holder = "module1".parse().unwrap();
    authority.issue(&library.join("module1"), holder, &[], lifetime).unwrap()
}

/// Presents these credentials; the router's certificate is still trusted.
fn show(settings: &mut Config, papers: &Identity) {
    for (key, file) in
        [("connect_certificate", &papers.certificate), ("connect_private_key", &papers.key)]
    {
        let file: PathBuf = file.clone();
        insert(settings, &format!("transport/link/tls/{key}"), &format!("{file:?}"));
    }
}

fn insert(settings: &mut Config, key: &str, value: &str) {
    settings.insert_json5(key, value).unwrap();
}
