//! Places on a network, as settings and flags name them.

use zenoh::config::EndPoint;

/// The protocols that Zenoh is built with here.
const PROTOCOLS: [&str; 3] = ["tcp", "tls", "unixsock-stream"];

/// A text that names no place to listen or connect.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    /// Not of the form.
    #[error("`{text}` is no endpoint; write e.g. `tcp/127.0.0.1:7447`")]
    Form {
        /// The text.
        text: String,
    },
    /// An unsupported protocol.
    #[error("`{text}` is an endpoint of no known protocol; use {}", PROTOCOLS.join(", "))]
    Protocol {
        /// The text.
        text: String,
    },
}

/// Reads an endpoint, e.g. `tcp/127.0.0.1:7447`.
///
/// # Errors
/// Another form, or an unsupported protocol.
pub fn endpoint(text: &str) -> Result<EndPoint, EndpointError> {
    let endpoint: EndPoint =
        text.parse().map_err(|_| EndpointError::Form { text: text.to_owned() })?;
    if PROTOCOLS.contains(&endpoint.protocol().as_str()) {
        Ok(endpoint)
    } else {
        Err(EndpointError::Protocol { text: text.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_can_be_opened_is_an_endpoint() {
        for text in ["tcp/127.0.0.1:7447", "tls/[::1]:0", "unixsock-stream/run/structure.sock"] {
            assert!(endpoint(text).is_ok_and(|read| read.as_str() == text), "{text}");
        }
        for text in ["", "nowhere", "tcp/", "/127.0.0.1:7447"] {
            let error = endpoint(text).unwrap_err().to_string();
            assert!(error.ends_with("is no endpoint; write e.g. `tcp/127.0.0.1:7447`"), "{error}");
        }
        assert_eq!(
            endpoint("tpc/127.0.0.1:7447").unwrap_err().to_string(),
            "`tpc/127.0.0.1:7447` is an endpoint of no known protocol; use tcp, tls, unixsock-stream"
        );
    }
}
