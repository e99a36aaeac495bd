//! SIMD lanes: eight samples computed side by side, on what instructions the machine has.
//!
//! A [`Kernel`] is written once over [`Lanes`]; [`dispatch`] picks the lanes at run time, so that
//! a plain build uses AVX2 and FMA where they exist. All of a kernel must be inlined into
//! `dispatch` for that: mark its functions `#[inline(always)]` and write loops rather than
//! `array::map` or `from_fn`, whose closures the compiler leaves out of line.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod elementary;
mod portable;

use glimpse_core::angles::HalfDifference;
use glimpse_core::model::Model;
use glimpse_core::scalar::Scalar;

pub use portable::PortableLanes;

/// How many samples are computed side by side.
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

/// Eight numbers in a register.
pub trait Lanes: Scalar<Parameter = f32, Sum = Self> {
    /// From memory.
    fn load(octet: &Octet) -> Self;
    /// To memory.
    fn store(self) -> Octet;

    /// The sum over the lanes, always in the same order.
    #[inline(always)]
    fn total(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.store().0;
        ((a + e) + (c + g)) + ((b + f) + (d + h))
    }

    /// Loads eight half and difference vectors.
    #[inline(always)]
    fn load_at(at: &OctetAt) -> HalfDifference<Self> {
        HalfDifference {
            hx: Self::load(&at.hx),
            hz: Self::load(&at.hz),
            dx: Self::load(&at.dx),
            dy: Self::load(&at.dy),
            dz: Self::load(&at.dz),
        }
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
    #[cfg(target_arch = "x86_64")]
    if avx2::is_available() {
        return avx2::run(kernel);
    }
    kernel.run::<PortableLanes>()
}

/// The instructions that [`dispatch`] uses here.
#[must_use]
pub fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if avx2::is_available() {
        return "AVX2 + FMA";
    }
    "portable"
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
        for (at, brdf) in self.at.chunks(WIDTH).zip(self.brdf.chunks_mut(WIDTH)) {
            let at = L::load_at(&Octet::transpose(at));
            let [red, green, blue] = M::brdf::<L>(self.parameters, &at);
            let [red, green, blue] = [red.store().0, green.store().0, blue.store().0];
            for (lane, rgb) in brdf.iter_mut().enumerate() {
                *rgb = [red[lane], green[lane], blue[lane]];
            }
        }
    }
}
