//! The trainer's inner loops: sums over many BRDF samples on SIMD lanes, the exact adjoint of a fit by descent, and the
//! device's fit on the host.
//!
//! This is a separate crate because it compiles slowly, for each model on each instruction set. It depends on core
//! only, so it compiles in parallel with the trainer's other dependencies. Changes to the trainer do not recompile it.
//!
//! Modules from the bottom up; each imports only from those before it:
//!
//! - `operators`: a macro that implements the operators of a number type
//! - [`dual`]: numbers with derivatives
//! - [`lanes`]: SIMD registers, and kernels that run on them
//! - [`samples`]: samples in memory, in the layout that registers load
//! - [`sums`]: gradient, Hessian-vector product and loss over samples, on one thread
//! - [`brdf`]: a model's BRDF at many directions
//! - `completion_weights`: the layer sizes and the weights of the coefficient net and the start net
//! - [`completion`]: the coefficient net and the start net for a batch of materials, and their adjoint
//! - [`components`]: the loss of a combination of principal components
//! - [`inner_loop`]: the unrolled descent and its adjoint
//! - [`gauss_newton`]: Gauss-Newton steps and their adjoint
//! - [`peak`]: the machine's peak throughput
//! - `crew`: threads that stay awake during a computation
//! - `parallel`: sums that a crew shares
//! - `model_kernels`: the table of these kernels of each model
//! - [`scan`]: the device's scan on the host, for any recipe

pub mod brdf;
pub mod completion;
mod completion_weights;
pub mod components;
mod crew;
pub mod dual;
pub mod gauss_newton;
pub mod inner_loop;
pub mod lanes;
mod model_kernels;
mod operators;
mod parallel;
pub mod peak;
pub mod samples;
pub mod scan;
pub mod sums;

pub use dual::{AngleDual, Dual};
pub use model_kernels::{ModelKernels, NEURAL};
