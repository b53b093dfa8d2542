//! Whether this process may send commands.

use session::Network;

/// Why it may not, if so: on a network with access control only operators may send commands, and the process has no
/// operator's certificate.
pub(crate) fn read_only(network: &Network) -> Option<String> {
    let directory = network.tls.as_ref().filter(|_| network.operator().is_none())?;
    Some(format!(
        "This page is read-only: its network certificate in `{}` is not an operator's.",
        directory.display()
    ))
}

#[cfg(test)]
mod tests {
    use pki::{Authority, Holder, Library, Lifetime};

    use super::*;

    #[test]
    fn only_an_operators_certificate_orders_where_there_are_certificates() {
        let folder = tempfile::tempdir().unwrap();
        let structure = "tower".parse().unwrap();
        let authority = Authority::create(folder.path(), structure, Lifetime::of_days(30)).unwrap();
        let network = |holder: &str| {
            let holder: Holder = holder.parse().unwrap();
            let place = Library::at(folder.path()).place_of(&holder);
            authority.issue(&place, holder, &[], Lifetime::of_days(20)).unwrap();
            Network { tls: Some(place), ..Network::default() }
        };
        assert_eq!(read_only(&network("operator.web")), None);
        assert!(read_only(&network("observer.wall")).unwrap().contains("observer.wall"));
        assert_eq!(read_only(&Network::default()), None);
    }
}
