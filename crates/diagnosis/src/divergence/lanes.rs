//! One number for each of four channels.
//!
//! The channels of a module go through the same arithmetic at every step. Four of them are carried
//! side by side, so that one vector instruction serves four channels; which instructions the machine
//! has is asked at run time. The operations are spelt out rather than left to the compiler, which
//! would vectorise along a channel's own vector and spend its time on shuffles. Products are fused with
//! their sums everywhere, also where the machine has no instruction for that, and every sum has a fixed
//! order: the same bits come out on every machine, and no channel's numbers ever touch another's.

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
    /// a·b + c, rounded once.
    fn mul_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;
    /// c − a·b, rounded once.
    fn sub_mul(self, c: Self::Vector, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Notes that this many numbers were moved besides the arithmetic; of interest to tests only.
    #[inline(always)]
    fn moved(self, _numbers: usize) {}

    /// The same number for all channels.
    #[inline(always)]
    fn splat(self, x: f64) -> Self::Vector {
        self.load(&splat(x))
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

    #[inline(always)]
    fn mul_add(self, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
        self.0.mul_add_f64s(a, b, c)
    }

    #[inline(always)]
    fn sub_mul(self, c: S::f64s, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.negate_mul_add_f64s(a, b, c)
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

    #[inline(always)]
    fn mul_add(self, a: Lane, b: Lane, c: Lane) -> Lane {
        std::array::from_fn(|lane| a[lane].mul_add(b[lane], c[lane]))
    }

    #[inline(always)]
    fn sub_mul(self, c: Lane, a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|lane| (-a[lane]).mul_add(b[lane], c[lane]))
    }
}
