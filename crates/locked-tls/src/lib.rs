//! tokio-rustls, whose stream may be read by one thread while another one writes, and is flushed in bounded time.
//!
//! Zenoh's TLS link reads from a stream on one thread and writes to it on another, each through a `&mut` of
//! its own (<https://github.com/eclipse-zenoh/zenoh/issues/2557>). But both directions of TLS share one state:
//! at a thousand samples a second links broke every few seconds, and a process died about once a minute. Here
//! one thread is let into the state at a time, for as long as a step takes that never waits. Everything else
//! is that of the published library.
//!
//! And Zenoh flushes a stream before it closes a link, however long that takes. Where a link is cut off with
//! something unsent, the system tries to send it for a quarter of an hour; meanwhile the other process stays on
//! the books, and when it comes back its queries find no answer. Hence [`FLUSH_WITHIN`].
//!
//! When Zenoh has mended it, this crate and its line under `[patch.crates-io]` can go.

use std::cell::UnsafeCell;
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

pub use published::*;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::Sleep;

/// Flushing that takes longer has failed.
const FLUSH_WITHIN: Duration = Duration::from_secs(1);

/// A stream of either side.
///
/// What it holds lies behind a pointer that never changes, so that several `&mut` of this, which there
/// should not be but are, reach the state only through the lock.
#[derive(Debug)]
pub struct TlsStream<T>(Arc<Locked<T>>);

#[derive(Debug)]
struct Locked<T> {
    turn: Mutex<Turn>,
    stream: UnsafeCell<published::TlsStream<T>>,
}

/// What a thread that has the turn may change besides.
#[derive(Debug, Default)]
struct Turn {
    /// Until then the flush under way may take.
    flush_until: Option<Pin<Box<Sleep>>>,
}

// SAFETY: the state is touched only by the thread that has the turn. What `get_ref` and `get_mut` give out is the
// transport beneath, which may be shared.
unsafe impl<T: Send + Sync> Sync for Locked<T> {}

impl<T> TlsStream<T> {
    /// The stream of a client.
    #[allow(non_snake_case, reason = "stands in for the variant of an enumeration")]
    #[must_use]
    pub fn Client(stream: client::TlsStream<T>) -> Self {
        Self::of(published::TlsStream::Client(stream))
    }

    /// The stream of a server.
    #[allow(non_snake_case, reason = "stands in for the variant of an enumeration")]
    #[must_use]
    pub fn Server(stream: server::TlsStream<T>) -> Self {
        Self::of(published::TlsStream::Server(stream))
    }

    fn of(stream: published::TlsStream<T>) -> Self {
        Self(Arc::new(Locked { turn: Mutex::default(), stream: UnsafeCell::new(stream) }))
    }

    /// The transport beneath; the state of TLS is not given out.
    #[must_use]
    pub fn get_ref(&self) -> (&T, ()) {
        // SAFETY: this reaches the transport only, which a step of TLS does not move or replace.
        (unsafe { &*self.0.stream.get() }.get_ref().0, ())
    }

    /// The transport beneath, to end it.
    #[must_use]
    pub fn get_mut(&mut self) -> (&mut T, ()) {
        // SAFETY: as above. It is ended by calls to the system, which other threads may make too.
        (unsafe { &mut *self.0.stream.get() }.get_mut().0, ())
    }
}

impl<T: AsyncRead + AsyncWrite + Unpin> TlsStream<T> {
    /// One step, with exclusive access.
    fn step<R>(&self, step: impl FnOnce(Pin<&mut published::TlsStream<T>>) -> R) -> R {
        self.step_of_turn(&mut self.turn(), step)
    }

    fn turn(&self) -> MutexGuard<'_, Turn> {
        // A step that panicked has ended its own stream, if any.
        self.0.turn.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn step_of_turn<R>(
        &self,
        _turn: &mut MutexGuard<'_, Turn>,
        step: impl FnOnce(Pin<&mut published::TlsStream<T>>) -> R,
    ) -> R {
        // SAFETY: the thread that has the turn has exclusive access.
        step(Pin::new(unsafe { &mut *self.0.stream.get() }))
    }
}

impl<T: AsyncRead + AsyncWrite + Unpin> AsyncRead for TlsStream<T> {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.step(|stream| stream.poll_read(context, buffer))
    }
}

impl<T: AsyncRead + AsyncWrite + Unpin> AsyncWrite for TlsStream<T> {
    fn poll_write(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.step(|stream| stream.poll_write(context, bytes))
    }

    fn poll_write_vectored(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.step(|stream| stream.poll_write_vectored(context, pieces))
    }

    fn is_write_vectored(&self) -> bool {
        self.step(|stream| stream.is_write_vectored())
    }

    fn poll_flush(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let mut turn = self.turn();
        if let Poll::Ready(flushed) =
            self.step_of_turn(&mut turn, |stream| stream.poll_flush(context))
        {
            turn.flush_until = None;
            return Poll::Ready(flushed);
        }
        let until =
            turn.flush_until.get_or_insert_with(|| Box::pin(tokio::time::sleep(FLUSH_WITHIN)));
        if until.as_mut().poll(context).is_pending() {
            return Poll::Pending;
        }
        turn.flush_until = None;
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.step(|stream| stream.poll_shutdown(context))
    }
}
