//! Why there is no session.

/// Why there is no session.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// An invalid file of Zenoh's settings.
    #[error("`{file}` is no file of Zenoh settings: {reason}")]
    File {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// Settings that Zenoh does not take.
    #[error("Zenoh does not take `{key}` = {value}: {reason}")]
    Setting {
        /// The setting.
        key: &'static str,
        /// Its value.
        value: String,
        /// Why.
        reason: String,
    },
    /// Someone else has the port, or there is no such address.
    #[error("cannot listen on {endpoints}: {reason}; free the port or choose another endpoint")]
    Listen {
        /// The endpoints.
        endpoints: String,
        /// Why.
        reason: String,
    },
    /// No session for another reason.
    #[error("no session can be opened ({endpoints}): {reason}")]
    Open {
        /// Where to.
        endpoints: String,
        /// Why.
        reason: String,
    },
}
