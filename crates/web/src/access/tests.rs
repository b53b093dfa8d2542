//! What is refused, each attempt beside one that is permitted, over a real listener.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use pki::{Authority, Holder, Identity, Library, Lifetime};
use tempfile::TempDir;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

use super::one_time_link::{self, Invitation};
use super::{AccessSettings, one_time_link as make_link};
use crate::listener::PageAccess;
use crate::tests::server::{Answer, Browser, PageServer, Request, Setup};

const COMPONENT: (&str, &str) = ("component", "module1/sensor/g2");

/// A page on this machine, with a directory of links.
async fn page() -> (TempDir, PageServer) {
    let state = tempfile::tempdir().unwrap();
    let access = with_state(state.path());
    (state, PageServer::start(Setup { access, ..Setup::default() }).await)
}

fn with_state(state: &Path) -> AccessSettings {
    AccessSettings { state: Some(state.to_owned()), ..AccessSettings::default() }
}

fn link(state: &Path) -> String {
    let path = make_link(state, &"ada".parse().unwrap(), true, Duration::from_secs(60)).unwrap();
    path.split_once("link=").unwrap().1.to_owned()
}

/// A permitted command; it fails only because there is no network.
async fn order(browser: &Browser) -> Request {
    browser.post("/order/acknowledge", &[COMPONENT, ("token", &browser.token().await)])
}

fn assert_permitted(answer: &Answer) {
    assert_eq!(answer.status, 303, "{answer:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn forms_of_foreign_pages_are_refused() {
    let (state, page) = page().await;
    let ada = page.signed_in(state.path(), true).await;
    let order = order(&ada).await;
    for (name, forged, status) in [
        ("forged origin", order.clone().with("Origin", "http://evil.example"), 403),
        ("no origin", order.clone().without("Origin"), 403),
        ("origin of a sandbox", order.clone().with("Origin", "null"), 403),
        ("two origins", order.clone().also("Origin", "http://evil.example"), 403),
        ("another port", order.clone().with("Origin", "http://127.0.0.1:1"), 403),
        ("cross-site", order.clone().without("Origin").with("Sec-Fetch-Site", "cross-site"), 403),
        ("same-site", order.clone().without("Origin").with("Sec-Fetch-Site", "same-site"), 403),
        ("wrong host", order.clone().with("Host", "evil.example"), 421),
        ("two hosts", order.clone().also("Host", "evil.example"), 400),
        ("no host", order.clone().without("Host"), 421),
        ("no cookie", order.clone().without("Cookie"), 401),
        ("script", order.clone().with("Content-Type", "text/plain"), 415),
        ("no kind", order.clone().without("Content-Type"), 415),
    ] {
        let answer = ada.send(forged).await;
        let is_refused = answer.status == status || (name == "two hosts" && answer.status == 421);
        assert!(is_refused, "{name}: {answer:?}");
    }
    assert_permitted(&ada.send(order.clone()).await);
    let fetched = order.clone().without("Origin").with("Sec-Fetch-Site", "same-origin");
    assert_permitted(&ada.send(fetched).await);
    let port = page.address.port();
    let named = order.with("Host", &format!("localhost:{port}"));
    assert_eq!(ada.send(named.clone()).await.status, 403);
    assert_permitted(&ada.send(named.with("Origin", &format!("http://localhost:{port}"))).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_are_not_read_under_foreign_names() {
    let (_state, page) = page().await;
    let browser = page.browser();
    for host in ["evil.example", &format!("evil.example:{}", page.address.port()), "localhost:1"] {
        let answer = browser.send(browser.get("/").with("Host", host)).await;
        assert_eq!(answer.status, 421, "{host}: {answer:?}");
    }
    assert_eq!(browser.open("/").await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn forms_need_the_token_of_their_session() {
    let (state, page) = page().await;
    let (ada, bob) =
        (page.signed_in(state.path(), true).await, page.signed_in(state.path(), true).await);
    let (own, others) = (ada.token().await, bob.token().await);
    for wrong in [None, Some(""), Some(others.as_str()), Some(&own[1..]), Some("<script>")] {
        for path in ["/order/acknowledge", "/sign-out"] {
            let token = wrong.map(|token| ("token", token));
            let fields: Vec<_> = [COMPONENT].into_iter().chain(token).collect();
            let answer = ada.send(ada.post(path, &fields)).await;
            assert_eq!(answer.status, 403, "{wrong:?}: {answer:?}");
        }
    }
    let twice = ada.post("/order/acknowledge", &[COMPONENT, ("token", &own), ("token", &own)]);
    assert_eq!(ada.send(twice).await.status, 400);
    assert_permitted(&ada.send(order(&ada).await).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn forms_are_short_and_methods_few() {
    let (state, page) = page().await;
    let ada = page.signed_in(state.path(), true).await;
    let token = ada.token().await;
    let note = |length: usize| "a".repeat(length);
    // Three characters for each.
    let long =
        ada.post("/order/acknowledge", &[COMPONENT, ("token", &token), ("note", &note(5500))]);
    assert_eq!(ada.send(long.clone()).await.status, 413);
    assert_eq!(ada.send(long.chunked()).await.status, 413);
    let short =
        ada.post("/order/acknowledge", &[COMPONENT, ("token", &token), ("note", &note(400))]);
    assert_permitted(&ada.send(short.clone()).await);
    for method in ["PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "BREW"] {
        let answer = ada.send(short.clone().by(method)).await;
        assert!(matches!(answer.status, 405 | 400), "{method}: {answer:?}");
        assert!(answer.status != 405 || answer.header("allow") == Some("GET, HEAD, POST"));
    }
    assert_eq!(ada.send(ada.get("/").by("HEAD")).await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_works_once_across_restarts_and_only_by_its_form() {
    let state = tempfile::tempdir().unwrap();
    let start =
        || PageServer::start(Setup { access: with_state(state.path()), ..Setup::default() });
    let (first, secret) = (start().await, link(state.path()));
    let look = format!("/sign-in?link={secret}");
    for _ in 0..3 {
        let preview = first.browser().open(&look).await;
        assert!(preview.status == 200 && preview.header("set-cookie").is_none(), "{preview:?}");
        assert!(preview.body.contains(&format!("name=\"link\" value=\"{secret}\"")));
    }
    drop(first);
    let second = start().await;
    let browser = second.browser();
    let use_it = browser.post("/sign-in", &[("link", &secret)]);
    assert_permitted(&browser.send(use_it.clone()).await);
    let replayed = browser.send(use_it.clone()).await;
    assert!(replayed.status == 403 && replayed.header("set-cookie").is_none(), "{replayed:?}");
    drop(second);
    let third = start().await;
    let browser = third.browser();
    let again = browser.send(browser.post("/sign-in", &[("link", &secret)])).await;
    assert_eq!(again.status, 403, "{again:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn expired_and_invented_links_are_refused() {
    let (state, page) = page().await;
    let browser = page.browser();
    let person = "ada".to_owned();
    let over = Invitation { person, may_order: true, until_unix_s: 1000 };
    let over = one_time_link::invite(state.path(), &over, 0).unwrap();
    for wrong in [over.as_str(), &"0".repeat(64), "../../etc/passwd", ""] {
        let answer = browser.send(browser.post("/sign-in", &[("link", wrong)])).await;
        assert!(answer.status == 403 && answer.header("set-cookie").is_none(), "{answer:?}");
    }
    let good = browser.post("/sign-in", &[("link", &link(state.path()))]);
    assert_permitted(&browser.send(good).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn too_many_failed_attempts_are_refused_but_not_a_valid_link() {
    let (state, page) = page().await;
    let browser = page.browser();
    let made_up = "0".repeat(64);
    for _ in 0..10 {
        let answer = browser.send(browser.post("/sign-in", &[("link", &made_up)])).await;
        assert_eq!(answer.status, 403);
    }
    let another = browser.send(browser.post("/sign-in", &[("link", &made_up)])).await;
    assert_eq!(another.status, 429);
    // Somebody else at the same address may have failed.
    let good = browser.post("/sign-in", &[("link", &link(state.path()))]);
    assert_permitted(&browser.send(good).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn behind_a_proxy_failures_are_those_of_the_address_that_it_appended() {
    let proxy = "https://tower.example";
    let behind_proxy = Some(proxy.parse().unwrap());
    let page = PageAccess { behind_proxy, ..PageAccess::default() };
    let setup = Setup { page, ..Setup::default() };
    let page = PageServer::start(setup).await;
    let browser = page.browser();
    let made_up = "0".repeat(64);
    let attempt = async |forwarded: &str| {
        let request = browser.post("/sign-in", &[("link", &made_up)]).with("Origin", proxy);
        browser.send(request.with("X-Forwarded-For", forwarded)).await.status
    };
    for number in 0..10 {
        // What the client claims before is of no account.
        assert_eq!(attempt(&format!("192.0.2.{number}, 203.0.113.66")).await, 403);
    }
    assert_eq!(attempt("192.0.2.99, 203.0.113.66").await, 429);
    assert_eq!(attempt("203.0.113.66, 198.51.100.5").await, 403);
    // Without a proxy its headers are ignored.
    let bare = PageServer::start(Setup::default()).await;
    let browser = bare.browser();
    for number in 0..11 {
        let request = browser.post("/sign-in", &[("link", &made_up)]);
        let answer = browser.send(request.with("X-Forwarded-For", &format!("192.0.2.{number}")));
        assert_eq!(answer.await.status, if number < 10 { 403 } else { 429 });
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn under_a_path_of_a_proxy_links_redirects_and_cookies_are_of_that_path() {
    let state = tempfile::tempdir().unwrap();
    let access = AccessSettings { require_sign_in: true, ..with_state(state.path()) };
    let behind_proxy = Some("https://tower.example/shm/".parse().unwrap());
    let page = PageAccess { behind_proxy, ..PageAccess::default() };
    let page = PageServer::start(Setup { access, page, ..Setup::default() }).await;
    let mut ada = page.browser();
    let to_sign_in = ada.open("/").await;
    assert_eq!(to_sign_in.header("location"), Some("/shm/sign-in"));
    let secret = link(state.path());
    let form = ada.open(&format!("/sign-in?link={secret}")).await;
    let length = form.body.len().to_string();
    assert_eq!(form.header("content-length"), Some(length.as_str()));
    for part in [r#"href="/shm/page.css""#, r#"action="/shm/sign-in""#, r#"href="/shm/""#] {
        assert!(form.body.contains(part), "{part}: {form:?}");
    }
    // A proxy has the origin of the page, without the path.
    let from_proxy = |request: Request| request.with("Origin", "https://tower.example");
    let entered = ada.send(from_proxy(ada.post("/sign-in", &[("link", &secret)]))).await;
    assert_eq!((entered.status, entered.header("location")), (303, Some("/shm/")));
    let cookie = entered.header("set-cookie").unwrap();
    assert!(cookie.starts_with("__Secure-trusswatch="), "{cookie}");
    assert!(cookie.ends_with("; Path=/shm; HttpOnly; SameSite=Strict; Secure"), "{cookie}");
    ada.keep_cookie(&entered);
    let token = ada.token().await;
    let back = ("back", "/component/module1/sensor/g2");
    let order = ada.post("/order/acknowledge", &[COMPONENT, ("token", &token), back]);
    let ordered = ada.send(from_proxy(order)).await;
    assert_eq!(ordered.header("location"), Some("/shm/component/module1/sensor/g2"));
    let style = ada.open("/page.css").await;
    assert_eq!((style.status, style.body.as_str()), (200, "body {}"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_is_new_at_sign_in_and_gone_after_sign_out() {
    let (state, page) = page().await;
    let mut ada = page.signed_in(state.path(), true).await;
    let before = ada.cookie.clone().unwrap();
    let again = ada.send(ada.post("/sign-in", &[("link", &link(state.path()))])).await;
    ada.keep_cookie(&again);
    assert_ne!(ada.cookie.as_ref(), Some(&before));
    let stolen = ada.clone().with_cookie(before);
    assert!(!stolen.open("/").await.body.contains("class=\"person\""));
    // A session identifier set by another party is never adopted.
    let planted = ada.clone().with_cookie(format!("trusswatch={}", "a".repeat(64)));
    let answer = planted.send(planted.post("/sign-in", &[("link", &link(state.path()))])).await;
    assert!(!answer.header("set-cookie").unwrap().contains(&"a".repeat(64)));
    assert!(!planted.open("/").await.body.contains("class=\"person\""));
    assert!(ada.open("/").await.body.contains("class=\"person\""));
    let out = ada.send(ada.post("/sign-out", &[("token", &ada.token().await)])).await;
    assert_permitted(&out);
    assert!(out.header("set-cookie").unwrap().contains("Max-Age=0"));
    assert!(!ada.open("/").await.body.contains("class=\"person\""));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_name_with_a_script_is_text_and_paths_lead_nowhere_else() {
    let (state, page) = page().await;
    let person = "<script>alert(1)</script>".parse().unwrap();
    let path = make_link(state.path(), &person, true, Duration::from_secs(60)).unwrap();
    let mut browser = page.browser();
    let (_, secret) = path.split_once("link=").unwrap();
    let answer = browser.send(browser.post("/sign-in", &[("link", secret)])).await;
    browser.keep_cookie(&answer);
    for path in ["/", "/sign-in", "/sign-out"] {
        let body = browser.open(path).await.body;
        assert!(body.contains("&lt;script&gt;alert(1)"), "{path}: {body}");
        assert!(!body.contains("<script>alert"), "{path}: {body}");
    }
    for path in [
        "/assets/../Cargo.toml",
        "/assets/%2e%2e/Cargo.toml",
        "/assets/..%2fCargo.toml",
        "/component/..%2f..%2f/sensor/g2",
        "/component/module1/sensor/%3Cscript%3E",
    ] {
        let answer = browser.open(path).await;
        let is_harmless = answer.status == 404
            || answer.body.contains("usable")
            || answer.body.contains("names no");
        assert!(is_harmless && !answer.body.contains("<script>"), "{path}: {answer:?}");
    }
    assert_eq!(browser.open("/page.css").await.status, 200);
    assert!(browser.open("/component/module1/sensor/g2").await.body.contains("module1/sensor/g2"));
}

#[tokio::test(flavor = "multi_thread")]
async fn no_form_puts_a_header_into_an_answer() {
    let (state, page) = page().await;
    let ada = page.signed_in(state.path(), true).await;
    let token = ada.token().await;
    let back = async |back: &str| {
        let fields = [COMPONENT, ("token", token.as_str()), ("back", back)];
        let answer = ada.send(ada.post("/order/acknowledge", &fields)).await;
        assert!(answer.header("x-evil").is_none() && !answer.head.contains("evil"), "{answer:?}");
        answer.header("location").unwrap().to_owned()
    };
    for foreign in ["//evil.example", "https://evil.example", "/\\evil.example", "/a\r\nX-Evil: 1"]
    {
        assert_eq!(back(foreign).await, "/");
    }
    assert_eq!(back("/component/module1/sensor/g2").await, "/component/module1/sensor/g2");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_answer_says_what_a_browser_must_not_do() {
    let (state, page) = page().await;
    let ada = page.signed_in(state.path(), true).await;
    let refused = ada.get("/").with("Host", "evil.example");
    for request in [ada.get("/"), ada.get("/missing"), refused, ada.get("/page.css")] {
        let answer = ada.send(request).await;
        let policy = answer.header("content-security-policy").unwrap();
        for part in ["default-src 'none'", "frame-ancestors 'none'", "form-action 'self'"] {
            assert!(policy.contains(part), "{policy}");
        }
        for (name, value) in [
            ("x-frame-options", "DENY"),
            ("x-content-type-options", "nosniff"),
            ("referrer-policy", "same-origin"),
            ("cross-origin-opener-policy", "same-origin"),
            ("cross-origin-resource-policy", "same-origin"),
        ] {
            assert_eq!(answer.header(name), Some(value), "{answer:?}");
        }
        assert!(answer.header("strict-transport-security").is_none());
    }
    assert_eq!(ada.open("/").await.header("cache-control"), Some("no-store"));
    assert_eq!(ada.open("/page.css").await.header("cache-control"), Some("max-age=60"));
}

#[tokio::test(flavor = "multi_thread")]
async fn where_signing_in_is_required_others_see_nothing() {
    let state = tempfile::tempdir().unwrap();
    let access = AccessSettings { require_sign_in: true, ..with_state(state.path()) };
    let page = PageServer::start(Setup { access, ..Setup::default() }).await;
    let stranger = page.browser();
    let led = stranger.open("/").await;
    assert_eq!((led.status, led.header("location")), (303, Some("/sign-in")));
    let stream = stranger.get("/component/module1/sensor/g2").with("Accept", "text/event-stream");
    assert_eq!(stranger.send(stream.clone()).await.status, 401);
    for open in ["/sign-in", "/page.css"] {
        assert_eq!(stranger.open(open).await.status, 200);
    }
    let ada = page.signed_in(state.path(), false).await;
    assert_eq!(ada.open("/").await.status, 200);
}

/// A structure's authority, with a page that shows one of its certificates.
struct Secured {
    folder: TempDir,
    authority: Authority,
    page: PageServer,
}

impl Secured {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let structure = "tower".parse().unwrap();
        let authority = Authority::create(folder.path(), structure, Lifetime::of_days(30)).unwrap();
        let own = issue(folder.path(), &authority, "observer.page", &["127.0.0.1"]);
        let page = PageAccess {
            page_certificate: Some(own.certificate),
            page_key: Some(own.key),
            page_authority: Some(own.authority),
            ..PageAccess::default()
        };
        let revoked = folder.path().join("revoked");
        std::fs::create_dir(&revoked).unwrap();
        let access = AccessSettings { revoked: Some(revoked), ..with_state(folder.path()) };
        let setup = Setup { access, page, ..Setup::default() };
        Self { page: PageServer::start(setup).await, folder, authority }
    }

    fn issue(&self, holder: &str) -> Identity {
        issue(self.folder.path(), &self.authority, holder, &[])
    }

    /// A browser that shows this certificate.
    fn browser(&self, shown: Option<&Identity>) -> Browser {
        let authority = Library::at(self.folder.path()).identity(&"observer.page".parse().unwrap());
        self.page.browser().over(client(&authority.authority, shown))
    }

    async fn signed_in_by(&self, identity: &Identity) -> (Browser, Answer) {
        let mut browser = self.browser(Some(identity));
        let answer = browser.send(browser.post("/sign-in", &[])).await;
        if answer.status == 303 {
            browser.keep_cookie(&answer);
        }
        (browser, answer)
    }
}

fn issue(library: &Path, authority: &Authority, holder: &str, addresses: &[&str]) -> Identity {
    let holder: Holder = holder.parse().unwrap();
    let addresses: Vec<_> = addresses.iter().map(|address| address.parse().unwrap()).collect();
    let place = Library::at(library).place_of(&holder);
    authority.issue(&place, holder, &addresses, Lifetime::of_days(20)).unwrap()
}

fn certificates(file: &PathBuf) -> Vec<CertificateDer<'static>> {
    CertificateDer::pem_file_iter(file).unwrap().map(Result::unwrap).collect()
}

fn client(authority: &PathBuf, shown: Option<&Identity>) -> ClientConfig {
    let mut roots = RootCertStore::empty();
    roots.add_parsable_certificates(certificates(authority));
    let builder = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots);
    match shown {
        None => builder.with_no_client_auth(),
        Some(identity) => {
            let key = PrivateKeyDer::from_pem_file(&identity.key).unwrap();
            builder.with_client_auth_cert(certificates(&identity.certificate), key).unwrap()
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_operators_certificate_signs_in_and_no_certificate_does_not() {
    let secured = Secured::new().await;
    let ada = secured.issue("operator.ada");
    let anonymous = secured.browser(None);
    assert_eq!(anonymous.open("/").await.status, 200);
    assert_eq!(anonymous.send(anonymous.post("/sign-in", &[])).await.status, 403);
    let (browser, answer) = secured.signed_in_by(&ada).await;
    let cookie = answer.header("set-cookie").unwrap();
    assert!(cookie.starts_with("__Host-trusswatch="), "{cookie}");
    for attribute in ["Secure", "HttpOnly", "SameSite=Strict", "Path=/"] {
        assert!(cookie.split("; ").any(|part| part == attribute), "{cookie}");
    }
    assert!(answer.header("strict-transport-security").is_some());
    assert!(browser.open("/").await.body.contains("<p class=\"person\">ada</p>"));
    assert_permitted(&browser.send(order(&browser).await).await);
    // The cookie alone is of no use, neither to a thief without certificate nor to one with another.
    let other = secured.issue("operator.bob");
    let cookie_of_ada = browser.cookie.unwrap();
    for shown in [None, Some(&other)] {
        let thief = secured.browser(shown).with_cookie(cookie_of_ada.clone());
        assert!(!thief.open("/").await.body.contains("class=\"person\""));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_observer_looks_and_orders_nothing() {
    let secured = Secured::new().await;
    let (wall, _) = secured.signed_in_by(&secured.issue("observer.wall")).await;
    let page = wall.open("/sign-out").await.body;
    let (_, token) = page.split_once("name=\"token\" value=\"").unwrap();
    let (token, _) = token.split_once('"').unwrap();
    let order = wall.send(wall.post("/order/acknowledge", &[COMPONENT, ("token", token)])).await;
    assert_eq!(order.status, 403, "{order:?}");
    assert!(order.body.contains("has read-only access"), "{order:?}");
    let (machine, answer) = secured.signed_in_by(&secured.issue("module1")).await;
    assert!(answer.status == 403 && machine.cookie.is_none(), "{answer:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn revoking_a_certificate_prevents_signing_in_and_ends_its_session() {
    let secured = Secured::new().await;
    let ada = secured.issue("operator.ada");
    let (browser, _) = secured.signed_in_by(&ada).await;
    assert!(browser.open("/").await.body.contains("class=\"person\""));
    std::fs::write(secured.folder.path().join("revoked/operator.ada.pem"), "").unwrap();
    assert!(!browser.open("/").await.body.contains("class=\"person\""));
    let (_, answer) = secured.signed_in_by(&ada).await;
    assert!(answer.status == 403 && answer.body.contains("is revoked"), "{answer:?}");
    let (_, answer) = secured.signed_in_by(&secured.issue("operator.bob")).await;
    assert_permitted(&answer);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_certificate_of_another_authority_and_plain_http_get_no_page() {
    let (secured, other) = (Secured::new().await, Secured::new().await);
    let stranger = secured.browser(Some(&other.issue("operator.ada")));
    assert_eq!(stranger.send(stranger.post("/sign-in", &[])).await.status, 0);
    let address: SocketAddr = secured.page.address;
    assert_eq!(Browser::at(address).open("/").await.status, 0);
    let ada = secured.browser(Some(&secured.issue("operator.ada")));
    assert_eq!(ada.open("/").await.status, 200);
    assert_eq!(ada.open("/over").await.body, "operator.ada");
}
