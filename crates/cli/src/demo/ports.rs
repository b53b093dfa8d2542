//! Ports of this machine that are free.

use std::net::TcpListener;

use crate::failure::Failure;

/// Endpoints on this machine at which nobody listens. They are free when this is called; whoever is
/// to have one should take it soon.
pub(super) fn free_endpoints<const COUNT: usize>() -> Result<[String; COUNT], Failure> {
    let cannot = |error| Failure::network(format!("no free port on 127.0.0.1: {error}"));
    let mut held = Vec::new();
    for _ in 0..COUNT {
        held.push(TcpListener::bind(("127.0.0.1", 0)).map_err(cannot)?);
    }
    let mut endpoints = [const { String::new() }; COUNT];
    for (endpoint, listener) in endpoints.iter_mut().zip(&held) {
        let port = listener.local_addr().map_err(cannot)?.port();
        *endpoint = format!("tcp/127.0.0.1:{port}");
    }
    Ok(endpoints)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_endpoint_is_given_twice() {
        let [first, second, third] = free_endpoints::<3>().unwrap();
        assert!(first != second && second != third && first != third);
        assert!(first.starts_with("tcp/127.0.0.1:"));
    }
}
