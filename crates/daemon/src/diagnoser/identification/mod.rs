//! What kind of fault it is: found on a thread of its own, published when it changes.
//!
//! | file | job |
//! |---|---|
//! | `identifier` | the thread |
//! | `materiality` | whether a finding differs enough from the one published before to be news |
//! | `present_fault` | what is known of the fault that a component has at present |
//! | `tally` | what was found and how long it took, for the metrics |

mod identifier;
mod materiality;
mod present_fault;
mod tally;

pub(crate) use identifier::Identifier;
pub(crate) use present_fault::PresentFault;
pub(crate) use tally::IdentificationTally;
