//! The web page of a deployment as a process, and readers of its streams.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::task::JoinSet;

use crate::binaries::{configs, program};
use crate::deployment::{Deployment, MODULES};
use crate::in_time;
use crate::process::Process;

/// How often it is looked whether something has come.
const GLANCE: Duration = Duration::from_millis(20);
const READERS_ADDRESSES: usize = 4;
/// A component's page, as the script names it.
const COMPONENT: &str = "page=component&of=module1/sensor/g1&structure=tower";

/// `trusswatch web` of the tower, connected to every process of a deployment.
pub struct WebPage {
    process: Process,
    address: SocketAddr,
}

impl WebPage {
    /// Starts one, and waits until it serves.
    ///
    /// # Panics
    /// If it does not.
    pub async fn start(deployment: &Deployment) -> Self {
        let port = session::loopback::reserve(1).unwrap().start;
        let address = SocketAddr::from(([127, 0, 0, 1], port));
        let mut command = program("trusswatch");
        command.args(["web", "--structure", "tower", "--mode", "peer"]);
        command.args(["--listen", &address.to_string(), "--drawing"]);
        command.arg(configs().join("tower.toml"));
        command.arg("--state-dir").arg(deployment.state_directory(MODULES.len()));
        for endpoint in &deployment.endpoints {
            command.args(["--connect", endpoint]);
        }
        let process = deployment.start_other(command, "web");
        let serves = async {
            while TcpStream::connect(address).await.is_err() {
                tokio::time::sleep(GLANCE).await;
            }
        };
        in_time("the page", serves).await;
        let page = Self { process, address };
        let knows_component = async {
            while !page.answers(COMPONENT).await {
                tokio::time::sleep(GLANCE).await;
            }
        };
        in_time("the component's page", knows_component).await;
        page
    }

    /// Whether the parts of this page are to be had.
    async fn answers(&self, page: &str) -> bool {
        let Ok(mut stream) = TcpStream::connect(self.address).await else { return false };
        let request = format!("GET /fragments?{page} HTTP/1.1\r\nHost: {}\r\n\r\n", self.address);
        let mut begin = [0; 12];
        stream.write_all(request.as_bytes()).await.is_ok()
            && stream.read_exact(&mut begin).await.is_ok()
            && begin.ends_with(b"200")
    }

    /// Its process.
    #[must_use]
    pub fn process(&self) -> &Process {
        &self.process
    }

    /// Opens so many streams, each read as fast as it comes.
    pub async fn read(&self, streams: usize) -> Readers {
        let mut readers = Readers { read: Vec::new(), _tasks: JoinSet::new() };
        for place in 0..streams {
            let mut stream = self.open(place).await;
            let read = Arc::new(Read::default());
            readers.read.push(read.clone());
            readers._tasks.spawn(async move {
                let mut bytes = vec![0; 16 * 1024];
                while let Ok(count @ 1..) = stream.read(&mut bytes).await {
                    read.bytes.fetch_add(count as u64, Ordering::Relaxed);
                    let latched = String::from_utf8_lossy(&bytes[..count]).contains("latched");
                    read.latched.fetch_add(u64::from(latched), Ordering::Relaxed);
                }
                read.ended.fetch_add(1, Ordering::Relaxed);
            });
        }
        readers
    }

    /// Opens a stream that nobody reads.
    pub async fn stall(&self) -> TcpStream {
        self.open(0).await
    }

    /// One address may have a part of all connections only: readers have some addresses of this machine in turns.
    async fn open(&self, place: usize) -> TcpStream {
        let from = Ipv4Addr::new(127, 0, 0, (2 + place % READERS_ADDRESSES) as u8);
        let socket = TcpSocket::new_v4().unwrap();
        socket.bind((from, 0).into()).unwrap();
        let mut stream = socket.connect(self.address).await.unwrap();
        // Half of them look at a component: its evidence, margins and trends.
        let page = ["page=overview", COMPONENT][place % 2];
        let request = format!(
            "GET /stream?{page} HTTP/1.1\r\nHost: {}\r\nAccept: text/event-stream\r\n\r\n",
            self.address
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        stream
    }

    /// Ends it in order.
    pub async fn stop(self) {
        in_time("the end of the page", self.process.stop()).await;
    }
}

/// What one reader has read.
#[derive(Debug, Default)]
struct Read {
    bytes: AtomicU64,
    latched: AtomicU64,
    ended: AtomicU64,
}

/// Readers of streams, until they are dropped.
pub struct Readers {
    read: Vec<Arc<Read>>,
    _tasks: JoinSet<()>,
}

impl Readers {
    /// How many have read of a latched fault.
    #[must_use]
    pub fn informed(&self) -> usize {
        self.read.iter().filter(|read| read.latched.load(Ordering::Relaxed) > 0).count()
    }

    /// How many streams have ended.
    #[must_use]
    pub fn ended(&self) -> u64 {
        self.read.iter().map(|read| read.ended.load(Ordering::Relaxed)).sum()
    }

    /// What all of them have read \[MB\].
    #[must_use]
    pub fn megabytes(&self) -> f64 {
        let bytes: u64 = self.read.iter().map(|read| read.bytes.load(Ordering::Relaxed)).sum();
        bytes as f64 / 1e6
    }
}
