//! Identities: a structure's authority and the certificates that it signs.
//!
//! A *holder* is a module, the plant, a router, an operator or an observer. Its *identity* is a
//! directory of three files: its certificate, its key, and the authority's certificate. The
//! certificate's common name is the holder's and the structure's, e.g. `module1.tower` or
//! `operator.ada.tower`; access control matches it. After a revocation it has another *generation*, e.g.
//! `module1~2.tower`.
//!
//! | file | what |
//! |---|---|
//! | `holder` | holders and generations, and their names |
//! | `address` | addresses of holders |
//! | `lifetime` | periods of validity |
//! | `certificate` | reads certificates |
//! | `identity` | the files of a holder, and checks of them |
//! | `authority` | creates the authority, issues and renews certificates |
//! | `library` | the directory with the authority and all issued identities |
//! | `revocation` | revokes a certificate whose key is lost, and replaces it |
//! | `credentials` | provides services with identities through the credential store of systemd |
//! | `browser` | exports a person's key and certificate to one file for a browser |
//! | `private_files` | writes files readable by the owner only, without overwriting existing ones |
//!
//! Certificates are generated with [rcgen] and verified with [rustls], as on the network.

pub mod address;
pub mod authority;
pub mod browser;
pub mod certificate;
pub mod credentials;
pub mod holder;
pub mod identity;
pub mod library;
pub mod lifetime;
pub mod revocation;

mod private_files;

pub use address::Address;
pub use authority::{Authority, IssueError};
pub use certificate::Certificate;
pub use holder::{CommonName, Holder, Issued};
pub use identity::{Identity, IdentityProblem};
pub use library::{Generations, Library};
pub use lifetime::Lifetime;
