//! What a real server sends, with and without a network.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use http_body_util::{BodyExt, Empty};
use hyper::body::{Bytes, Incoming};
use hyper::client::conn::http1;
use hyper::{Request, Response, StatusCode};
use hyper_util::rt::TokioIo;
use session::Network;
use shell::shutdown::{Trigger, pair};
use shell::supervision::Supervisor;
use tokio::net::TcpSocket;
use tokio::task::JoinHandle;
use tokio::time::timeout;
use vocabulary::{FaultState, FaultTransition, Key, Message, Topic};
use zenoh::Session;

use crate::app::{Shared, router};
use crate::listener::{Listener, PageAccess};
use crate::server::{WebConfig, app};
use crate::testing::{component, latched, status};
use crate::tests::server::Browser;

/// However loaded the machine is.
const SOON: Duration = Duration::from_secs(60);

/// A server, as `trusswatch web` is one.
struct Server {
    app: Shared,
    address: SocketAddr,
    trigger: Trigger,
    serving: JoinHandle<()>,
}

impl Server {
    async fn start(network: Network) -> Server {
        Server::with(network, None).await
    }

    /// With a state directory, signing in is required.
    async fn with(network: Network, state_dir: Option<PathBuf>) -> Server {
        let (trigger, shutdown) = pair();
        let access = PageAccess { require_sign_in: state_dir.is_some(), ..PageAccess::default() };
        let listen = "127.0.0.1:0".parse().unwrap();
        let listener = Listener::bind(listen, &access).await.unwrap();
        let address = listener.address().unwrap();
        let config = WebConfig {
            network,
            structure: None,
            expected: vec!["m9".parse().unwrap()],
            listen,
            access,
            drawing: None,
            state_dir,
            notifier: None,
            timeout: Duration::from_secs(1),
        };
        let supervisor = Supervisor::from_environment();
        supervisor.progress();
        let app = app(config, &supervisor, shutdown.clone()).unwrap();
        let serving = tokio::spawn(listener.serve(router(app.clone()), shutdown));
        Server { app, address, trigger, serving }
    }

    async fn get(&self, path: &str) -> Response<Incoming> {
        self.get_from(1, None, path).await
    }

    /// Likewise, from 127.0.0.`last` and with this cookie.
    async fn get_from(&self, last: u8, cookie: Option<&str>, path: &str) -> Response<Incoming> {
        let socket = TcpSocket::new_v4().unwrap();
        socket.bind((Ipv4Addr::new(127, 0, 0, last), 0).into()).unwrap();
        let stream = socket.connect(self.address).await.unwrap();
        let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await.unwrap();
        tokio::spawn(connection);
        let request = Request::get(path).header("host", self.address.to_string());
        let request =
            cookie.into_iter().fold(request, |request, pair| request.header("cookie", pair));
        let request = request.body(Empty::<Bytes>::new()).unwrap();
        timeout(SOON, sender.send_request(request)).await.unwrap().unwrap()
    }

    async fn text(&self, path: &str) -> (StatusCode, String) {
        let answer = self.get(path).await;
        let status = answer.status();
        let body = timeout(SOON, answer.into_body().collect()).await.unwrap().unwrap();
        (status, String::from_utf8(body.to_bytes().to_vec()).unwrap())
    }
}

/// Reads a stream until these words have come.
async fn until(stream: &mut Response<Incoming>, words: &str) -> String {
    let mut text = String::new();
    while !text.contains(words) {
        let frame = timeout(SOON, stream.body_mut().frame()).await;
        let frame = frame.unwrap_or_else(|_| panic!("no `{words}` in {text}"));
        let bytes = frame.unwrap().unwrap().into_data().unwrap();
        text.push_str(&String::from_utf8_lossy(&bytes));
    }
    text
}

/// A place on the network for the server, and a session that plays a diagnoser there.
async fn diagnoser() -> (Network, Session) {
    let [endpoint] = session::loopback::endpoints().unwrap();
    let listening = Network { listen: vec![endpoint.clone()], ..Network::default() };
    let session = session::open(&listening).await.unwrap();
    (Network { connect: vec![endpoint], ..Network::default() }, session)
}

async fn publish<M: Message>(session: &Session, topic: Topic, message: &M) {
    let key = Key::of_module(&"tower".parse().unwrap(), &"m1".parse().unwrap(), topic).to_string();
    session.put(key, vocabulary::encode(message).unwrap()).await.unwrap();
}

/// Publishes a state until the server has it: what is published before the link is up is lost.
async fn publish_until_known(server: &Server, session: &Session, fault: &FaultTransition) {
    let mut scenes = server.app.observed.live.scenes();
    let known = async {
        loop {
            publish(session, Topic::Status, &status("m1")).await;
            publish(session, Topic::Fault(fault.component.component.clone()), fault).await;
            let has = |scene: &std::sync::Arc<observer::Scene>| {
                scene.component(None, &fault.component).is_some_and(|c| c.state() == fault.state())
            };
            if timeout(Duration::from_millis(300), scenes.wait_for(has)).await.is_ok() {
                return;
            }
        }
    };
    timeout(SOON, known).await.unwrap();
}

#[test]
fn without_a_network_every_page_says_so_and_the_process_is_live() {
    let runtime =
        tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.unwrap();
    let outcome = runtime.block_on(async { tokio::spawn(without_a_network()).await });
    // A client waits for its router without yielding: the runtime cannot wait for it.
    runtime.shutdown_background();
    outcome.unwrap();
}

async fn without_a_network() {
    let nowhere = Network {
        mode: Some(session::Mode::Client),
        connect: session::loopback::endpoints::<1>().unwrap().to_vec(),
        ..Network::default()
    };
    let server = Server::start(nowhere).await;
    for path in ["/", "/events", "/history"] {
        let (status, page) = server.text(path).await;
        assert_eq!(status, StatusCode::OK, "{path}");
        assert!(page.contains("the present state is unknown"), "{path}: {page}");
    }
    let (_, overview) = server.text("/").await;
    assert!(overview.contains("NOT KNOWN") && overview.contains("m9"), "{overview}");
    assert_eq!(server.text("/healthz").await.0, StatusCode::OK);
    assert!(server.text("/metrics").await.1.contains("trusswatch_web_requests_total 6"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_made_up_is_refused_by_name_and_begins_no_work() {
    let (network, _session) = diagnoser().await;
    let server = Server::start(network).await;
    for (path, status, words) in [
        (
            "/component/m1/sensor/none",
            StatusCode::NOT_FOUND,
            "nothing is known of `m1/sensor/none`",
        ),
        ("/component/m1/engine/x", StatusCode::NOT_FOUND, "engine"),
        ("/component/..%2F..%2Fetc/sensor/g1", StatusCode::NOT_FOUND, "Not known"),
        ("/module/none", StatusCode::NOT_FOUND, "nothing is known of a module `none`"),
        ("/history?from=yesterday", StatusCode::BAD_REQUEST, "from: invalid time `yesterday`"),
        ("/etc/passwd", StatusCode::NOT_FOUND, "Page not found"),
        ("/stream?page=component&of=m1/sensor/none", StatusCode::NOT_FOUND, "no component"),
        ("/fragments?page=all", StatusCode::NOT_FOUND, "use `overview`"),
    ] {
        let (answered, text) = server.text(path).await;
        assert_eq!(answered, status, "{path}: {text}");
        assert!(text.contains(words), "{path}: {text}");
    }
    assert_eq!(server.app.streams.pages.len(), 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fault_is_sent_by_stream_and_polling_and_rendered_once() {
    let (network, session) = diagnoser().await;
    let server = Server::start(network).await;
    let mut first = server.get("/stream?page=overview").await;
    assert_eq!(first.headers()["content-type"], "text/event-stream");
    let mut second = server.get("/stream?page=overview").await;
    let normal = component("m1/sensor/g1", FaultState::Normal);
    publish_until_known(&server, &session, &normal).await;
    publish_until_known(&server, &session, &latched("m1/sensor/g1")).await;
    for stream in [&mut first, &mut second] {
        let text = until(stream, "alarm latched").await;
        assert!(text.contains(r#""id":"alarms""#) && text.contains("data: ["), "{text}");
    }
    let (_, polled) = server.text("/fragments?page=overview").await;
    // A page whose session has ended receives the signed-out state.
    assert!(
        polled.contains(r#"{"id":"person","html":"<a class=\"person\" href=\"/sign-in\""#),
        "{polled}"
    );
    assert!(polled.starts_with('[') && polled.contains("alarm latched"), "{polled}");
    // A hidden tab receives it, too.
    assert!(
        polled.contains(r#""id":"title","html":"("#) && polled.contains("/alarm.svg"),
        "{polled}"
    );
    assert_eq!(server.app.streams.pages.len(), 1, "one rendering for all who look");
    let mut component = server.get("/stream?page=component&of=m1/sensor/g1").await;
    let text = until(&mut component, "No freeze frame").await;
    assert!(
        !text.contains("no fault is declared"),
        "nothing was answered yet, and it was said: {text}"
    );
    let (status, page) = server.text("/component/m1/sensor/g1").await;
    assert_eq!(status, StatusCode::OK);
    assert!(page.contains("latched") && page.contains("data-live=\"page=component"), "{page}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn beyond_its_places_a_stream_is_refused_and_polling_goes_on() {
    let (network, _session) = diagnoser().await;
    let server = Server::start(network).await;
    let mut streams = Vec::new();
    for number in 0..256 {
        let last = 1 + (number % 4) as u8;
        streams.push(server.get_from(last, None, "/stream?page=events").await);
    }
    assert!(streams.iter().all(|stream| stream.status() == StatusCode::OK));
    let refused = server.get("/stream?page=events").await;
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(server.text("/fragments?page=events").await.0, StatusCode::OK);
    assert_eq!(server.app.streams.open(), 256);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stream_ends_with_its_session_and_polling_is_refused_then() {
    let (network, _session) = diagnoser().await;
    let state = tempfile::tempdir().unwrap();
    let server = Server::with(network, Some(state.path().to_owned())).await;
    let mut ada = Browser::at(server.address);
    let minute = Duration::from_secs(60);
    let link = crate::one_time_link(state.path(), &"ada".parse().unwrap(), true, minute).unwrap();
    let (_, secret) = link.split_once("link=").unwrap();
    let signed_in = ada.send(ada.post("/sign-in", &[("link", secret)])).await;
    ada.keep_cookie(&signed_in);
    let cookie = ada.cookie.clone();
    let ask = async |path: &str| server.get_from(1, cookie.as_deref(), path).await;
    let mut stream = ask("/stream?page=overview").await;
    let text = until(&mut stream, "counts").await;
    assert!(text.contains(r#""id":"person""#) && text.contains("<b>ada</b>"), "{text}");
    assert_eq!(ask("/fragments?page=overview").await.status(), StatusCode::OK);
    let page = ada.open("/sign-out").await.body;
    let (_, token) = page.split_once("name=\"token\" value=\"").unwrap();
    let (token, _) = token.split_once('"').unwrap();
    assert_eq!(ada.send(ada.post("/sign-out", &[("token", token)])).await.status, 303);
    // What was on its way may still come; then the stream ends.
    timeout(SOON, stream.into_body().collect()).await.unwrap().unwrap();
    for path in ["/stream?page=overview", "/fragments?page=overview"] {
        assert_eq!(ask(path).await.status(), StatusCode::UNAUTHORIZED, "{path}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn open_streams_end_with_the_process() {
    let (network, _session) = diagnoser().await;
    let server = Server::start(network).await;
    let mut stream = server.get("/stream?page=overview").await;
    until(&mut stream, "counts").await;
    server.trigger.pull();
    timeout(SOON, server.serving).await.unwrap().unwrap();
}
