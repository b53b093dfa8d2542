//! Messages for the tests of this crate.

use wire::ModuleStatus;

/// A status of a module of the tower that names these peers.
pub(crate) fn status(module: &str, peers: &[&str]) -> ModuleStatus {
    let peer = |peer: &&str| {
        format!(
            r#"{{"module":"{peer}","present":false,"latest":null,"reason":null,"answered":0,
            "refused":0,"timed_out":0,"absent":0,"malformed":0}}"#
        )
    };
    let peers: Vec<String> = peers.iter().map(peer).collect();
    let counters = r#"{"samples":0,"samples_missing":0,"samples_repeated":0,
        "samples_wrong_length":0,"samples_non_finite":0,"runs":0,"restarts":0,"changes":0,
        "questions_asked":0,"questions_unanswered":0,"answers_malformed":0,"answers_given":0,
        "questions_refused":0}"#;
    let text = format!(
        r#"{{"v":1,"structure":"tower","module":"{module}","software":"0","thresholds":"",
        "phase":"in_service","in_service_since_step":1,"run":1,"step":9,"lag_ms":1.0,
        "queued_samples":0,"latched":0,"unconfirmed":0,"waiting_questions":0,"next_sequence":1,
        "peers":[{}],"intake":{{"received":0,"dropped":0,"malformed":0,"unknown_version":0,
        "wrong_message":0,"other_module":0}},"diagnosis":{counters},
        "publisher":{{"events":0,"events_lost":0}},"time_unix_ns":5}}"#,
        peers.join(",")
    );
    wire::decode(text.as_bytes()).unwrap()
}
