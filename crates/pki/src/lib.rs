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
//! | `holder` | who a certificate is for and in which generation, and how that is written |
//! | `address` | where a holder can be reached |
//! | `lifetime` | from when until when |
//! | `certificate` | what stands in a certificate |
//! | `identity` | the files of a holder, and what is wrong with them |
//! | `authority` | makes the authority, issues and renews |
//! | `library` | the directory with the authority and every identity that it has issued |
//! | `revocation` | a certificate whose key is lost gives way to another one |
//! | `credentials` | how services come by their identities, from systemd's credential store |
//! | `browser` | a person's key and certificate in one file for a browser |
//! | `private_files` | writing files readable by the owner only, and never over something that is there |
//!
//! Certificates are made with [rcgen] and judged with [rustls], as on the network.

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
