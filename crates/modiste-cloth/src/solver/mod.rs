//! Advances cloth in time: implicit Euler steps, each one Newton step solved by preconditioned conjugate gradients.

mod conjugate_gradients;
mod matrix;
mod options;
mod report;
mod step;

pub use options::SolverOptions;
pub use report::StepReport;
pub use step::Solver;
