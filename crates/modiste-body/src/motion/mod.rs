//! Motion: reading captured motion onto our bodies, cleaning it, and making it without a file.

pub mod filter;

pub use filter::resample;
