//! Frames from card to card: one thread reads each card and decides about every frame, another one
//! brings those that are late.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tun_rs::InterruptEvent;

use super::delay_line::DelayLine;
use super::frame::{self, Mac};
use super::impairment::Fate;
use super::link::Link;
use super::node::Node;
use super::tap::Card;

/// No frame is longer.
const LONGEST_FRAME: usize = 1 << 16;

/// The switch; dropping it ends its threads.
pub(super) struct Switch {
    hub: Arc<Hub>,
    threads: Vec<JoinHandle<()>>,
}

/// What the threads share.
struct Hub {
    cards: Vec<Card>,
    /// From every node to every node.
    links: Vec<Link>,
    /// Behind which card an address is.
    learned: Mutex<HashMap<Mac, usize>>,
    delayed: DelayLine,
    closing: AtomicBool,
    /// Ends the reading of a card, for each card one.
    interrupts: Vec<InterruptEvent>,
}

impl Switch {
    /// Joins the cards, which are in the order of [`Node::ALL`].
    pub(super) fn start(cards: Vec<Card>, seed: u64) -> std::io::Result<Self> {
        let count = cards.len();
        let links = (0..count * count).map(|stream| Link::new(seed, stream as u64));
        let interrupts = cards.iter().map(|_| InterruptEvent::new()).collect::<Result<_, _>>()?;
        let hub = Arc::new(Hub {
            cards,
            links: links.collect(),
            learned: Mutex::default(),
            delayed: DelayLine::new(),
            closing: AtomicBool::new(false),
            interrupts,
        });
        // From here on the threads are ended in any case.
        let mut switch = Self { hub, threads: Vec::new() };
        for place in 0..count {
            switch.spawn(&format!("lab-card-{place}"), move |hub| hub.read(place))?;
        }
        switch.spawn("lab-delay", Hub::deliver_delayed)?;
        Ok(switch)
    }

    fn spawn(
        &mut self,
        name: &str,
        work: impl FnOnce(&Hub) + Send + 'static,
    ) -> std::io::Result<()> {
        let hub = Arc::clone(&self.hub);
        let thread =
            std::thread::Builder::new().name(name.to_string()).spawn(move || work(&hub))?;
        self.threads.push(thread);
        Ok(())
    }

    pub(super) fn link(&self, from: Node, to: Node) -> &Link {
        self.hub.link(from.index(), to.index())
    }
}

impl Drop for Switch {
    fn drop(&mut self) {
        self.hub.closing.store(true, Ordering::Release);
        self.hub.delayed.close();
        for interrupt in &self.hub.interrupts {
            // Fails only if it was triggered before.
            let _ = interrupt.trigger();
        }
        for thread in self.threads.drain(..) {
            // A failed thread has reported it on standard error.
            let _ = thread.join();
        }
    }
}

impl Hub {
    fn link(&self, from: usize, to: usize) -> &Link {
        &self.links[from * self.cards.len() + to]
    }

    /// Takes frames from a card until the end.
    fn read(&self, from: usize) {
        let mut buffer = vec![0; LONGEST_FRAME];
        while !self.closing.load(Ordering::Acquire) {
            match self.cards[from].recv_intr(&mut buffer, &self.interrupts[from]) {
                Ok(length) => self.forward(from, &buffer[..length]),
                // The end, or a signal to this process.
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                // A card that is gone stays gone.
                Err(_) => return,
            }
        }
    }

    fn forward(&self, from: usize, frame: &[u8]) {
        let Some((destination, source)) = frame::addresses(frame) else { return };
        let known = {
            let mut learned = self.learned.lock();
            learned.insert(source, from);
            learned.get(&destination).copied()
        };
        match known {
            Some(to) if frame::is_for_one(destination) => self.send(from, to, frame),
            _ => (0..self.cards.len()).for_each(|to| self.send(from, to, frame)),
        }
    }

    fn send(&self, from: usize, to: usize, frame: &[u8]) {
        if from == to {
            return;
        }
        match self.link(from, to).decide() {
            Fate::Forwarded { after: Duration::ZERO } => self.deliver(to, frame),
            Fate::Forwarded { after } => {
                self.delayed.put(Instant::now() + after, to, frame.to_vec());
            }
            Fate::Lost | Fate::Cut => {}
        }
    }

    fn deliver_delayed(&self) {
        while let Some((to, frame)) = self.delayed.next() {
            self.deliver(to, &frame);
        }
    }

    fn deliver(&self, to: usize, frame: &[u8]) {
        // A card that is down or gone takes nothing, like a real one.
        let _ = self.cards[to].send(frame);
    }
}
