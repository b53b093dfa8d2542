//! `trusswatch health` against made-up servers.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::thread::JoinHandle;

use crate::binary::run;

/// Answers one request with these bytes; what was asked.
fn answers(answer: &'static str) -> (String, JoinHandle<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let answering = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut asked = Vec::new();
        let mut byte = [0];
        while !asked.ends_with(b"\r\n\r\n") && stream.read(&mut byte).unwrap() == 1 {
            asked.push(byte[0]);
        }
        stream.write_all(answer.as_bytes()).unwrap();
        String::from_utf8(asked).unwrap()
    });
    (address, answering)
}

#[test]
fn the_words_are_printed_and_the_exit_code_is_the_condition() {
    for (answer, code, path, flags) in [
        ("HTTP/1.1 200 OK\r\nContent-Length: 6\r\n\r\nready\n", 0, "/readyz", &[] as &[&str]),
        ("HTTP/1.1 503 Nope\r\nContent-Length: 6\r\n\r\nstale\n", 1, "/readyz", &[]),
        ("HTTP/1.1 200 OK\r\nConnection: close\r\n\r\nalive\n", 0, "/healthz", &["--live"]),
    ] {
        let (address, answering) = answers(answer);
        let outcome = run(&[&["health", &address], flags].concat());
        let words = answer.rsplit("\r\n").next().unwrap();
        let expected = (Some(code), words, "");
        assert_eq!((outcome.code, outcome.stdout.as_str(), outcome.stderr.as_str()), expected);
        let asked = answering.join().unwrap();
        assert!(asked.starts_with(&format!("GET {path} HTTP/1.1\r\n")), "{asked}");
        assert!(asked.to_lowercase().contains(&format!("host: {address}")), "{asked}");
    }
}

#[test]
fn another_server_is_a_failure_of_the_network() {
    for (answer, said) in [
        ("HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", "answers 404 on /readyz"),
        ("220 smtp.example.org\r\n\r\n", "127.0.0.1"),
        ("", "127.0.0.1"),
    ] {
        let (address, answering) = answers(answer);
        run(&["health", &address]).fails(4, &[said, &address]);
        answering.join().unwrap();
    }
}

#[test]
fn an_answer_without_end_is_not_waited_for() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    // The system takes the connection; nothing ever reads from it.
    run(&["health", &address, "--timeout", "0.2"]).fails(4, &[&address, "no answer within 200ms"]);
    drop(listener);
    run(&["health", &address]).fails(4, &[&address, "refused"]);
}

#[test]
fn an_address_needs_a_host_and_a_port() {
    for wrong in ["localhost", ":9464", "127.0.0.1:port", "127.0.0.1:99999"] {
        let outcome = run(&["health", wrong]);
        assert_eq!(outcome.code, Some(2), "{wrong}");
        assert!(outcome.stderr.contains("use HOST:PORT"), "{}", outcome.stderr);
    }
}
