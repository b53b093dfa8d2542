//! Recorded inputs through the same diagnosers, and what comes of it.
