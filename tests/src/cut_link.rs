//! A TCP connection that can be cut and mended, without a laboratory.

use tokio::io::copy_bidirectional;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch::{Receiver, Sender};
use tokio::task::JoinSet;

use crate::deployment::free_endpoint;

/// Passes connections on to one endpoint, unless it is cut.
pub struct CutLink {
    endpoint: String,
    is_whole: Sender<bool>,
    _passing: JoinSet<()>,
}

impl CutLink {
    /// A whole link to this endpoint, of the form `tcp/ADDRESS`.
    pub async fn to(endpoint: &str) -> Self {
        let (own, target) = (free_endpoint(), address(endpoint));
        let listener = TcpListener::bind(address(&own)).await.unwrap();
        let is_whole = Sender::new(true);
        let mut passing = JoinSet::new();
        passing.spawn(pass(listener, target, is_whole.subscribe()));
        Self { endpoint: own, is_whole, _passing: passing }
    }

    /// Where to connect.
    #[must_use]
    pub fn endpoint(&self) -> String {
        self.endpoint.clone()
    }

    /// Ends every connection, and every one that is attempted from now on.
    pub fn cut(&self) {
        self.is_whole.send_replace(false);
    }

    /// Connections succeed again.
    pub fn mend(&self) {
        self.is_whole.send_replace(true);
    }
}

fn address(endpoint: &str) -> String {
    endpoint.strip_prefix("tcp/").unwrap().to_owned()
}

async fn pass(listener: TcpListener, target: String, is_whole: Receiver<bool>) {
    let mut connections = JoinSet::new();
    loop {
        let (mut near, _) = listener.accept().await.unwrap();
        let (target, mut is_whole) = (target.clone(), is_whole.clone());
        connections.spawn(async move {
            if !*is_whole.borrow() {
                return;
            }
            let Ok(mut far) = TcpStream::connect(&target).await else { return };
            // However it ends, both connections end with it.
            tokio::select! {
                _ = copy_bidirectional(&mut near, &mut far) => {}
                _ = is_whole.wait_for(|whole| !whole) => {}
            }
        });
        while connections.try_join_next().is_some() {}
    }
}
