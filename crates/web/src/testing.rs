//! Made-up scenes for tests.
