//! One number for each of four channels.
//!
//! The channels of a module go through the same arithmetic at every step. Four of them are carried
//! side by side, so that one vector instruction serves four channels; which instructions the machine
//! has is asked at run time. The operations are spelt out rather than left to the compiler, which
//! would vectorise along a channel's own vector and spend its time on shuffles. Nothing is fused and
//! every sum has a fixed order: the same bits come out on every machine, and no channel's numbers
//! ever touch another's.

/// Channels carried side by side.
pub(super) const LANES: usize = 4;

/// One number for each of the channels, in memory.
pub(super) type Lane = [f64; LANES];

/// The same number for all channels.
pub(super) const fn splat(x: f64) -> Lane {
    [x; LANES]
}

/// Arithmetic on one number for each of the channels.
pub(super) trait Instructions: Copy {
    /// One number for each of the channels, in registers.
    type Vector: Copy;

    fn load(self, lane: &Lane) -> Self::Vector;
    fn store(self, lane: &mut Lane, vector: Self::Vector);
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    fn div(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Notes that this many numbers were moved besides the arithmetic; of interest to tests only.
    #[inline(always)]
    fn moved(self, _numbers: usize) {}

    /// The same number for all channels.
    #[inline(always)]
    fn splat(self, x: f64) -> Self::Vector {
        self.load(&splat(x))
    }

    /// Scalar product of two vectors of equal length, channel by channel.
    #[inline(always)]
    fn dot(self, a: &[Lane], b: &[Lane]) -> Self::Vector {
        // Two running sums: half the waiting on the previous addition.
        let mut even = self.splat(0.0);
        let mut odd = self.splat(0.0);
        let (a_pairs, a_rest) = a.as_chunks::<2>();
        let (b_pairs, b_rest) = b.as_chunks::<2>();
        for (x, y) in a_pairs.iter().zip(b_pairs) {
            even = self.add(even, self.mul(self.load(&x[0]), self.load(&y[0])));
            odd = self.add(odd, self.mul(self.load(&x[1]), self.load(&y[1])));
        }
        for (x, y) in a_rest.iter().zip(b_rest) {
            even = self.add(even, self.mul(self.load(x), self.load(y)));
        }
        self.add(even, odd)
    }

    /// `target += factor · source`.
    #[inline(always)]
    fn add_scaled(self, target: &mut [Lane], factor: Self::Vector, source: &[Lane]) {
        for (t, s) in target.iter_mut().zip(source) {
            let sum = self.add(self.load(t), self.mul(factor, self.load(s)));
            self.store(t, sum);
        }
    }
}

/// Instructions that hold four numbers in one register.
#[derive(Clone, Copy)]
pub(super) struct Wide<S>(pub(super) S);

impl<S: pulp::Simd> Instructions for Wide<S> {
    type Vector = S::f64s;

    #[inline(always)]
    fn load(self, lane: &Lane) -> S::f64s {
        S::as_simd_f64s(lane).0[0]
    }

    #[inline(always)]
    fn store(self, lane: &mut Lane, vector: S::f64s) {
        S::as_mut_simd_f64s(lane).0[0] = vector;
    }

    #[inline(always)]
    fn add(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.add_f64s(a, b)
    }

    #[inline(always)]
    fn sub(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.sub_f64s(a, b)
    }

    #[inline(always)]
    fn mul(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.mul_f64s(a, b)
    }

    #[inline(always)]
    fn div(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.div_f64s(a, b)
    }
}

/// Plain arithmetic, for machines without such registers.
#[derive(Clone, Copy)]
pub(super) struct Portable;

#[inline(always)]
fn map(a: Lane, b: Lane, f: impl Fn(f64, f64) -> f64) -> Lane {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])]
}

impl Instructions for Portable {
    type Vector = Lane;

    #[inline(always)]
    fn load(self, lane: &Lane) -> Lane {
        *lane
    }

    #[inline(always)]
    fn store(self, lane: &mut Lane, vector: Lane) {
        *lane = vector;
    }

    #[inline(always)]
    fn add(self, a: Lane, b: Lane) -> Lane {
        map(a, b, |x, y| x + y)
    }

    #[inline(always)]
    fn sub(self, a: Lane, b: Lane) -> Lane {
        map(a, b, |x, y| x - y)
    }

    #[inline(always)]
    fn mul(self, a: Lane, b: Lane) -> Lane {
        map(a, b, |x, y| x * y)
    }

    #[inline(always)]
    fn div(self, a: Lane, b: Lane) -> Lane {
        map(a, b, |x, y| x / y)
    }
}
