//! A browser that says what a test wants it to say.

use std::net::SocketAddr;
use std::sync::Arc;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::ClientConfig;
use tokio_rustls::rustls::pki_types::ServerName;

use super::WITHIN;

/// A browser on a page of its own.
#[derive(Clone)]
pub(crate) struct Browser {
    address: SocketAddr,
    tls: Option<Arc<ClientConfig>>,
    pub(crate) cookie: Option<String>,
}

/// What is sent, header by header.
#[derive(Debug, Clone)]
pub(crate) struct Request {
    method: &'static str,
    path: String,
    headers: Vec<(String, String)>,
    body: String,
}

/// What comes back.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: String,
}

impl Browser {
    pub(crate) fn at(address: SocketAddr) -> Self {
        Self { address, tls: None, cookie: None }
    }

    pub(crate) fn over(self, tls: ClientConfig) -> Self {
        Self { tls: Some(Arc::new(tls)), ..self }
    }

    pub(crate) fn with_cookie(self, cookie: String) -> Self {
        Self { cookie: Some(cookie), ..self }
    }

    fn origin(&self) -> String {
        let scheme = if self.tls.is_some() { "https" } else { "http" };
        format!("{scheme}://{}", self.address)
    }

    pub(crate) fn get(&self, path: &str) -> Request {
        let mut headers = vec![
            ("Host".to_owned(), self.address.to_string()),
            ("Accept".to_owned(), "text/html".to_owned()),
            ("Connection".to_owned(), "close".to_owned()),
        ];
        headers.extend(self.cookie.clone().map(|cookie| ("Cookie".to_owned(), cookie)));
        Request { method: "GET", path: path.to_owned(), headers, body: String::new() }
    }

    pub(crate) fn post(&self, path: &str, fields: &[(&str, &str)]) -> Request {
        let pairs: Vec<String> =
            fields.iter().map(|(name, value)| format!("{name}={}", encoded(value))).collect();
        let kind = "application/x-www-form-urlencoded";
        let request = Request { method: "POST", ..self.get(path) };
        request
            .with("Origin", &self.origin())
            .with("Content-Type", kind)
            .containing(pairs.join("&"))
    }

    /// Keeps the cookie that was given, as a browser does.
    pub(crate) fn keep_cookie(&mut self, answer: &Answer) {
        let cookie = answer.header("set-cookie").unwrap();
        let (pair, _) = cookie.split_once(';').unwrap();
        self.cookie = Some(pair.to_owned());
    }

    pub(crate) async fn send(&self, request: Request) -> Answer {
        timeout(WITHIN, self.exchange(request)).await.unwrap()
    }

    /// A page.
    pub(crate) async fn open(&self, path: &str) -> Answer {
        self.send(self.get(path)).await
    }

    /// The token of this session's forms.
    pub(crate) async fn token(&self) -> String {
        let page = self.open("/").await.body;
        let (_, rest) = page.split_once("name=\"token\" value=\"").unwrap();
        rest.split_once('"').unwrap().0.to_owned()
    }

    /// A connection whose other end says and reads what it likes.
    pub(crate) async fn connect(&self) -> TcpStream {
        TcpStream::connect(self.address).await.unwrap()
    }

    async fn exchange(&self, request: Request) -> Answer {
        let stream = self.connect().await;
        let text = request.text();
        let bytes = match &self.tls {
            None => said(stream, &text).await,
            Some(config) => {
                let name = ServerName::IpAddress(self.address.ip().into());
                let connected = TlsConnector::from(config.clone()).connect(name, stream).await;
                said(connected.unwrap(), &text).await
            }
        };
        Answer::read(&String::from_utf8(bytes).unwrap())
    }
}

async fn said(mut stream: impl AsyncRead + AsyncWrite + Unpin, text: &str) -> Vec<u8> {
    // Both may end early: a request that is refused need not be read to its end.
    let _ = stream.write_all(text.as_bytes()).await;
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes).await;
    bytes
}

impl Request {
    /// With this header, in the place of any of its name.
    pub(crate) fn with(self, name: &str, value: &str) -> Self {
        let mut without = self.without(name);
        without.headers.push((name.to_owned(), value.to_owned()));
        without
    }

    /// With this header beside any of its name.
    pub(crate) fn also(mut self, name: &str, value: &str) -> Self {
        self.headers.push((name.to_owned(), value.to_owned()));
        self
    }

    pub(crate) fn without(mut self, name: &str) -> Self {
        self.headers.retain(|(other, _)| !other.eq_ignore_ascii_case(name));
        self
    }

    pub(crate) fn by(self, method: &'static str) -> Self {
        Self { method, ..self }
    }

    pub(crate) fn containing(self, body: String) -> Self {
        let length = body.len().to_string();
        Self { body, ..self.with("Content-Length", &length) }
    }

    /// The body in one chunk, which says nothing of the length of the whole.
    pub(crate) fn chunked(self) -> Self {
        let body = format!("{:x}\r\n{}\r\n0\r\n\r\n", self.body.len(), self.body);
        let request = Self { body, ..self };
        request.without("Content-Length").with("Transfer-Encoding", "chunked")
    }

    fn text(&self) -> String {
        let headers: String =
            self.headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        format!("{} {} HTTP/1.1\r\n{headers}\r\n{}", self.method, self.path, self.body)
    }
}

impl Answer {
    fn read(text: &str) -> Self {
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((text, ""));
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
        let (head, body) = (head.to_owned(), body.to_owned());
        Self { status: status.unwrap_or_default(), head, body }
    }

    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let pairs = self.head.lines().filter_map(|line| line.split_once(": "));
        let mut own = pairs.filter(|(other, _)| other.eq_ignore_ascii_case(name));
        own.next().map(|(_, value)| value)
    }
}

fn encoded(value: &str) -> String {
    value.bytes().map(|byte| format!("%{byte:02X}")).collect()
}
