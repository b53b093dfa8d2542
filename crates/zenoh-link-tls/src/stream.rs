//
// Copyright (c) 2026 the trusswatch authors
//
// This program and the accompanying materials are made available under the
// terms of the Eclipse Public License 2.0 which is available at
// http://www.eclipse.org/legal/epl-2.0, or the Apache License, Version 2.0
// which is available at https://www.apache.org/licenses/LICENSE-2.0.
//
// SPDX-License-Identifier: EPL-2.0 OR Apache-2.0
//
use std::{
    future::poll_fn,
    io,
    pin::Pin,
    sync::{Mutex, MutexGuard, PoisonError},
    task::{Context, Poll},
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::TcpStream,
};
use tokio_rustls::TlsStream;

/// A TLS stream that one task may read from while another one writes to it.
///
/// Both directions of TLS share one state (keys, sequence numbers, alerts), so each step of either
/// direction has the stream for itself. A step never waits, hence a lock that blocks.
/// The halves made by `tokio::io::split` work alike, but give no access to the TCP stream.
pub(crate) struct SharedTlsStream(Mutex<TlsStream<TcpStream>>);

impl SharedTlsStream {
    pub(crate) fn new(stream: TlsStream<TcpStream>) -> Self {
        Self(Mutex::new(stream))
    }

    fn lock(&self) -> MutexGuard<'_, TlsStream<TcpStream>> {
        // A link whose stream panicked must still be closed
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shuts down the writing side of the TCP stream beneath, whatever TLS still has to send.
    pub(crate) async fn shutdown_tcp(&self) -> io::Result<()> {
        poll_fn(|cx| Pin::new(self.lock().get_mut().0).poll_shutdown(cx)).await
    }
}

impl AsyncRead for &SharedTlsStream {
    fn poll_read(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut *self.lock()).poll_read(cx, buf)
    }
}

impl AsyncWrite for &SharedTlsStream {
    fn poll_write(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut *self.lock()).poll_write(cx, buf)
    }

    fn poll_flush(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut *self.lock()).poll_flush(cx)
    }

    fn poll_shutdown(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut *self.lock()).poll_shutdown(cx)
    }
}
