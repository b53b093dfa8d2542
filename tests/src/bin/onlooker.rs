//! A process that subscribes to everything and stops taking it: `onlooker stall|listen ENDPOINT…`.
//!
//! Reports the first message on standard output. `stall` then blocks the network's own thread permanently,
//! as a subscriber does whose handler is full; `listen` goes on.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

use std::sync::atomic::{AtomicBool, Ordering};

use session::Network;

fn take(stall: bool) {
    static FIRST: AtomicBool = AtomicBool::new(true);
    if FIRST.swap(false, Ordering::Relaxed) {
        println!("listening");
    }
    if stall {
        loop {
            std::thread::park();
        }
    }
}

#[tokio::main]
async fn main() {
    let mut arguments = std::env::args().skip(1);
    let stall = arguments.next().as_deref() == Some("stall");
    let network = Network::peer_of(&arguments.collect::<Vec<_>>());
    let session = session::open(&network).await.unwrap();
    let mut events = Vec::new();
    for topic in ["fault/**", "identification/**", "change", "phase"] {
        let key = format!("trusswatch/*/*/{topic}");
        let subscriber = session.declare_subscriber(key).callback(move |_| take(stall));
        events.push(subscriber.await.unwrap());
    }
    let everything = session.declare_subscriber("trusswatch/**").callback(move |_| take(stall));
    let _everything = everything.await.unwrap();
    std::future::pending::<()>().await;
}
