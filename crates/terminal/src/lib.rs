//! The terminal view: what operators look at without a browser.
