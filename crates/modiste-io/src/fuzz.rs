//! Damaged bytes for the tests of every reader.

use proptest::prelude::any;
use proptest::test_runner::{Config, TestRunner};

/// Runs a reader on truncations and on copies with flipped bytes; a panic is a failure.
///
/// Deterministic: truncations at (at most) 300 evenly spaced lengths, then 300 copies with up to 8 changed bytes.
pub(crate) fn survives_damage(whole: &[u8], read: impl Fn(&[u8])) {
    read(whole);
    let step = whole.len().div_ceil(300).max(1);
    for length in (0..whole.len()).step_by(step) {
        read(&whole[..length]);
    }
    let changes = proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..=8);
    let config = Config { cases: 300, failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(
        config,
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    let outcome = runner.run(&changes, |changes| {
        let mut damaged = whole.to_vec();
        for (at, value) in &changes {
            if !damaged.is_empty() {
                let at = at.index(damaged.len());
                damaged[at] = *value;
            }
        }
        read(&damaged);
        Ok(())
    });
    assert!(outcome.is_ok(), "{outcome:?}");
}
