//! tokio-rustls, whose stream may be read by one thread while another one writes.
//!
//! Zenoh's TLS link reads from a stream on one thread and writes to it on another, each through a `&mut` of
//! its own (<https://github.com/eclipse-zenoh/zenoh/issues/2557>). But both directions of TLS share one state:
//! at a thousand samples a second links broke every few seconds, and a process died about once a minute. Here
//! one thread is let into the state at a time, for as long as a step takes that never waits. Everything else
//! is that of the published library.
//!
//! When Zenoh has mended it, this crate and its line under `[patch.crates-io]` can go.

use std::cell::UnsafeCell;
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};

pub use published::*;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// A stream of either side.
///
/// What it holds lies behind a pointer that never changes, so that several `&mut` of this, which there
/// should not be but are, reach the state only through the lock.
#[derive(Debug)]
pub struct TlsStream<T>(Arc<Locked<T>>);

#[derive(Debug)]
struct Locked<T> {
    turn: Mutex<()>,
    stream: UnsafeCell<published::TlsStream<T>>,
}

// SAFETY: the state is touched only by whoever has the turn. What `get_ref` and `get_mut` give out is the
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
        Self(Arc::new(Locked { turn: Mutex::new(()), stream: UnsafeCell::new(stream) }))
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
    /// One step, while nobody else makes one.
    fn step<R>(&self, step: impl FnOnce(Pin<&mut published::TlsStream<T>>) -> R) -> R {
        // A step that panicked has ended its own stream, if any.
        let _turn = self.0.turn.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: whoever has the turn is alone.
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
        self.step(|stream| stream.poll_flush(context))
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.step(|stream| stream.poll_shutdown(context))
    }
}
