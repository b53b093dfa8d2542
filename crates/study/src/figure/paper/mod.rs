//! Reproductions of the figures in section 5 of the paper: the same faults at the same times, in any campaign.

mod figure4;
mod figure5;
mod figure6;
mod marks;
mod panels;
mod place;
mod story;
mod verdict;

pub use figure4::figure4;
pub use figure5::figure5;
pub use figure6::figure6;
