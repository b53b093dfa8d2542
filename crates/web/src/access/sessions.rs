//! Sessions of users who are signed in, kept in memory: they end with the process.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use pki::Issued;

use super::secret::{Fingerprint, NoRandomness, Secret};

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
pub(crate) struct Sessions(Mutex<BTreeMap<Fingerprint, Session>>);

#[derive(Debug)]
struct Session {
    found: ActiveSession,
    begun: Instant,
    used: Instant,
    message: Option<String>,
}

impl Sessions {
    /// Starts a session under a fresh secret.
    pub(crate) fn begin(&self, signed_in: SignedIn, now: Instant) -> Result<Secret, NoRandomness> {
        let (secret, form_token) = (Secret::new()?, Secret::new()?);
        let found = ActiveSession { signed_in, form_token };
        let mut sessions = self.0.lock();
        sessions.retain(|_, session| !session.is_over(now));
        if sessions.len() >= MOST {
            let idle = sessions.iter().min_by_key(|(_, session)| session.used);
            let idle = idle.map(|(key, _)| key.clone());
            idle.and_then(|key| sessions.remove(&key));
        }
        let session = Session { found, begun: now, used: now, message: None };
        sessions.insert(secret.fingerprint(), session);
        Ok(secret)
    }

    /// The session with this secret, unless expired. `is_use`: the request is an action of the user, not an automatic
    /// refresh.
    pub(crate) fn find(
        &self,
        secret: &Secret,
        is_use: bool,
        now: Instant,
    ) -> Option<ActiveSession> {
        let mut sessions = self.0.lock();
        let session = sessions.get_mut(&secret.fingerprint())?;
        if session.is_over(now) {
            return None;
        }
        if is_use {
            session.used = now;
        }
        Some(session.found.clone())
    }

    /// Ends a session.
    pub(crate) fn end(&self, secret: &Secret) {
        self.0.lock().remove(&secret.fingerprint());
    }

    /// Stores a message for the next page.
    pub(crate) fn leave_message(&self, secret: &Secret, message: String) {
        if let Some(session) = self.0.lock().get_mut(&secret.fingerprint()) {
            session.message = Some(message);
        }
    }

    /// Takes the message, so that it is shown once.
    pub(crate) fn take_message(&self, secret: &Secret) -> Option<String> {
        self.0.lock().get_mut(&secret.fingerprint())?.message.take()
    }
}

impl Session {
    fn is_over(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.begun) >= LONGEST
            || now.saturating_duration_since(self.used) >= IDLE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ada() -> SignedIn {
        SignedIn { name: "ada".to_owned(), may_order: true, certificate: None }
    }

    #[test]
    fn a_session_ends_when_nobody_uses_it_and_at_the_end_of_the_day() {
        let (sessions, start) = (Sessions::default(), Instant::now());
        let idle = sessions.begin(ada(), start).unwrap();
        // A page that refreshes itself is no person.
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
    fn a_session_that_was_ended_is_over_and_others_are_not() {
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
        assert_eq!(sessions.0.lock().len(), MOST);
        assert!(sessions.find(&first, true, now).is_some());
        assert!(sessions.find(&second, true, now).is_none());
    }

    #[test]
    fn a_message_is_shown_once() {
        let (sessions, now) = (Sessions::default(), Instant::now());
        let ada = sessions.begin(ada(), now).unwrap();
        sessions.leave_message(&ada, "done".to_owned());
        assert_eq!(sessions.take_message(&ada).as_deref(), Some("done"));
        assert_eq!(sessions.take_message(&ada), None);
    }
}
