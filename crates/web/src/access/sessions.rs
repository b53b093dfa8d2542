//! Sessions of users who are signed in, kept in memory: they end with the process, unless their device stays signed in.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use parking_lot::Mutex;
use pki::Issued;

use super::one_time_link::{Invitation, LinkError};
use super::secret::{Fingerprint, NoRandomness, Secret};
use super::{Access, Visit, certificate, device};

/// Maximum duration of a session.
const LONGEST: Duration = Duration::from_secs(12 * 3600);
/// Duration after which an idle session ends.
const IDLE: Duration = Duration::from_secs(2 * 3600);
/// Most sessions; a further one ends the one idle for longest.
const MOST: usize = 1000;

/// A user, and how the user signed in.
#[derive(Debug, Clone)]
pub(crate) struct SignedIn {
    /// The user's name.
    pub(crate) name: String,
    /// Whether the user may send orders.
    pub(crate) may_order: bool,
    /// The certificate used to sign in; the session is valid only with it.
    pub(crate) certificate: Option<Issued>,
}

/// A valid session, as used by a request.
#[derive(Debug, Clone)]
pub(crate) struct ActiveSession {
    pub(crate) signed_in: SignedIn,
    /// The token in every form of the session.
    pub(crate) form_token: Secret,
}

/// All sessions.
#[derive(Debug, Default)]
pub(crate) struct Sessions {
    open: Mutex<BTreeMap<Fingerprint, Session>>,
    /// The state directory, in which it stands which devices stay signed in.
    state: Option<PathBuf>,
}

#[derive(Debug)]
struct Session {
    found: ActiveSession,
    begun: Instant,
    used: Instant,
    /// Whether its device stays signed in: until the file in the state directory is gone or has expired.
    is_kept: bool,
    message: Option<PageMessage>,
}

/// The outcome of an order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PageMessage {
    /// In words.
    pub(crate) words: String,
    /// Whether it was not carried out.
    pub(crate) is_refusal: bool,
}

impl Sessions {
    /// No sessions but those of devices that stay signed in.
    pub(crate) fn of_devices(state: Option<PathBuf>) -> Self {
        Self { state, ..Self::default() }
    }

    /// Starts a session under a fresh secret.
    pub(crate) fn begin(&self, signed_in: SignedIn, now: Instant) -> Result<Secret, NoRandomness> {
        let secret = Secret::new()?;
        self.insert(&secret, signed_in, false, now)?;
        Ok(secret)
    }

    /// Starts a session that lasts for as long as its device stays signed in.
    ///
    /// # Errors
    /// It cannot be written down, or no secret can be generated.
    pub(crate) fn begin_kept(
        &self,
        signed_in: SignedIn,
        now: Instant,
    ) -> Result<Secret, LinkError> {
        let secret = Secret::new()?;
        if let Some(state) = &self.state {
            device::keep(state, &secret, &signed_in.name, signed_in.may_order)?;
        }
        self.insert(&secret, signed_in, self.state.is_some(), now)?;
        Ok(secret)
    }

    fn insert(
        &self,
        secret: &Secret,
        signed_in: SignedIn,
        is_kept: bool,
        now: Instant,
    ) -> Result<(), NoRandomness> {
        let found = ActiveSession { signed_in, form_token: Secret::new()? };
        let mut sessions = self.open.lock();
        sessions.retain(|_, session| !session.is_over(now));
        if sessions.len() >= MOST {
            let idle = sessions.iter().min_by_key(|(_, session)| session.used);
            let idle = idle.map(|(key, _)| key.clone());
            idle.and_then(|key| sessions.remove(&key));
        }
        let session = Session { found, begun: now, used: now, is_kept, message: None };
        sessions.insert(secret.fingerprint(), session);
        Ok(())
    }

    /// The session with this secret, unless expired. `is_use`: the request is an action of the user, not an automatic
    /// refresh.
    pub(crate) fn find(
        &self,
        secret: &Secret,
        is_use: bool,
        now: Instant,
    ) -> Option<ActiveSession> {
        let key = secret.fingerprint();
        self.find_device(secret, &key, now)?;
        let mut sessions = self.open.lock();
        let session = sessions.get_mut(&key)?;
        if session.is_over(now) {
            return None;
        }
        if is_use {
            session.used = now;
        }
        Some(session.found.clone())
    }

    /// Looks whether the device of a session is still signed in, or one without a session is, e.g. after a restart of the
    /// page.
    fn find_device(&self, secret: &Secret, key: &Fingerprint, now: Instant) -> Option<()> {
        let is_kept = self.open.lock().get(key).map(|session| session.is_kept);
        let (Some(state), None | Some(true)) = (&self.state, is_kept) else { return Some(()) };
        match (device::find(state, key), is_kept) {
            (Some(_), Some(_)) => {}
            (Some(Invitation { person, may_order, .. }), None) => {
                let signed_in = SignedIn { name: person, may_order, certificate: None };
                self.insert(secret, signed_in, true, now).ok()?;
            }
            (None, Some(_)) => {
                self.open.lock().remove(key);
            }
            (None, None) => return None,
        }
        Some(())
    }

    /// Ends a session.
    pub(crate) fn end(&self, secret: &Secret) {
        let key = secret.fingerprint();
        if let Some(state) = &self.state {
            device::end(state, &key);
        }
        self.open.lock().remove(&key);
    }

    /// Stores a message for the next page.
    pub(crate) fn leave_message(&self, secret: &Secret, message: PageMessage) {
        if let Some(session) = self.open.lock().get_mut(&secret.fingerprint()) {
            session.message = Some(message);
        }
    }

    /// Takes the message, so that it is shown once.
    pub(crate) fn take_message(&self, secret: &Secret) -> Option<PageMessage> {
        self.open.lock().get_mut(&secret.fingerprint())?.message.take()
    }
}

impl Session {
    fn is_over(&self, now: Instant) -> bool {
        if self.is_kept {
            return false;
        }
        now.saturating_duration_since(self.begun) >= LONGEST
            || now.saturating_duration_since(self.used) >= IDLE
    }
}

/// Interval of reading the list of revoked certificates, and of checking a stream without changes.
pub(crate) const CHECK_EVERY: Duration = Duration::from_secs(1);

/// The session of a request that outlasts the guard's checks.
#[derive(Debug, Clone)]
pub(crate) struct SessionWatch {
    /// `None` if the request was admitted without signing in.
    session: Option<(Arc<Access>, Secret)>,
    /// When the session's certificate was last found not to be revoked.
    not_revoked: Option<Instant>,
}

impl SessionWatch {
    /// Whether the user has signed out, the session has expired, or its certificate is revoked. The check does not
    /// count as use of the session.
    pub(crate) fn is_over(&mut self, now: Instant) -> bool {
        let Some((access, session)) = &self.session else { return false };
        let Some(found) = access.sessions.find(session, false, now) else { return true };
        let Some(begun_with) = &found.signed_in.certificate else { return false };
        if self.not_revoked.is_some_and(|at| now.saturating_duration_since(at) < CHECK_EVERY) {
            return false;
        }
        self.not_revoked = Some(now);
        certificate::person(begun_with, access.settings.revoked.as_ref()).is_err()
    }
}

impl<S: Sync> FromRequestParts<S> for SessionWatch {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let visit = parts.extensions.get::<Visit>();
        let session = visit.and_then(|visit| {
            visit.session.clone().map(|session| (Arc::clone(&visit.access), session))
        });
        Ok(Self { session, not_revoked: None })
    }
}

#[cfg(test)]
mod tests {
    use super::super::AccessSettings;
    use super::super::PersonName;
    use super::*;

    fn ada() -> SignedIn {
        SignedIn { name: "ada".to_owned(), may_order: true, certificate: None }
    }

    #[test]
    fn a_session_expires_when_idle_and_after_half_a_day() {
        let (sessions, start) = (Sessions::default(), Instant::now());
        let idle = sessions.begin(ada(), start).unwrap();
        // Automatic refreshes of a page do not count as use.
        assert!(sessions.find(&idle, false, start + IDLE / 2).is_some());
        assert!(sessions.find(&idle, true, start + IDLE).is_none());
        let busy = sessions.begin(ada(), start).unwrap();
        let mut now = start;
        while now < start + LONGEST - IDLE / 2 {
            now += IDLE / 2;
            let is_there = sessions.find(&busy, true, now).is_some();
            assert_eq!(is_there, now < start + LONGEST, "{:?}", now - start);
        }
    }

    #[test]
    fn ending_a_session_leaves_others_valid() {
        let (sessions, now) = (Sessions::default(), Instant::now());
        let (one, other) =
            (sessions.begin(ada(), now).unwrap(), sessions.begin(ada(), now).unwrap());
        sessions.end(&one);
        assert!(sessions.find(&one, true, now).is_none());
        assert!(sessions.find(&other, true, now).is_some());
        assert!(sessions.find(&Secret::new().unwrap(), true, now).is_none());
    }

    #[test]
    fn a_further_session_ends_the_one_that_was_idle_for_longest() {
        let (sessions, start) = (Sessions::default(), Instant::now());
        let first = sessions.begin(ada(), start).unwrap();
        let second = sessions.begin(ada(), start).unwrap();
        let now = start + Duration::from_secs(1);
        sessions.find(&first, true, now).unwrap();
        for _ in 2..=MOST {
            sessions.begin(ada(), now).unwrap();
        }
        assert_eq!(sessions.open.lock().len(), MOST);
        assert!(sessions.find(&first, true, now).is_some());
        assert!(sessions.find(&second, true, now).is_none());
    }

    #[test]
    fn a_device_stays_signed_in_over_restarts_until_it_is_signed_out_here_or_there() {
        let state = tempfile::tempdir().unwrap();
        let sessions = || Sessions::of_devices(Some(state.path().to_owned()));
        let (first, start) = (sessions(), Instant::now());
        let (phone, other) =
            (first.begin_kept(ada(), start).unwrap(), first.begin_kept(ada(), start).unwrap());
        let visitor = first.begin(ada(), start).unwrap();
        let late = start + 2 * LONGEST;
        assert!(
            first.find(&phone, true, late).is_some() && first.find(&visitor, true, late).is_none()
        );
        // The page starts again.
        let second = sessions();
        let found = second.find(&phone, false, start).unwrap();
        assert!(found.signed_in.name == "ada" && found.signed_in.may_order);
        assert!(second.find(&visitor, true, start).is_none());
        second.end(&phone);
        assert!(
            second.find(&phone, true, start).is_none()
                && sessions().find(&phone, true, start).is_none()
        );
        assert_eq!(device::devices(state.path()).unwrap().len(), 1);
        let nobody: PersonName = "grace".parse().unwrap();
        assert_eq!(device::sign_out_devices(state.path(), &nobody).unwrap(), 0);
        assert!(second.find(&other, true, start).is_some());
        assert_eq!(device::sign_out_devices(state.path(), &"ada".parse().unwrap()).unwrap(), 1);
        assert!(second.find(&other, true, start).is_none());
    }

    #[test]
    fn a_message_is_shown_once() {
        let (sessions, now) = (Sessions::default(), Instant::now());
        let ada = sessions.begin(ada(), now).unwrap();
        let done = PageMessage { words: "done".to_owned(), is_refusal: false };
        sessions.leave_message(&ada, done.clone());
        assert_eq!(sessions.take_message(&ada), Some(done));
        assert_eq!(sessions.take_message(&ada), None);
    }

    const HOUR: Duration = Duration::from_secs(3600);

    fn watch(access: &Arc<Access>, certificate: Option<&str>, now: Instant) -> SessionWatch {
        let certificate = certificate.map(|name| name.parse().unwrap());
        let session = access.sessions.begin(SignedIn { certificate, ..ada() }, now).unwrap();
        SessionWatch { session: Some((Arc::clone(access), session)), not_revoked: None }
    }

    #[test]
    fn streams_of_a_session_end_after_signing_out_when_idle_and_after_half_a_day() {
        let (access, start) = (Arc::new(Access::default()), Instant::now());
        let mut left = watch(&access, None, start);
        assert!(!left.is_over(start));
        access.sessions.end(&left.session.as_ref().unwrap().1);
        assert!(left.is_over(start));
        // An open stream does not count as use.
        let mut idle = watch(&access, None, start);
        assert!(!idle.is_over(start + HOUR));
        assert!(idle.is_over(start + 2 * HOUR));
        let mut busy = watch(&access, None, start);
        let session = busy.session.as_ref().unwrap().1.clone();
        for hour in 1..12 {
            access.sessions.find(&session, true, start + hour * HOUR).unwrap();
            assert!(!busy.is_over(start + hour * HOUR));
        }
        assert!(busy.is_over(start + 12 * HOUR));
        let mut anonymous = SessionWatch { session: None, not_revoked: None };
        assert!(!anonymous.is_over(start + 12 * HOUR));
    }

    #[test]
    fn a_session_ends_within_a_second_of_revoking_its_certificate() {
        let folder = tempfile::tempdir().unwrap();
        let revoked = Some(folder.path().to_owned());
        let access = Access::new(AccessSettings { revoked, ..AccessSettings::default() });
        let (access, start) = (Arc::new(access), Instant::now());
        let mut ada = watch(&access, Some("operator.ada"), start);
        let mut bob = watch(&access, Some("operator.bob"), start);
        assert!(!ada.is_over(start) && !bob.is_over(start));
        std::fs::write(folder.path().join("operator.ada.pem"), "").unwrap();
        assert!(ada.is_over(start + CHECK_EVERY) && !bob.is_over(start + CHECK_EVERY));
    }
}
