//! Vector instructions, as far as the processor has them.

use pulp::{Arch, Simd, WithSimd};

/// Runs a closure compiled for several instruction sets of the processor. Operations and their order, and hence the
/// results to the last bit, are the same for all: a product is fused with a sum where `mul_add` says so, and nowhere else.
///
/// Only what is inlined has the instructions: mark the closure, and what it calls, `#[inline(always)]`.
#[inline]
pub fn vectorised<R>(work: impl FnMut() -> R) -> R {
    Arch::new().dispatch(Work(work))
}

struct Work<F>(F);

impl<R, F: FnMut() -> R> WithSimd for Work<F> {
    type Output = R;

    // A call by value (`FnOnce`) would go through a function of its own, which is compiled without the instructions.
    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> R {
        (self.0)()
    }
}
