//! SIMD lanes: eight samples and more computed side by side, on what instructions the machine has.
//!
//! A [`Kernel`] is written once over [`Lanes`]; [`dispatch`] picks the lanes at run time, so that
//! a plain build uses AVX-512, or AVX2 and FMA, where they exist. (NEON is part of every 64-bit
//! Arm, so the portable lanes are compiled to it there.) All of a kernel must be inlined into
//! `dispatch` for that: mark its functions `#[inline(always)]` and write loops rather than
//! `array::map` or `from_fn`, whose closures the compiler leaves out of line.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod elementary;
mod pair;
mod portable;
mod total;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::Model;
use glimpse_core::numeric::Scalar;

pub use pair::Pair;
pub use portable::PortableLanes;
pub use total::Total;

/// How many numbers an [`Octet`] holds.
pub const WIDTH: usize = 8;

/// Eight numbers in memory, aligned so that they load as one vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Octet(pub [f32; WIDTH]);

/// Half and difference vectors of eight samples.
pub type OctetAt = HalfDifference<Octet>;

impl Octet {
    /// Transposes up to eight half and difference vectors; missing ones repeat the last.
    #[must_use]
    pub fn transpose(list: &[HalfDifference<f32>]) -> OctetAt {
        let mut octets = OctetAt::default();
        let Some(last) = list.last() else {
            return octets;
        };
        for lane in 0..WIDTH {
            let at = list.get(lane).unwrap_or(last);
            octets.hx.0[lane] = at.hx;
            octets.hz.0[lane] = at.hz;
            octets.dx.0[lane] = at.dx;
            octets.dy.0[lane] = at.dy;
            octets.dz.0[lane] = at.dz;
        }
        octets
    }
}

/// Where the lanes of a register come from: one octet after the other, as many of them as it has.
pub type Octets<'a> = [&'a Octet; MOST_OCTETS];

/// The largest number of octets in [`Lanes`].
pub const MOST_OCTETS: usize = 4;

/// Numbers in one or two registers: eight, or a multiple of it.
pub trait Lanes: Scalar<Parameter = f32> {
    /// How many octets there are.
    const OCTETS: usize;
    /// Lanes for lists that are too short for these; itself if there are none.
    type Narrow: Lanes;

    /// From memory.
    fn load(octets: Octets<'_>) -> Self;
    /// To memory, as far as there is room.
    fn store(self, octets: &mut [Octet]);
    /// A sum of nothing.
    fn zero_sum() -> Self::Sum;
    /// The sum over all lanes of each of `sums`, always in the same order.
    fn totals(sums: &[Self::Sum], totals: &mut [f32]);

    /// The sum over the lanes.
    #[inline(always)]
    fn total(self) -> f32 {
        let mut sum = [Self::zero_sum()];
        Self::add_to(&mut sum[0], self);
        let mut total = [0.0];
        Self::totals(&sum, &mut total);
        total[0]
    }
}

/// Loads half and difference vectors.
#[inline(always)]
pub fn load_at<L: Lanes>([a, b, c, d]: [&OctetAt; MOST_OCTETS]) -> HalfDifference<L> {
    HalfDifference {
        hx: L::load([&a.hx, &b.hx, &c.hx, &d.hx]),
        hz: L::load([&a.hz, &b.hz, &c.hz, &d.hz]),
        dx: L::load([&a.dx, &b.dx, &c.dx, &d.dx]),
        dy: L::load([&a.dy, &b.dy, &c.dy, &d.dy]),
        dz: L::load([&a.dz, &b.dz, &c.dz, &d.dz]),
    }
}

/// Work that is written over lanes.
pub trait Kernel {
    /// What it computes.
    type Output;
    /// Computes it; must be `#[inline(always)]`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Runs a kernel on the best lanes that this machine has.
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    InstructionSet::of_this_machine().run(kernel)
}

/// What [`dispatch`] can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// AVX-512: 16 numbers in a register.
    Avx512,
    /// AVX2 and FMA: eight.
    Avx2,
    /// Whatever the compiler takes for granted: NEON on 64-bit Arm, SSE2 on x86-64.
    Portable,
}

impl InstructionSet {
    /// What [`dispatch`] uses here.
    #[must_use]
    pub fn of_this_machine() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if avx512::is_available() {
                return Self::Avx512;
            }
            if avx2::is_available() {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// Runs a kernel on these lanes, or on lesser ones if this machine does not have them.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::Avx512 if avx512::is_available() => return avx512::run(kernel),
            Self::Avx512 | Self::Avx2 if avx2::is_available() => return avx2::run(kernel),
            _ => {}
        }
        kernel.run::<PortableLanes>()
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "AVX-512",
            Self::Avx2 => "AVX2 + FMA",
            Self::Portable if cfg!(target_arch = "aarch64") => "NEON",
            Self::Portable => "portable",
        }
    }
}

/// A model's BRDF at many places.
pub struct EvaluateModel<'a, M: Model> {
    /// The parameters.
    pub parameters: &'a M::Parameters<f32>,
    /// Where.
    pub at: &'a [HalfDifference<f32>],
    /// The BRDF in linear RGB, sr^-1 (not times the cosine); as long as `at`.
    pub brdf: &'a mut [[f32; 3]],
}

impl<M: Model> Kernel for EvaluateModel<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        if self.at.len() <= WIDTH {
            self.evaluate::<<L::Narrow as Lanes>::Narrow>();
        } else {
            self.evaluate::<L>();
        }
    }
}

impl<M: Model> EvaluateModel<'_, M> {
    #[inline(always)]
    fn evaluate<L: Lanes>(self) {
        let count = L::OCTETS * WIDTH;
        for (at, brdf) in self.at.chunks(count).zip(self.brdf.chunks_mut(count)) {
            let mut octets = [OctetAt::default(); MOST_OCTETS];
            for (octet, at) in octets.iter_mut().zip(at.chunks(WIDTH)) {
                *octet = Octet::transpose(at);
            }
            let at = load_at::<L>(octets.each_ref());
            let mut values = [[Octet::default(); MOST_OCTETS]; 3];
            for (stored, value) in values.iter_mut().zip(M::brdf::<L>(self.parameters, &at)) {
                value.store(stored);
            }
            for (index, rgb) in brdf.iter_mut().enumerate() {
                let [red, green, blue] = &values;
                let (octet, lane) = (index / WIDTH, index % WIDTH);
                *rgb = [
                    red[octet].0[lane],
                    green[octet].0[lane],
                    blue[octet].0[lane],
                ];
            }
        }
    }
}
