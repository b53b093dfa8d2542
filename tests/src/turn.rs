//! Whose turn it is: tests that mostly wait run side by side, those that measure or load the machine alone.

use tokio::sync::{Semaphore, SemaphorePermit};

/// Tests that run side by side: they mostly wait.
const SIDE_BY_SIDE: u32 = 4;

static PLACES: Semaphore = Semaphore::const_new(SIDE_BY_SIDE as usize);

/// Lasts until it is dropped.
#[must_use]
pub struct Turn(#[expect(dead_code, reason = "given back when dropped")] SemaphorePermit<'static>);

/// Waits until a few others at most are running.
pub async fn side_by_side() -> Turn {
    turn(1).await
}

/// Waits until no other test is running; none starts until it is over.
pub async fn alone() -> Turn {
    turn(SIDE_BY_SIDE).await
}

/// The same for a test without a runtime.
pub fn blocking_alone() -> Turn {
    tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(alone())
}

async fn turn(places: u32) -> Turn {
    Turn(PLACES.acquire_many(places).await.unwrap())
}
