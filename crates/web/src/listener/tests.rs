//! Browsers that are silent, slow or gone.

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::time::timeout;

use super::{ListenError, Listener, ListenerSettings};
use crate::test_server::{PageServer, Setup, WITHIN};

#[tokio::test(flavor = "multi_thread")]
async fn the_end_waits_for_no_page_that_stays_open() {
    let page = PageServer::start(Setup::default()).await;
    let mut endless = page.browser().connect().await;
    let request = format!("GET /endless HTTP/1.1\r\nHost: {}\r\n\r\n", page.address);
    endless.write_all(request.as_bytes()).await.unwrap();
    let mut begun = [0; 12];
    timeout(WITHIN, endless.read_exact(&mut begun)).await.unwrap().unwrap();
    assert_eq!(&begun, b"HTTP/1.1 200");
    // Neither connection ever ends by itself.
    let silent = page.browser().connect().await;
    page.trigger.pull();
    timeout(WITHIN, page.task).await.unwrap().unwrap();
    // The address is free.
    drop((endless, silent));
    TcpListener::bind(page.address).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_browser_that_does_not_ask_to_the_end_is_disconnected_and_others_are_served() {
    let page = PageServer::start(Setup::default()).await;
    let mut slow = page.browser().connect().await;
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").await.unwrap();
    assert_eq!(page.browser().open("/").await.status, 200);
    let mut said = Vec::new();
    // Its connection ends, whichever way.
    let _ = timeout(WITHIN, slow.read_to_end(&mut said)).await.unwrap();
    assert!(!said.starts_with(b"HTTP/1.1 200"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_port_in_use_and_files_that_are_none_are_named() {
    let page = PageServer::start(Setup::default()).await;
    let listen = vec![page.address];
    let settings = ListenerSettings { listen, tls: None, behind_proxy: None, names: Vec::new() };
    let error = Listener::bind(&settings).await.err().unwrap();
    assert!(error.to_string().contains(&page.address.to_string()), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("certificate.pem");
    std::fs::write(&file, "nothing").unwrap();
    let tls = super::TlsFiles { certificate: file.clone(), key: file, authority: None };
    let error =
        Listener::bind(&ListenerSettings { tls: Some(tls), ..settings }).await.err().unwrap();
    assert!(matches!(error, ListenError::File { .. }), "{error}");
    assert!(error.to_string().contains("certificate.pem"), "{error}");
}
