//! Sign-in with a certificate issued by the structure's authority.

use std::path::PathBuf;

use pki::{Holder, Issued};

use super::sessions::SignedIn;

/// Why sign-in by a certificate is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum CertificateRefusal {
    /// The certificate belongs to a machine.
    #[error("the certificate is that of `{0}`; people sign in as an operator or an observer")]
    NoPerson(Issued),
    /// The certificate is revoked.
    #[error("the certificate of `{0}` is revoked; use the present one")]
    Revoked(Issued),
    /// The list of revoked certificates cannot be read.
    #[error("cannot read revoked certificates ({0}); sign-in by certificate disabled")]
    Unreadable(String),
}

/// Maps a certificate verified by TLS to a person. `revoked` is the directory of revoked certificates.
pub(crate) fn person(
    shown: &Issued,
    revoked: Option<&PathBuf>,
) -> Result<SignedIn, CertificateRefusal> {
    let (name, may_order) = match &shown.holder {
        Holder::Operator(name) => (name, true),
        Holder::Observer(name) => (name, false),
        _ => return Err(CertificateRefusal::NoPerson(shown.clone())),
    };
    if let Some(directory) = revoked {
        let list = pki::library::revoked_in(directory);
        let list = list.map_err(|error| CertificateRefusal::Unreadable(error.to_string()))?;
        // A certificate of a later generation was issued to replace the revoked one.
        let outdates = |revoked: &Issued| {
            revoked.holder == shown.holder && revoked.generation >= shown.generation
        };
        if list.iter().any(outdates) {
            return Err(CertificateRefusal::Revoked(shown.clone()));
        }
    }
    Ok(SignedIn { name: name.to_string(), may_order, certificate: Some(shown.clone()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn let_in(text: &str, revoked: Option<&PathBuf>) -> Result<bool, CertificateRefusal> {
        person(&text.parse().unwrap(), revoked).map(|signed_in| signed_in.may_order)
    }

    #[test]
    fn operators_order_observers_look_and_machines_do_neither() {
        assert_eq!(let_in("operator.ada", None), Ok(true));
        assert_eq!(let_in("observer.wall", None), Ok(false));
        for machine in ["module1", "plant", "router.ground"] {
            assert!(matches!(let_in(machine, None), Err(CertificateRefusal::NoPerson(_))));
        }
    }

    #[test]
    fn revoked_and_unknown_certificates_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().to_owned();
        std::fs::write(directory.join("operator.ada~2.pem"), "").unwrap();
        for revoked in ["operator.ada", "operator.ada~2"] {
            assert!(matches!(
                let_in(revoked, Some(&directory)),
                Err(CertificateRefusal::Revoked(_))
            ));
        }
        for present in ["operator.ada~3", "operator.bob"] {
            assert_eq!(let_in(present, Some(&directory)), Ok(true));
        }
        let missing = directory.join("missing");
        let unknown = let_in("operator.bob", Some(&missing));
        assert!(matches!(unknown, Err(CertificateRefusal::Unreadable(_))), "{unknown:?}");
    }
}
