//! TLS: the server certificate, and client certificates for sign-in.

use std::path::Path;
use std::sync::Arc;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::{CryptoProvider, ring};
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::server::WebPkiClientVerifier;
use tokio_rustls::rustls::server::danger::ClientCertVerifier;
use tokio_rustls::rustls::{RootCertStore, ServerConfig};

use super::settings::{ListenError, PageAccess};

/// The TLS acceptor for new connections; `None` without a certificate.
pub(super) fn acceptor(access: &PageAccess) -> Result<Option<TlsAcceptor>, ListenError> {
    let (Some(certificate), Some(key_file)) = (&access.page_certificate, &access.page_key) else {
        return Ok(None);
    };
    let provider = Arc::new(ring::default_provider());
    let builder = ServerConfig::builder_with_provider(provider.clone());
    let builder = builder.with_safe_default_protocol_versions();
    let builder = builder.map_err(|error| wrong(certificate, error))?;
    let builder = match &access.page_authority {
        Some(authority) => builder.with_client_cert_verifier(verifier(authority, provider)?),
        None => builder.with_no_client_auth(),
    };
    let key = PrivateKeyDer::from_pem_file(key_file).map_err(|error| wrong(key_file, error))?;
    let config = builder.with_single_cert(certificates(certificate)?, key);
    let mut config = config.map_err(|error| wrong(key_file, error))?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Some(TlsAcceptor::from(Arc::new(config))))
}

/// Verifies client certificates, which are optional; one of another authority ends the connection.
fn verifier(
    authority: &Path,
    provider: Arc<CryptoProvider>,
) -> Result<Arc<dyn ClientCertVerifier>, ListenError> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(authority)? {
        roots.add(certificate).map_err(|error| wrong(authority, error))?;
    }
    WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider)
        .allow_unauthenticated()
        .build()
        .map_err(|error| wrong(authority, error))
}

fn certificates(file: &Path) -> Result<Vec<CertificateDer<'static>>, ListenError> {
    let all = CertificateDer::pem_file_iter(file).map_err(|error| wrong(file, error))?;
    let all: Result<Vec<_>, _> = all.collect();
    let all = all.map_err(|error| wrong(file, error))?;
    if all.is_empty() { Err(wrong(file, "holds no certificate in PEM form")) } else { Ok(all) }
}

fn wrong(file: &Path, wrong: impl ToString) -> ListenError {
    ListenError::File { file: file.to_owned(), wrong: wrong.to_string() }
}
