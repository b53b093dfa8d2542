//! The place of a fleet's router, with the certificate that a gateway shows there.

use std::path::Path;

use pki::Identity;

use super::common::check_endpoints;
use crate::failure::Failure;

/// The endpoint as Zenoh reads it: on this link alone it trusts the fleet's authority, and shows the fleet's certificate.
/// Everywhere else it trusts the structure's.
pub(super) fn endpoint(place: &str, directory: &Path) -> Result<String, Failure> {
    check_endpoints(&[place.to_owned()])?;
    let identity = Identity::in_directory(directory);
    let files = [
        ("root_ca_certificate_file", &identity.authority),
        ("connect_certificate_file", &identity.certificate),
        ("connect_private_key_file", &identity.key),
    ];
    let named = files.map(|(key, file)| format!("{key}={}", file.display())).join(";");
    // Zenoh reads these as the end of a name.
    if place.contains('#') || named.contains('#') || named.matches(';').count() >= files.len() {
        let directory = directory.display();
        return Err(Failure::usage(format!(
            "`{place}` and `{directory}`: a place and a directory of certificates without `#` and `;` are needed"
        )));
    }
    Ok(format!("{place}#{named}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_link_is_made_with_the_fleets_certificate() {
        let read = endpoint("tls/192.0.2.99:7447", Path::new("/etc/fleet")).unwrap();
        let expected = "tls/192.0.2.99:7447#root_ca_certificate_file=/etc/fleet/authority.pem;\
                        connect_certificate_file=/etc/fleet/certificate.pem;\
                        connect_private_key_file=/etc/fleet/key.pem";
        assert_eq!(read, expected);
        assert!(session::endpoint(&read).is_ok());
        for (place, directory) in
            [("tcp/192.0.2.99:7447", "/etc"), ("tls/a:1#b=c", "/etc"), ("tls/a:1", "/etc/a;b")]
        {
            assert!(endpoint(place, Path::new(directory)).is_err(), "{place} {directory}");
        }
    }
}
