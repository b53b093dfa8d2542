//! What happens in a world: faults, orders and disturbances, drawn from its seed. Plain data, so that a story can be shrunk.

use std::fmt;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use study::TimedFault;
use vocabulary::{Component, ComponentPath, OrderKind, Step, fault::Fault};

use crate::setup::Setup;

/// Phases of a world \[ms\]: the first disturbance, the first and last fault, the end of the last disturbance.
const DISTURBED_FROM: u64 = 1_000;
const FAULTY_FROM: u64 = 5_000;
const FAULTY_UNTIL: u64 = 12_000;
const CALM_FROM: u64 = 15_000;
/// The last order is given before this \[ms\].
const ORDERED_UNTIL: u64 = 27_000;
/// By the end everything has to be as if nothing but the faults had happened \[ms\].
pub(crate) const END: u64 = 32_000;
/// Biases \[m/m\], far above the smallest that is isolated.
const BIAS_STRAIN: [f64; 2] = [120e-6, 250e-6];

/// More samples than a world has.
const MANY_SAMPLES: usize = 8192;
/// A file of a journal that lasts for most of a world \[bytes\].
const LARGE_FILE: u64 = 40_000;

/// What happens in a world.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldScenario {
    /// Its seed: of the weather and of everything that is drawn on the way.
    pub seed: u64,
    /// The faults.
    pub faults: Vec<TimedFault>,
    /// What operators order.
    pub orders: Vec<TimedOrder>,
    /// What goes wrong around it.
    pub disturbances: Vec<Disturbance>,
    /// So many samples the publisher keeps, and so many a process asks for after it was down: in some worlds fewer than
    /// an outage lasts, so that what happened meanwhile stays unknown.
    pub remembered_samples: usize,
    /// When the view connects \[ms\].
    pub view_opens_ms: u64,
    /// Whether faults are identified, which takes half of the time of such a world.
    pub identifies: bool,
    /// A new file of a journal begins after so many bytes: in some worlds several times.
    pub rotate_bytes: u64,
}

/// An order of an operator.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedOrder {
    /// When \[ms\].
    pub at_ms: u64,
    /// What.
    pub kind: OrderKind,
    /// About what.
    pub component: ComponentPath,
}

/// Something that goes wrong for a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// Its beginning \[ms\].
    pub from_ms: u64,
    /// Its end \[ms\].
    pub until_ms: u64,
    /// What.
    pub what: DisturbanceKind,
    /// Of a kill or a loss of power: it waits for this, and does not happen without it.
    pub waits_for: Option<KillMoment>,
}

/// What a process does when it is killed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KillMoment {
    /// The disk writes.
    Writing,
    /// It has put a question.
    Asking,
    /// It has published a transition.
    Publishing,
}

/// What goes wrong. A module is given by its index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DisturbanceKind {
    /// The process of a module is killed, and started at the end.
    Kill(usize),
    /// The module's computer loses its power: what no disk has is lost.
    PowerLoss(usize),
    /// The process stands still.
    Freeze(usize),
    /// A step takes the process so long \[µs\]: more than a step lasts, or so much that catching up takes seconds.
    SlowProcess(usize, u64),
    /// Nothing reaches the module.
    Deaf(usize),
    /// Nothing that the module says reaches anybody.
    Mute(usize),
    /// Both.
    CutOff(usize),
    /// The modules below this one and the others do not hear each other.
    Split(usize),
    /// Nothing reaches anybody.
    NoRouter,
    /// This share of samples and answers is lost.
    Loss(f64),
    /// Messages take up to so long \[ms\], each its own time, so that they overtake each other.
    Late(u64),
    /// This share of samples arrives twice.
    Twice(f64),
    /// The disk of a module takes so long to answer \[ms\].
    SlowDisk(usize, u64),
    /// The disk does not answer.
    HungDisk(usize),
    /// The disk refuses everything.
    FullDisk(usize),
    /// The clock of a module's computer is wrong by so much \[s\].
    WrongClock(usize, f64),
    /// The publisher is silent, and publishes afterwards what it has measured since.
    SilentPublisher,
    /// The publisher ends and begins again with a new run.
    RestartedPublisher,
    /// Another publisher with a run of its own sends samples of another weather.
    SecondPublisher,
    /// A gage of the module has no value: its index.
    NoValue(usize, usize),
    /// What the module answers to its peers is that nothing has happened.
    Liar(usize),
}

impl KillMoment {
    fn draw(draw: &mut ChaCha8Rng) -> Option<Self> {
        let moments = [None, None, Some(Self::Writing), Some(Self::Asking), Some(Self::Publishing)];
        moments[draw.random_range(0..moments.len())]
    }

    fn in_words(self) -> &'static str {
        match self {
            Self::Writing => "while the disk writes",
            Self::Asking => "once it has asked",
            Self::Publishing => "once it has published",
        }
    }
}

impl fmt::Display for Disturbance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.what.fmt(f)?;
        self.waits_for.map_or(Ok(()), |moment| write!(f, " {}", moment.in_words()))
    }
}

impl DisturbanceKind {
    /// The gage that loses its value.
    pub(crate) fn valueless(self, setup: &Setup) -> Option<ComponentPath> {
        let Self::NoValue(module, gage) = self else { return None };
        let module = &setup.modules[module].setup;
        let gages = module.components().into_iter();
        let mut gages = gages.filter(|one| matches!(one, Component::Sensor(_)));
        let component = gages.nth(gage)?;
        Some(ComponentPath { module: module.module.clone(), component })
    }

    fn ends_process(self) -> bool {
        matches!(self, Self::Kill(_) | Self::PowerLoss(_))
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Kill(_) => "kill",
            Self::PowerLoss(_) => "power loss",
            Self::Freeze(_) => "freeze",
            Self::SlowProcess(..) => "slow process",
            Self::Deaf(_) => "deaf",
            Self::Mute(_) => "mute",
            Self::CutOff(_) => "cut off",
            Self::Split(_) => "split",
            Self::NoRouter => "no router",
            Self::Loss(_) => "loss",
            Self::Late(_) => "late",
            Self::Twice(_) => "twice",
            Self::SlowDisk(..) => "slow disk",
            Self::HungDisk(_) => "hung disk",
            Self::FullDisk(_) => "full disk",
            Self::WrongClock(..) => "wrong clock",
            Self::SilentPublisher => "silent publisher",
            Self::RestartedPublisher => "restarted publisher",
            Self::SecondPublisher => "second publisher",
            Self::NoValue(..) => "no value",
            Self::Liar(_) => "liar",
        }
    }

    /// Every kind once, with what is drawn for it.
    fn drawn(draw: &mut ChaCha8Rng, modules: &[usize]) -> [Self; 21] {
        let module = modules[draw.random_range(0..modules.len())];
        [
            Self::Kill(module),
            Self::PowerLoss(module),
            Self::Freeze(module),
            Self::SlowProcess(module, draw.random_range(1_000..8_000)),
            Self::Deaf(module),
            Self::Mute(module),
            Self::CutOff(module),
            Self::Split(module.max(1)),
            Self::NoRouter,
            Self::Loss(draw.random_range(0.01..0.3)),
            Self::Late(draw.random_range(5..400)),
            Self::Twice(draw.random_range(0.1..1.0)),
            Self::SlowDisk(module, draw.random_range(20..900)),
            Self::HungDisk(module),
            Self::FullDisk(module),
            Self::WrongClock(module, draw.random_range(-5000.0..5000.0)),
            Self::SilentPublisher,
            Self::RestartedPublisher,
            Self::SecondPublisher,
            Self::NoValue(module, draw.random_range(0..8)),
            Self::Liar(module),
        ]
    }
}

impl fmt::Display for DisturbanceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Kill(m)
            | Self::PowerLoss(m)
            | Self::Freeze(m)
            | Self::Deaf(m)
            | Self::Mute(m) => {
                write!(f, " of module{}", m + 1)
            }
            Self::CutOff(m) | Self::HungDisk(m) | Self::FullDisk(m) | Self::Liar(m) => {
                write!(f, ": module{}", m + 1)
            }
            Self::Split(m) => write!(f, " below module{}", m + 1),
            Self::Loss(share) | Self::Twice(share) => write!(f, " of {:.0} %", 1e2 * share),
            Self::Late(ms) => write!(f, " by up to {ms} ms"),
            Self::SlowProcess(m, us) => write!(f, " of module{}: {us} µs a step", m + 1),
            Self::SlowDisk(m, ms) => write!(f, " of module{}: {ms} ms", m + 1),
            Self::WrongClock(m, s) => write!(f, " of module{}: {s:+.0} s", m + 1),
            Self::NoValue(m, gage) => write!(f, " of module{}/sensor/g{}", m + 1, gage + 1),
            Self::NoRouter
            | Self::SilentPublisher
            | Self::RestartedPublisher
            | Self::SecondPublisher => Ok(()),
        }
    }
}

impl WorldScenario {
    /// Draws what happens in the world of a seed. Each seed draws which kinds of disturbance there are at all.
    #[must_use]
    pub fn draw(seed: u64, setup: &Setup) -> Self {
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        let faults = faults(&mut draw, setup);
        let orders = orders(&mut draw, &faults, setup);
        // In every second world all that concerns one module concerns the same one: what is rare alone is rarer together.
        let mut modules: Vec<usize> = (0..setup.modules.len()).collect();
        if draw.random_bool(0.5) {
            let faulty = faults.first().map(|fault| &fault.component.module);
            let faulty = setup.module_names().position(|name| Some(name) == faulty);
            modules = vec![faulty.unwrap_or_else(|| draw.random_range(0..modules.len()))];
        }
        // Much depends on what happens right before or after the fault of one's own module.
        let onset_ms = faults.first().map(|fault| setup.ms(fault.at));
        let onset_ms = onset_ms.filter(|_| modules.len() == 1);
        let kinds = DisturbanceKind::drawn(&mut draw, &modules);
        let share = [0.0, 0.1, 0.2, 0.5][draw.random_range(0..4)];
        let is_on: Vec<bool> = kinds.iter().map(|_| draw.random_bool(share)).collect();
        let mut disturbances = Vec::new();
        for (place, _) in is_on.iter().enumerate().filter(|(_, is_on)| **is_on) {
            for _ in 0..draw.random_range(1..=3) {
                let what = DisturbanceKind::drawn(&mut draw, &modules)[place];
                // Longer than a peer's word is believed, but for most.
                let longest = if draw.random_bool(0.1) { 14_000 } else { 8_000 };
                let lasts_ms = draw.random_range(200..=longest);
                let from_ms = match onset_ms.filter(|_| draw.random_bool(0.7)) {
                    None => draw.random_range(DISTURBED_FROM..CALM_FROM - 1000),
                    Some(onset) if draw.random() => onset + draw.random_range(0..4_000) - 1_500,
                    Some(onset) => (onset + draw.random_range(0..1_000)).saturating_sub(lasts_ms),
                };
                let from_ms = from_ms.clamp(DISTURBED_FROM, CALM_FROM - 1000);
                let until_ms = (from_ms + lasts_ms).min(CALM_FROM);
                let waits_for = KillMoment::draw(&mut draw).filter(|_| what.ends_process());
                disturbances.push(Disturbance { from_ms, until_ms, what, waits_for });
            }
        }
        disturbances.sort_by_key(|one| (one.from_ms, one.until_ms));
        let forgets = draw.random_bool(0.3);
        let remembered_samples = if forgets { draw.random_range(200..1500) } else { MANY_SAMPLES };
        let rotates = draw.random_bool(0.3);
        let rotate_bytes = if rotates { draw.random_range(4_000..20_000) } else { LARGE_FILE };
        let late = draw.random_bool(0.25);
        let view_opens_ms = if late { draw.random_range(0..CALM_FROM) } else { 0 };
        let identifies = draw.random_bool(0.125);
        Self {
            seed,
            faults,
            orders,
            disturbances,
            remembered_samples,
            view_opens_ms,
            identifies,
            rotate_bytes,
        }
    }

    /// Is anything going wrong between these times, or has it shortly before?
    #[must_use]
    pub(crate) fn is_disturbed(&self, from_ms: u64, until_ms: u64) -> bool {
        let over = |one: &Disturbance| one.from_ms <= until_ms && from_ms <= one.until_ms + 2_000;
        self.disturbances.iter().any(over)
    }

    /// Does no module say to its peers what is not so? Otherwise a healthy component may be named: a fault that its module
    /// hides looks like that of the component on which it has its largest effect.
    pub(crate) fn is_honest(&self) -> bool {
        !self.disturbances.iter().any(|one| matches!(one.what, DisturbanceKind::Liar(_)))
    }

    /// Does the publisher keep fewer samples than an outage may last?
    pub(crate) fn forgets(&self) -> bool {
        self.remembered_samples < MANY_SAMPLES
    }

    /// Are all samples those of one run? Otherwise a fault may begin in one that is not used, or before a module watches.
    pub(crate) fn is_of_one_run(&self) -> bool {
        let other = |one: &Disturbance| {
            use DisturbanceKind::{RestartedPublisher, SecondPublisher};
            matches!(one.what, SecondPublisher | RestartedPublisher)
        };
        !self.disturbances.iter().any(other)
    }

    /// Is no clock ever wrong?
    pub(crate) fn clocks_agree(&self) -> bool {
        let is_wrong = |one: &Disturbance| matches!(one.what, DisturbanceKind::WrongClock(..));
        !self.disturbances.iter().any(is_wrong)
    }

    /// Are all samples those of the plant that has the faults?
    pub(crate) fn is_of_one_plant(&self) -> bool {
        !self.disturbances.iter().any(|one| one.what == DisturbanceKind::SecondPublisher)
    }

    /// The gages that lose their values at some time.
    pub(crate) fn valueless(&self, setup: &Setup) -> impl Iterator<Item = ComponentPath> {
        self.disturbances.iter().filter_map(|one| one.what.valueless(setup))
    }

    /// Variants with one thing less, for shrinking: the largest steps first.
    #[must_use]
    pub fn smaller(&self) -> Vec<Self> {
        let half = self.disturbances.len() / 2;
        let mut smaller = Vec::new();
        if half > 1 {
            let (first, second) = self.disturbances.split_at(half);
            smaller.extend(
                [first, second].map(|part| Self { disturbances: part.to_vec(), ..self.clone() }),
            );
        }
        if self.forgets() {
            smaller.push(Self { remembered_samples: MANY_SAMPLES, ..self.clone() });
        }
        if self.view_opens_ms > 0 {
            smaller.push(Self { view_opens_ms: 0, ..self.clone() });
        }
        if self.identifies {
            smaller.push(Self { identifies: false, ..self.clone() });
        }
        if self.rotate_bytes < LARGE_FILE {
            smaller.push(Self { rotate_bytes: LARGE_FILE, ..self.clone() });
        }
        for place in 0..self.disturbances.len() {
            let mut less = self.clone();
            less.disturbances.remove(place);
            smaller.push(less);
        }
        for place in 0..self.orders.len() {
            let mut less = self.clone();
            less.orders.remove(place);
            smaller.push(less);
        }
        for place in 0..self.faults.len() {
            let mut less = self.clone();
            less.faults.remove(place);
            smaller.push(less);
        }
        smaller
    }
}

fn faults(draw: &mut ChaCha8Rng, setup: &Setup) -> Vec<TimedFault> {
    let count = [0, 1, 1, 1, 1, 2][draw.random_range(0..6)];
    let mut left: Vec<ComponentPath> = setup.components().collect();
    let mut faults: Vec<TimedFault> = Vec::new();
    for _ in 0..count {
        let component = left.swap_remove(draw.random_range(0..left.len()));
        let sign = if draw.random() { 1.0 } else { -1.0 };
        let strain = sign * draw.random_range(BIAS_STRAIN[0]..BIAS_STRAIN[1]);
        let fault = match &component.component {
            Component::Actuator(_) => Fault::HardOver {},
            Component::Sensor(_) => Fault::Bias { offset_m: strain * setup.length_m(&component) },
        };
        let ms = draw.random_range(FAULTY_FROM..FAULTY_UNTIL);
        let at = Step(ms * 1_000_000 / setup.step_ns());
        let ends = draw.random_bool(0.25);
        let lasts_ms = draw.random_range(3_000..8_000);
        let until = ends.then(|| at.plus(lasts_ms * 1_000_000 / setup.step_ns()));
        faults.push(TimedFault { at, until, component, fault });
    }
    faults
}

/// Operators acknowledge and reset what is faulty, carelessly: too early, twice, and what is not faulty.
fn orders(draw: &mut ChaCha8Rng, faults: &[TimedFault], setup: &Setup) -> Vec<TimedOrder> {
    let mut orders = Vec::new();
    let kinds = [
        OrderKind::Acknowledge,
        OrderKind::Acknowledge,
        OrderKind::Reset,
        OrderKind::Reset,
        OrderKind::Shelve,
        OrderKind::Unshelve,
    ];
    if faults.is_empty() || draw.random_bool(0.5) {
        return orders;
    }
    for _ in 0..draw.random_range(1..6) {
        orders.push(TimedOrder {
            at_ms: draw.random_range(FAULTY_FROM..ORDERED_UNTIL),
            kind: kinds[draw.random_range(0..kinds.len())],
            component: faults[draw.random_range(0..faults.len())].component.clone(),
        });
    }
    // What is repaired is reset, by those who are patient.
    for fault in faults.iter().filter(|fault| fault.until.is_some()) {
        let until = setup.ms(fault.until.unwrap_or(fault.at));
        for (kind, from) in [
            (OrderKind::Acknowledge, setup.ms(fault.at)),
            (OrderKind::Reset, until),
            (OrderKind::Reset, until),
        ] {
            let at_ms = draw.random_range(from..ORDERED_UNTIL);
            orders.push(TimedOrder { at_ms, kind, component: fault.component.clone() });
        }
    }
    orders.sort_by_key(|order| order.at_ms);
    orders
}
