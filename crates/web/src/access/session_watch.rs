//! Whether the session by which a stream was opened is still valid, so that the stream ends with it.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::FromRequestParts;
use axum::http::request::Parts;

use super::secret::Secret;
use super::{Access, Visit, certificate};

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
    use super::super::sessions::SignedIn;
    use super::*;

    const HOUR: Duration = Duration::from_secs(3600);

    fn watch(access: &Arc<Access>, certificate: Option<&str>, now: Instant) -> SessionWatch {
        let certificate = certificate.map(|name| name.parse().unwrap());
        let ada = SignedIn { name: "ada".to_owned(), may_order: true, certificate };
        let session = access.sessions.begin(ada, now).unwrap();
        SessionWatch { session: Some((Arc::clone(access), session)), not_revoked: None }
    }

    #[test]
    fn a_session_is_over_after_signing_out_when_idle_and_after_half_a_day() {
        let (access, start) = (Arc::new(Access::default()), Instant::now());
        let mut left = watch(&access, None, start);
        assert!(!left.is_over(start));
        access.sessions.end(&left.session.as_ref().unwrap().1);
        assert!(left.is_over(start));
        // That a stream is open is no use.
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
    fn a_session_is_over_a_second_after_its_certificate_is_revoked() {
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
