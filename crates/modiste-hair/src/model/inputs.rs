//! What drives the hair: the pose of the bust, and in the fuller model what it did of late.

use modiste_core::{Affine3, Quat, Vec3};

use super::bust::BustState;

/// Times that means of the past go back (frames): 0.1, 0.3 and 0.9 s.
const PAST: [f64; 3] = [3.0, 9.0, 27.0];
/// Bust coefficients whose past is looked at, and those whose products are.
const REMEMBERED: usize = 6;
const MULTIPLIED: usize = 4;
/// Numbers of a move of the head from frame to frame: metres in three directions and a rotation vector.
const MOVE: usize = 6;
/// Which of the means of the past squares have.
const SQUARES_PAST: f64 = PAST[1];

/// Inputs of the dynamics through time.
///
/// The thesis has the bust coefficients x_t alone (eq. 21 adds the last two moves). A matrix makes of them what is linear in
/// them, and of the past only what the last two frames of the hair still show of it. The fuller inputs add means of the past
/// of the bust and of how the head moves, as a rigid body in its own space, which need not be kept in the hair; which way is
/// down for the head, and its past; products of the leading bust coefficients, since a head that turns and nods is no sum of
/// turning and nodding; and squares of the moves, as drag and centrifugal force are.
#[derive(Debug, Clone)]
pub struct Inputs {
    plain: bool,
    past: Option<Past>,
}

#[derive(Debug, Clone)]
struct Past {
    /// The world from the space of the hair.
    head: Affine3,
    bust: Vec<[f64; PAST.len()]>,
    down: [[f64; PAST.len()]; 3],
    moves: [[f64; PAST.len()]; MOVE],
    squares: [[f64; 2]; MOVE],
}

impl Inputs {
    /// Before the first frame; `plain` as in the thesis.
    pub fn new(plain: bool) -> Self {
        Self { plain, past: None }
    }

    /// How many there are for so many bust coefficients.
    pub fn count(plain: bool, bust: usize) -> usize {
        let multiplied = bust.min(MULTIPLIED);
        let products = |count: usize| count * (count + 1) / 2;
        let down = 3 * (1 + PAST.len()) + products(3);
        let more = bust.min(REMEMBERED) * PAST.len() + MOVE * (PAST.len() + 4) + products(multiplied) + down;
        bust + if plain { 0 } else { more }
    }

    /// Forgets what was before, as if the bust had stood still in its next pose.
    pub fn restart(&mut self) {
        self.past = None;
    }

    /// Inputs of the next frame.
    pub fn next(&mut self, state: &BustState) -> Vec<f64> {
        let bust = &state.coefficients;
        let head = state.world_from_hair();
        let mut inputs = bust.clone();
        if self.plain {
            return inputs;
        }
        let remembered = &bust[..bust.len().min(REMEMBERED)];
        // From that of an upright head.
        let down = (state.down() - Vec3::NEG_Y).to_array();
        let past = self.past.get_or_insert_with(|| Past {
            head,
            bust: remembered.iter().map(|&x| [x; PAST.len()]).collect(),
            down: down.map(|x| [x; PAST.len()]),
            moves: [[0.0; PAST.len()]; MOVE],
            squares: [[0.0; 2]; MOVE],
        });
        let way = past.head.inverse() * head;
        past.head = head;
        let (way, turn) = (way.translation, Quat::from_mat3(&way.matrix3).to_scaled_axis());
        let moves: [f64; MOVE] = std::array::from_fn(|i| if i < 3 { way[i] } else { turn[i - 3] });
        let towards = |mean: &mut f64, value: f64, time: f64| {
            let kept = (-1.0 / time).exp();
            *mean = kept * *mean + (1.0 - kept) * value;
            *mean
        };
        inputs.extend(down);
        for (means, &value) in past.bust.iter_mut().zip(remembered).chain(past.down.iter_mut().zip(&down)) {
            for (mean, time) in means.iter_mut().zip(PAST) {
                inputs.push(towards(mean, value, time) - value);
            }
        }
        for ((means, squares), value) in past.moves.iter_mut().zip(&mut past.squares).zip(moves) {
            for (mean, time) in means.iter_mut().zip(PAST) {
                inputs.push(towards(mean, value, time));
            }
            for (mean, square) in squares.iter_mut().zip([value * value, value * value.abs()]) {
                inputs.push(square);
                inputs.push(towards(mean, square, SQUARES_PAST));
            }
        }
        for multiplied in [&bust[..bust.len().min(MULTIPLIED)], &down] {
            for (index, a) in multiplied.iter().enumerate() {
                inputs.extend(multiplied[index..].iter().map(|b| a * b));
            }
        }
        inputs
    }
}

#[cfg(test)]
mod tests {
    use super::{BustState, Inputs};
    use crate::canonical::Frame;
    use modiste_core::{Affine3, Vec3};

    #[test]
    fn inputs_come_to_rest_and_a_restart_forgets() {
        let at = |x: f64, bust: [f64; 7]| BustState {
            frame: Frame { position: Vec3::new(x, 0.0, 0.0), heading: 0.2 * x },
            coefficients: bust.to_vec(),
            hair: Affine3::from_rotation_x(bust[0]),
        };
        let bust = [0.3, -0.2, 0.1, 0.4, 0.5, 0.6, 0.7];
        let mut inputs = Inputs::new(false);
        let first = inputs.next(&at(0.0, bust));
        assert_eq!(first.len(), Inputs::count(false, bust.len()));
        assert_eq!(Inputs::new(true).next(&at(0.0, bust)), bust);
        let moving = inputs.next(&at(0.05, [0.0; 7]));
        assert!(moving.iter().zip(&first).any(|(a, b)| (a - b).abs() > 0.01));
        let mut still = Vec::new();
        for _ in 0..600 {
            still = inputs.next(&at(0.05, bust));
        }
        assert!(still.iter().zip(&first).all(|(a, b)| (a - b).abs() < 1e-6), "{still:?}");
        inputs.next(&at(0.3, bust));
        inputs.restart();
        assert_eq!(inputs.next(&at(9.0, bust)), first);
    }
}
