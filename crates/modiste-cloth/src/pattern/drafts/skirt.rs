//! The skirt block: a flared front and back to above the knee, with an elastic waist.

use modiste_body::{Gender, Part};

use super::super::{FitRule, GradedPattern, Outline, Panel, Wrap};
use super::{HIP_STEP, Hips, InCuts, Pen, Trend, band_at_waist, stitch, without_panels};

/// What differs between the women's and the men's block. Lengths in metres; trends are on the hip girth.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Crotch line to waist band along the side, on the cloth.
    rise: Trend,
    /// Crotch line to hem.
    below: Trend,
    hip_ease: f64,
    /// How much wider the hem is than the hip.
    flare: f64,
}

const WOMEN: Block = Block {
    rise: Trend { mean: 0.212, slope: 0.060 },
    below: Trend { mean: 0.260, slope: 0.040 },
    hip_ease: 0.090,
    flare: 0.340,
};

const MEN: Block = Block {
    rise: Trend { mean: 0.220, slope: 0.070 },
    below: Trend { mean: 0.290, slope: 0.040 },
    hip_ease: 0.100,
    flare: 0.340,
};

impl Block {
    /// The block of an ease: looser skirts are wider and fuller.
    fn in_cut(&self, ease: f64) -> Self {
        Self { hip_ease: self.hip_ease + HIP_STEP * ease, flare: self.flare + 0.090 * ease, ..*self }
    }
}

/// How far the waist edge dips towards the middle of the front, and of the back (m): there it rises over the seat.
const DIPS: [f64; 2] = [0.012, -0.020];

/// Drafts the skirt in every size and cut.
pub fn draft_skirt(gender: Gender) -> GradedPattern {
    let block = match gender {
        Gender::Female => WOMEN,
        Gender::Male => MEN,
    };
    let measures = Hips::of(gender);
    let hips = Hips::sizes();
    let panel = |name: &str, dip: f64, wrap: Wrap, is_back: bool| {
        let drafts = InCuts::new(&hips, |hip, ease| draft_size((&block, &measures), (hip, ease), dip, is_back));
        let [slim, outlines, loose] = drafts.outlines(|draft| draft.0.clone());
        Panel {
            name: name.to_owned(),
            edge_labels: drafts.regular[0].1.clone(),
            outlines,
            slim,
            loose,
            wrap,
            part: Part::Pelvis,
            lower_parts: Vec::new(),
            covers: vec![Part::LeftThigh, Part::RightThigh],
        }
    };
    let named = ("skirt", gender, "twill");
    let mut pattern = without_panels(named, FitRule::Lower, (&hips, measures.centre), |hip| measures.girths(hip));
    pattern.self_contact = true;
    pattern.panels = vec![panel("front", DIPS[0], Wrap::HipFront, false), panel("back", DIPS[1], Wrap::HipBack, true)];
    stitch(
        &mut pattern,
        &[
            ("front:hip_left", "back:hip_left"),
            ("front:side_left", "back:side_left"),
            ("front:hip_right", "back:hip_right"),
            ("front:side_right", "back:side_right"),
        ],
    );
    band_at_waist(&mut pattern, 10);
    pattern
}

/// One panel of one size and ease; y = 0 is the crotch line, x = 0 the centre line. The back is drawn clockwise, so that it
/// faces backward.
fn draft_size(
    (block, measures): (&Block, &Hips),
    (hip, ease): (f64, f64),
    dip: f64,
    is_back: bool,
) -> (Outline, Vec<String>) {
    let block = block.in_cut(ease);
    let offset = hip - measures.centre;
    let band = measures.band(hip, ease);
    let half_hip = 0.25 * (hip + block.hip_ease);
    let half_waist = 0.25 * band;
    let half_hem = half_hip + 0.25 * block.flare;
    let (rise, hem) = (block.rise.at(offset), -block.below.at(offset));
    let hip_line = 0.30 * rise;
    let side = half_hip - half_waist;
    // From the hip line up: straight first, then in to the waist.
    let low = (half_hip - 0.1 * side, hip_line + 0.3 * (rise - hip_line));
    let high = (half_waist + 0.45 * side, rise - 0.4 * (rise - hip_line));
    // The hem meets the slanting sides at right angles.
    let lift = 0.5 * (half_hem - half_hip) / (hip_line - hem) * half_hem;
    let (sides, middle) = ((half_hem, hem), hem - lift);
    let left = |(x, y): (f64, f64)| (-x, y);
    if is_back {
        Pen::start((-half_hem, hem))
            .line("side_right", (-half_hip, hip_line))
            .cubic("hip_right", left(low), left(high), (-half_waist, rise))
            .cubic("waist", (-0.4 * half_waist, rise - dip), (0.4 * half_waist, rise - dip), (half_waist, rise))
            .cubic("hip_left", high, low, (half_hip, hip_line))
            .line("side_left", (half_hem, hem))
            .cubic("hem", (0.35 * half_hem, middle), (-0.35 * half_hem, middle), left(sides))
            .close()
    } else {
        Pen::start((-half_hem, hem))
            .cubic("hem", (-0.35 * half_hem, middle), (0.35 * half_hem, middle), sides)
            .line("side_left", (half_hip, hip_line))
            .cubic("hip_left", low, high, (half_waist, rise))
            .cubic("waist", (0.4 * half_waist, rise - dip), (-0.4 * half_waist, rise - dip), (-half_waist, rise))
            .cubic("hip_right", left(high), left(low), (-half_hip, hip_line))
            .line("side_right", (-half_hem, hem))
            .close()
    }
}
