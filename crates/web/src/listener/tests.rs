//! Browsers that are silent, slow or gone.

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::time::timeout;

use super::{ListenError, Listener, OF_SOURCE, PageAccess};
use crate::tests::server::{PageServer, Setup, WITHIN};

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

/// A connection from another address of this computer, which asks for the overview.
async fn ask_from(last: u8, page: &PageServer) -> TcpStream {
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind(([127, 0, 0, last], 0).into()).unwrap();
    let mut stream = socket.connect(page.address).await.unwrap();
    let head = format!("GET / HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", page.address);
    let _ = stream.write_all(head.as_bytes()).await;
    stream
}

async fn said(mut stream: TcpStream) -> Vec<u8> {
    let mut said = Vec::new();
    let _ = timeout(WITHIN, stream.read_to_end(&mut said)).await.unwrap();
    said
}

/// Takes all places of one client, with pages that never end.
async fn crowd(page: &PageServer) -> Vec<TcpStream> {
    let request = format!("GET /endless HTTP/1.1\r\nHost: {}\r\n\r\n", page.address);
    let mut crowd = Vec::new();
    for _ in 0..OF_SOURCE {
        let mut stream = page.browser().connect().await;
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut begun = [0; 12];
        timeout(WITHIN, stream.read_exact(&mut begun)).await.unwrap().unwrap();
        crowd.push(stream);
    }
    crowd
}

#[tokio::test(flavor = "multi_thread")]
async fn one_client_takes_only_its_share_of_the_places() {
    let page = PageServer::start(Setup::default()).await;
    let crowd = crowd(&page).await;
    assert!(said(ask_from(1, &page).await).await.is_empty(), "one more than its share");
    assert!(said(ask_from(2, &page).await).await.starts_with(b"HTTP/1.1 200"));
    drop(crowd);
    let again = async {
        while said(ask_from(1, &page).await).await.is_empty() {
            tokio::task::yield_now().await;
        }
    };
    timeout(WITHIN, again).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_proxy_takes_places_for_all_its_clients() {
    let behind_proxy = Some("https://tower.example".parse().unwrap());
    let page = PageAccess { behind_proxy, ..PageAccess::default() };
    let page = PageServer::start(Setup { page, ..Setup::default() }).await;
    let _crowd = crowd(&page).await;
    assert!(said(ask_from(1, &page).await).await.starts_with(b"HTTP/1.1 200"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_port_in_use_and_files_that_are_none_are_named() {
    let page = PageServer::start(Setup::default()).await;
    let error = Listener::bind(page.address, &PageAccess::default()).await.err().unwrap();
    assert!(error.to_string().contains(&page.address.to_string()), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("certificate.pem");
    std::fs::write(&file, "nothing").unwrap();
    let (page_certificate, page_key) = (Some(file.clone()), Some(file));
    let access = PageAccess { page_certificate, page_key, ..PageAccess::default() };
    let error = Listener::bind(page.address, &access).await.err().unwrap();
    assert!(matches!(error, ListenError::File { .. }), "{error}");
    assert!(error.to_string().contains("certificate.pem"), "{error}");
}
