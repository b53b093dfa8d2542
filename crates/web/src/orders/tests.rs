//! Orders over a real listener to a stand-in of a diagnoser.

use std::time::Duration;

use tempfile::TempDir;
use tokio::time::{sleep, timeout};
use vocabulary::{Order, OrderKind};

use crate::access::AccessSettings;
use crate::tests::server::{Browser, PageServer, Setup, StandIn, WITHIN};

const COMPONENT: (&str, &str) = ("component", "module1/sensor/g2");

struct Bench {
    page: PageServer,
    stand_in: StandIn,
    state: TempDir,
}

impl Bench {
    async fn new(operator: Option<&str>, read_only: Option<&str>) -> Self {
        let operator = operator.map(|name| name.parse().unwrap());
        let stand_in = StandIn::open(operator.clone()).await;
        let state = tempfile::tempdir().unwrap();
        let access = AccessSettings {
            state: Some(state.path().to_owned()),
            read_only: read_only.map(str::to_owned),
            ..AccessSettings::default()
        };
        let network = Some(stand_in.endpoint.clone());
        let setup = Setup { access, network, operator, ..Setup::default() };
        let page = PageServer::start(setup).await;
        let connected = async {
            while page.shared.observed.session().is_none() {
                sleep(Duration::from_millis(10)).await;
            }
        };
        timeout(WITHIN, connected).await.unwrap();
        Self { page, stand_in, state }
    }

    async fn ada(&self) -> Browser {
        self.page.signed_in(self.state.path(), true).await
    }

    fn came(&self) -> Vec<(OrderKind, Order)> {
        self.stand_in.orders.lock().clone()
    }
}

/// Sends a form; what the next page says.
async fn outcome(browser: &Browser, kind: &str, fields: &[(&str, &str)]) -> String {
    let token = browser.token().await;
    let fields = [fields, &[("token", token.as_str()), ("back", "/")]].concat();
    let answer = browser.send(browser.post(&format!("/order/{kind}"), &fields)).await;
    assert_eq!((answer.status, answer.header("location")), (303, Some("/")), "{answer:?}");
    let shown = browser.open("/").await.body;
    let (_, message) = shown.split_once("<p class=\"message\">").unwrap();
    message.split_once("</p>").unwrap().0.to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn an_order_reaches_the_module_in_the_name_of_the_person() {
    let bench = Bench::new(None, None).await;
    let ada = bench.ada().await;
    let note = ("note", "seen <script>alert(1)</script>");
    let words = outcome(&ada, "acknowledge", &[COMPONENT, note]).await;
    assert_eq!(words, "module1/sensor/g2: acknowledged: now acknowledged, transition 7");
    let (kind, order) = bench.came().pop().unwrap();
    assert_eq!(kind, OrderKind::Acknowledge);
    assert_eq!(order.by, "web");
    assert_eq!(order.on_behalf_of.as_deref(), Some("Ada Lovelace"));
    assert_eq!(order.note.as_deref(), Some(note.1));
    assert!(!ada.open("/").await.body.contains("message"));
    let words = outcome(&ada, "suppress", &[("module", "module1"), ("for", "2h"), note]).await;
    assert!(words.starts_with("module1: suppressed"), "{words}");
    assert_eq!(bench.came().pop().unwrap().1.for_s, Some(7200));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_order_goes_by_the_operator_whose_certificate_the_page_shows() {
    let bench = Bench::new(Some("wall"), None).await;
    let words = outcome(&bench.ada().await, "acknowledge", &[COMPONENT]).await;
    assert!(words.contains("acknowledged"), "{words}");
    let (_, order) = bench.came().pop().unwrap();
    assert_eq!((order.by.as_str(), order.on_behalf_of.as_deref()), ("wall", Some("Ada Lovelace")));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_diagnoser_refuses_and_what_was_not_sent_is_said_and_is_text() {
    let bench = Bench::new(None, None).await;
    let ada = bench.ada().await;
    let words = outcome(&ada, "reset", &[COMPONENT]).await;
    let refused = "module1/sensor/g2: refused: the &lt;b&gt;evidence&lt;/b&gt; is still there";
    assert_eq!(words, refused);
    let came = bench.came().len();
    for (kind, fields, expected) in [
        ("reset", vec![("component", "../../x")], "names no component"),
        ("shelve", vec![COMPONENT, ("for", "2h")], "needs a reason"),
        ("reset", vec![("component", "module9/sensor/g2")], "`module9` was not seen"),
    ] {
        let words = outcome(&ada, kind, &fields).await;
        assert!(words.contains(expected) && words.ends_with("no command was sent"), "{words}");
    }
    assert_eq!(bench.came().len(), came);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_observers_certificate_or_read_only_access_permits_no_commands() {
    let why = "this page shows the certificate of an observer";
    let read_only = Bench::new(None, Some(why)).await;
    let looks = Bench::new(None, None).await;
    for (bench, may_order, words) in [(&read_only, true, why), (&looks, false, "read-only access")]
    {
        let person = bench.page.signed_in(bench.state.path(), may_order).await;
        let page = person.open("/sign-out").await.body;
        let (_, token) = page.split_once("name=\"token\" value=\"").unwrap();
        let (token, _) = token.split_once('"').unwrap();
        let form = person.post("/order/acknowledge", &[COMPONENT, ("token", token)]);
        let answer = person.send(form).await;
        assert!(answer.status == 403 && answer.body.contains(words), "{answer:?}");
        assert!(bench.came().is_empty());
    }
    outcome(&looks.ada().await, "acknowledge", &[COMPONENT]).await;
    assert_eq!(looks.came().len(), 1);
}
