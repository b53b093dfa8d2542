//! `trusswatch router`: runs a router that enforces access control.
//!
//! It is only a Zenoh session in router mode, for networks without Zenoh's own `zenohd`. It logs access control
//! refusals, and says when it is what limits the network. The watchdog heartbeat is sent while queries without a
//! recipient pass through the router and return.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use session::{CertificateWatch, Network, NetworkError, NetworkFlags};
use settings::ConfigErrors;
use shell::clock::unix_ns;
use shell::exit::{Failure, conclude};
use shell::health::{
    HealthCondition, HealthFlags, Listening, ProcessReport, Subject, live, render, thread_times,
};
use shell::opening::open_unless;
use shell::shutdown::{Shutdown, ShutdownFlags};
use shell::supervision::{OPENING, Pulse, Supervisor};
use shell::{logging, runtime};
use vocabulary::Occurrences;
use vocabulary::keys::UNOWNED;
use zenoh::Session;

/// The status while the router runs.
const FORWARDING: &str = "forwarding messages under access control";
/// Interval of queries without a recipient.
const EVERY: Duration = Duration::from_millis(250);
/// Timeout of such a query.
const TIMEOUT: Duration = Duration::from_secs(1);
/// Interval of saying that a certificate expires soon.
const REMIND_EVERY: Duration = Duration::from_secs(24 * 3600);
/// Interval over which the load is measured.
const LOAD_EVERY: Duration = Duration::from_secs(5);
/// A thread with more than this share of a core is near the limit of the router,
const NEAR_LIMIT: f64 = 0.85;
/// and so is a router whose own queries take longer than this.
const SLOW: Duration = Duration::from_millis(50);

/// Route messages between modules, operators and observers, and enforce access control
///
/// A Zenoh router with settings like those of `trusswatch pki access`, until SIGTERM or SIGINT. It logs
/// refusals on standard error.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Zenoh's own settings (JSON5), with the mode `router`
    #[arg(long, value_name = "FILE")]
    zenoh: PathBuf,
    #[command(flatten)]
    network: NetworkFlags,
    #[command(flatten)]
    health: HealthFlags,
}

pub(crate) fn run(arguments: Arguments) -> ExitCode {
    logging::start();
    let NetworkFlags { listen, connect, tls } = arguments.network;
    let zenoh = Some(arguments.zenoh);
    let network = Network { listen, connect, zenoh, tls, ..Network::default() };
    conclude(forward(&network, &arguments.health))
}

fn forward(network: &Network, health: &HealthFlags) -> Result<(), Failure> {
    check(network)?;
    let mut errors = ConfigErrors(Vec::new());
    let address = health.address_or(None, &mut errors);
    let listening = Listening::on(errors.or(address)?)?;
    runtime::until_done(ShutdownFlags::default(), |mut shutdown| async move {
        let supervisor = Supervisor::from_environment();
        let load = Arc::<Mutex<Option<RouterLoad>>>::default();
        let certificates = CertificateWatch::start(network.certificates());
        let subject = RouterHealth {
            pulse: supervisor.pulse(),
            load: Arc::clone(&load),
            certificates: certificates.clone(),
        };
        let served = listening.serve(subject);
        let _server = served.map_err(|error| Failure::running("health cannot be served", error))?;
        supervisor.status(OPENING);
        let Some(session) = open_unless(network, &mut shutdown).await? else {
            return Ok(());
        };
        tracing::info!("ready");
        supervisor.ready(FORWARDING);
        serve(&session, &supervisor, (&load, &certificates), shutdown).await;
        supervisor.stopping();
        session::close(&session).await;
        tracing::info!("stopped");
        Ok(())
    })
}

/// Monitors the session, which runs on its own: a query through its tables shows that it works.
async fn serve(
    session: &Session,
    supervisor: &Supervisor,
    (load, certificates): (&Mutex<Option<RouterLoad>>, &CertificateWatch),
    mut shutdown: Shutdown,
) {
    // It was said at the start.
    let mut reminded = Instant::now();
    let (mut measured, mut before, mut round_trip) =
        (Instant::now(), thread_times(), Duration::ZERO);
    let near_limit = Occurrences::default();
    loop {
        let asked = Instant::now();
        tokio::select! {
            () = shutdown.requested() => return,
            returned = ends_unanswered(session) => if returned {
                supervisor.progress();
                round_trip = round_trip.max(asked.elapsed());
            } else {
                round_trip = TIMEOUT;
            },
        }
        if measured.elapsed() >= LOAD_EVERY {
            let (now, times) = (Instant::now(), thread_times());
            let present = RouterLoad::new(&before, &times, now - measured, round_trip);
            (measured, before, round_trip) = (now, times, Duration::ZERO);
            *load.lock() = Some(present.clone());
            let expiring = certificates.expiring(unix_ns() / 1_000_000_000);
            supervisor.status(&status(&present, &expiring));
            if reminded.elapsed() >= REMIND_EVERY {
                expiring.iter().for_each(|words| tracing::warn!("{words}"));
                reminded = now;
            }
            if let Some(times) = present.is_near_limit().then(|| near_limit.note(now)).flatten() {
                tracing::warn!(
                    times,
                    "router near its limit: {present}; \
                     publish samples in blocks, or link another router"
                );
            }
        }
        tokio::select! {
            () = shutdown.requested() => return,
            () = tokio::time::sleep(EVERY) => {}
        }
    }
}

/// The load, and which certificates expire soon.
fn status(load: &RouterLoad, expiring: &[String]) -> String {
    let expiring: String = expiring.iter().map(|words| format!("; {words}")).collect();
    format!("{FORWARDING}; {load}{expiring}")
}

/// Load of a router in an interval.
#[derive(Debug, Clone, PartialEq)]
struct RouterLoad {
    /// Cores in use.
    cores: f64,
    /// The busiest thread, and its share of a core.
    busiest: (String, f64),
    /// Longest time of a query; [`TIMEOUT`] if one did not return.
    round_trip: Duration,
}

impl RouterLoad {
    /// From the threads' processor times at the ends of the interval.
    fn new(
        before: &BTreeMap<i32, (String, f64)>,
        after: &BTreeMap<i32, (String, f64)>,
        elapsed: Duration,
        round_trip: Duration,
    ) -> Self {
        let share = |(number, (name, time_s)): (&i32, &(String, f64))| {
            let earlier_s = before.get(number).map_or(0.0, |(_, time_s)| *time_s);
            (name.clone(), (time_s - earlier_s) / elapsed.as_secs_f64())
        };
        let shares: Vec<(String, f64)> = after.iter().map(share).collect();
        let cores = shares.iter().map(|(_, share)| share).sum();
        let busiest = shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
        Self { cores, busiest, round_trip }
    }

    fn is_near_limit(&self) -> bool {
        self.busiest.1 > NEAR_LIMIT || self.round_trip > SLOW
    }
}

impl fmt::Display for RouterLoad {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, share) = &self.busiest;
        let round_trip_ms = self.round_trip.as_secs_f64() * 1e3;
        write!(
            f,
            "{:.2} of a core, {share:.2} of it in the thread `{name}`, a query takes {round_trip_ms:.1} ms",
            self.cores
        )
    }
}

/// Over HTTP.
struct RouterHealth {
    pulse: Arc<Pulse>,
    /// None until the first interval has ended.
    load: Arc<Mutex<Option<RouterLoad>>>,
    certificates: CertificateWatch,
}

impl Subject for RouterHealth {
    fn live(&self) -> HealthCondition {
        live(self.pulse.sign(Instant::now()))
    }

    fn ready(&self) -> HealthCondition {
        let live = self.live();
        match &*self.load.lock() {
            _ if !live.well => live,
            Some(load) => HealthCondition::well(status(
                load,
                &self.certificates.expiring(unix_ns() / 1_000_000_000),
            )),
            None => HealthCondition::well(FORWARDING),
        }
    }

    fn metrics(&self) -> Result<String, fmt::Error> {
        let process = ProcessReport::read(self.pulse.sign(Instant::now()));
        let (load, until_unix_s) = (self.load.lock().clone(), self.certificates.until_unix_s());
        render(Vec::new(), move |sheet| {
            process.write(sheet)?;
            sheet.certificate_expiry(until_unix_s)?;
            let Some(load) = &load else { return Ok(()) };
            let help = "Share of a core that the busiest thread uses; near 1 the router limits the network.";
            sheet.gauge("trusswatch_router_busiest_thread", help, load.busiest.1)?;
            let help =
                "Longest time of a query through the router's own tables in the latest interval.";
            sheet.seconds("trusswatch_router_round_trip", help, Some(load.round_trip.as_secs_f64()))
        })
    }
}

/// Sends a query without a recipient and waits for its end; false if it was answered or failed.
async fn ends_unanswered(session: &Session) -> bool {
    let Ok(replies) = session.get(UNOWNED).timeout(TIMEOUT).await else { return false };
    while let Ok(reply) = replies.recv_async().await {
        if reply.result().is_err() {
            return false;
        }
    }
    true
}

fn check(network: &Network) -> Result<(), Failure> {
    let settings = session::settings(network)?;
    let mode = settings.get_json("mode").unwrap_or_default();
    if mode != "\"router\"" {
        let file =
            network.zenoh.as_deref().map_or(String::new(), |file| file.display().to_string());
        let reason = format!("its `mode` is {mode}; a router needs \"router\"");
        return Err(NetworkError::File { file, reason }.into());
    }
    Ok(network.check_certificates()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(of: [f64; 2]) -> BTreeMap<i32, (String, f64)> {
        let [net, tx] = of;
        BTreeMap::from([(1, ("net-0".to_owned(), net)), (2, ("tx-0".to_owned(), tx))])
    }

    #[test]
    fn the_thread_that_has_no_time_left_is_named() {
        let (elapsed, ms) = (Duration::from_secs(5), Duration::from_millis);
        let load = |before, after, round_trip| {
            RouterLoad::new(&times(before), &times(after), elapsed, round_trip)
        };
        let quiet = load([1.0, 2.0], [1.5, 3.0], ms(2));
        assert!(!quiet.is_near_limit());
        let words = "0.30 of a core, 0.20 of it in the thread `tx-0`, a query takes 2.0 ms";
        assert_eq!(quiet.to_string(), words);
        let busy = load([1.5, 3.0], [2.0, 7.9], Duration::ZERO);
        assert!(busy.is_near_limit(), "{busy:?}");
        let slow = load([2.0, 7.9], [2.0, 7.9], ms(80));
        assert!(slow.is_near_limit(), "{slow:?}");
    }
}
