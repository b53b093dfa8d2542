//! What the diagnoser takes beside samples: numbered, published, kept for those who missed some, so that a recording
//! gives the same verdicts again.
//!
//! | file | job |
//! |---|---|
//! | `register` | numbers the inputs, each with the sample after which it was taken |
//! | `shelf` | keeps the first and the latest of them as they were published |

#[cfg(test)]
mod agreement;
mod register;
mod shelf;

pub(crate) use register::Register;
pub(crate) use shelf::Shelf;
