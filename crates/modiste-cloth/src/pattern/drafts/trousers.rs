//! The trouser block: front and back of each leg, to mid-thigh (shorts) or to the ankle (pants), with an elastic waist.

use modiste_body::{Gender, Part};

use super::super::{FitRule, GradedPattern, LowerPart, Outline, Panel, Wrap};
use super::{HIP_STEP, Hips, InCuts, Pen, Trend, band_at_waist, mirrored, mirrored_labels, stitch, without_panels};

/// What differs between the women's and the men's block. Lengths in metres; trends are on the hip girth.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Crotch line to waist band along the side, on the cloth.
    rise: Trend,
    /// Inside leg of the shorts, and of the pants.
    short_inseam: Trend,
    long_inseam: Trend,
    /// Crotch to knee.
    knee: Trend,
    /// Girth of a trouser leg at knee and hem.
    knee_girth: Trend,
    hem_girth: Trend,
    hip_ease: f64,
    /// Crotch extensions as fractions of the hip girth.
    front_fork: f64,
    back_fork: f64,
}

const WOMEN: Block = Block {
    rise: Trend { mean: 0.222, slope: 0.080 },
    short_inseam: Trend { mean: 0.165, slope: 0.040 },
    long_inseam: Trend { mean: 0.675, slope: 0.020 },
    knee: Trend { mean: 0.320, slope: 0.010 },
    knee_girth: Trend { mean: 0.500, slope: 0.260 },
    hem_girth: Trend { mean: 0.450, slope: 0.180 },
    hip_ease: 0.100,
    front_fork: 0.050,
    back_fork: 0.108,
};

const MEN: Block = Block {
    rise: Trend { mean: 0.230, slope: 0.090 },
    short_inseam: Trend { mean: 0.200, slope: 0.040 },
    long_inseam: Trend { mean: 0.735, slope: 0.020 },
    knee: Trend { mean: 0.345, slope: 0.010 },
    knee_girth: Trend { mean: 0.520, slope: 0.260 },
    hem_girth: Trend { mean: 0.470, slope: 0.180 },
    hip_ease: 0.110,
    front_fork: 0.055,
    back_fork: 0.105,
};

impl Block {
    /// The block of an ease: looser trousers are wider at hip and leg and hang lower; shorts are longer too.
    fn in_cut(&self, ease: f64) -> Self {
        let and = |trend: Trend, more: f64| Trend { mean: trend.mean + more * ease, ..trend };
        Self {
            rise: and(self.rise, 0.008),
            short_inseam: and(self.short_inseam, 0.015),
            knee_girth: and(self.knee_girth, 0.050),
            hem_girth: and(self.hem_girth, 0.050),
            hip_ease: self.hip_ease + HIP_STEP * ease,
            ..*self
        }
    }
}

/// How far the legs reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leg {
    Short,
    Long,
}

/// Drafts the shorts in every size and cut.
pub fn draft_shorts(gender: Gender) -> GradedPattern {
    draft("shorts", gender, Leg::Short)
}

/// Drafts the long pants in every size and cut.
pub fn draft_pants(gender: Gender) -> GradedPattern {
    draft("pants", gender, Leg::Long)
}

fn draft(garment: &str, gender: Gender, leg: Leg) -> GradedPattern {
    let block = match gender {
        Gender::Female => WOMEN,
        Gender::Male => MEN,
    };
    let measures = Hips::of(gender);
    let hips = Hips::sizes();
    let drafts = InCuts::new(&hips, |hip, ease| draft_size((&block, &measures), (hip, ease), leg));
    let knees: Vec<f64> = hips.iter().map(|&hip| -block.knee.at(hip - measures.centre)).collect();
    let panel = |name: &str, piece: usize, right: bool, wrap: Wrap, [thigh, shin]: [Part; 2]| {
        let mut lower_parts = vec![LowerPart { part: thigh, below: vec![0.0; hips.len()] }];
        if leg == Leg::Long {
            lower_parts.push(LowerPart { part: shin, below: knees.clone() });
        }
        let labels = &drafts.regular[0][piece].1;
        let [slim, outlines, loose] =
            drafts.outlines(|draft| if right { mirrored(&draft[piece].0) } else { draft[piece].0.clone() });
        Panel {
            name: name.to_owned(),
            edge_labels: if right { mirrored_labels(labels) } else { labels.clone() },
            outlines,
            slim,
            loose,
            wrap,
            part: Part::Pelvis,
            lower_parts,
            covers: Vec::new(),
        }
    };
    let (left, right) = ([Part::LeftThigh, Part::LeftShin], [Part::RightThigh, Part::RightShin]);
    let named = (garment, gender, "twill");
    let mut pattern = without_panels(named, FitRule::Lower, (&hips, measures.centre), |hip| measures.girths(hip));
    pattern.panels = vec![
        panel("left_front", 0, false, Wrap::LeftLegFront, left),
        panel("left_back", 1, false, Wrap::LeftLegBack, left),
        panel("right_front", 0, true, Wrap::RightLegFront, right),
        panel("right_back", 1, true, Wrap::RightLegBack, right),
    ];
    if leg == Leg::Long {
        stitch(
            &mut pattern,
            &[
                ("left_front:outseam_low", "left_back:outseam_low"),
                ("left_front:inseam_low", "left_back:inseam_low"),
                ("right_front:outseam_low", "right_back:outseam_low"),
                ("right_front:inseam_low", "right_back:inseam_low"),
            ],
        );
    }
    stitch(
        &mut pattern,
        &[
            ("left_front:outseam", "left_back:outseam"),
            ("left_front:hip", "left_back:hip"),
            ("left_front:inseam", "left_back:inseam"),
            ("right_front:outseam", "right_back:outseam"),
            ("right_front:hip", "right_back:hip"),
            ("right_front:inseam", "right_back:inseam"),
            ("left_front:centre", "right_front:centre"),
            ("left_front:crotch", "right_front:crotch"),
            ("left_back:centre", "right_back:centre"),
            ("left_back:crotch", "right_back:crotch"),
        ],
    );
    band_at_waist(&mut pattern, 5);
    pattern
}

/// Left front and left back of one size and ease; y = 0 is the crotch line, x = 0 the centre line.
fn draft_size((block, measures): (&Block, &Hips), (hip, ease): (f64, f64), leg: Leg) -> [(Outline, Vec<String>); 2] {
    let block = block.in_cut(ease);
    let offset = hip - measures.centre;
    let band = measures.band(hip, ease);
    let quarter = 0.25 * (hip + block.hip_ease);
    let (front, back) = (quarter - 0.005, quarter + 0.005);
    let rise = block.rise.at(offset);
    let (front_fork, back_fork) = (block.front_fork * hip, block.back_fork * hip);
    // Of what the waist is narrower than the hip, the centre front and back take a little and the side seams the rest.
    let (centre_front, centre_back) = (0.012, 0.034);
    let side = 0.5 * (front + back - centre_front - centre_back - 0.5 * band);
    let back_raise = 0.040;
    let hip_line = 0.30 * rise;
    let levels = leg_levels(&block, (offset, ease), leg, [front, back], [front_fork, back_fork]);

    let seat = 0.42 * rise;
    // The front's outseam mirrors into the back's: same heights, same insets, so both sides are equally long.
    let hip_controls =
        |x: f64| [(x, hip_line + 0.4 * (rise - hip_line)), (x - 0.8 * side, rise - 0.3 * (rise - hip_line))];
    let [low, high] = hip_controls(front);
    let mut pen = Pen::start((-front_fork, 0.0));
    for (label, level) in INSEAM.into_iter().zip(&levels) {
        pen = pen.line(label, (level.front[0], level.y));
    }
    pen = pen.line("hem", (levels[levels.len() - 1].front[1], levels[levels.len() - 1].y));
    for (index, label) in OUTSEAM.into_iter().enumerate().take(levels.len()).rev() {
        pen = pen.line(
            label,
            if index == 0 { (front, hip_line) } else { (levels[index - 1].front[1], levels[index - 1].y) },
        );
    }
    let front_piece = pen
        .cubic("hip", low, high, (front - side, rise))
        .line("waist", (centre_front, rise))
        .line("centre", (0.0, seat))
        .cubic("crotch", (-0.002, 0.15 * rise), (-0.4 * front_fork, 0.003), (-front_fork, 0.0))
        .close();

    // The back inseam leans more, so the back crotch point drops until both inseams are equally long.
    let [front_run, back_run] = [levels[0].front[0] + front_fork, levels[0].back[0] + back_fork];
    let drop = -levels[0].y - (levels[0].y.powi(2) + front_run * front_run - back_run * back_run).sqrt();
    let [low, high] = hip_controls(back);
    let lean = (centre_back) / (rise + back_raise - seat);
    let mut pen = Pen::start((-back_fork, -drop))
        .cubic("crotch", (-0.45 * back_fork, -drop - 0.004), (-0.28 * rise * lean, seat - 0.28 * rise), (0.0, seat))
        .line("centre", (centre_back, rise + back_raise))
        .line("waist", (back - side, rise))
        .cubic("hip", high, low, (back, hip_line));
    for (label, level) in OUTSEAM.into_iter().zip(&levels) {
        pen = pen.line(label, (level.back[1], level.y));
    }
    pen = pen.line("hem", (levels[levels.len() - 1].back[0], levels[levels.len() - 1].y));
    for (index, label) in INSEAM.into_iter().enumerate().take(levels.len()).rev() {
        pen = pen.line(
            label,
            if index == 0 { (-back_fork, -drop) } else { (levels[index - 1].back[0], levels[index - 1].y) },
        );
    }
    [front_piece, pen.close()]
}

/// Labels of the seams of a leg, from the crotch down to each level.
const INSEAM: [&str; 2] = ["inseam", "inseam_low"];
const OUTSEAM: [&str; 2] = ["outseam", "outseam_low"];

/// The back of a trouser leg is this much wider than the front, half (m).
const BACK_EXTRA: f64 = 0.010;

/// How far the outseam of shorts leans in from hip to hem (m), and how much less it does in the loose cut.
const SHORT_TAPER: f64 = 0.010;
const SHORT_TAPER_STEP: f64 = 0.010;

/// The two sides of a leg at one height: inseam and outseam of front and back.
#[derive(Debug, Clone, Copy)]
struct Level {
    y: f64,
    front: [f64; 2],
    back: [f64; 2],
}

/// The heights at which a leg's outline has corners below the hip line, the hem last.
///
/// Outseams of front and back have the same insets, so both are equally long.
fn leg_levels(
    block: &Block,
    (offset, ease): (f64, f64),
    leg: Leg,
    [front, back]: [f64; 2],
    [front_fork, back_fork]: [f64; 2],
) -> Vec<Level> {
    if leg == Leg::Short {
        let y = -block.short_inseam.at(offset);
        let taper = SHORT_TAPER - SHORT_TAPER_STEP * ease;
        return vec![Level { y, front: [0.030 - front_fork, front - taper], back: [0.050 - back_fork, back - taper] }];
    }
    let crease = 0.5 * (front - front_fork);
    let level = |y: f64, girth: f64| {
        let (front_width, back_width) = (0.5 * girth - BACK_EXTRA, 0.5 * girth + BACK_EXTRA);
        let inset = front - (crease + 0.5 * front_width);
        Level {
            y: -y,
            front: [crease - 0.5 * front_width, front - inset],
            back: [back - inset - back_width, back - inset],
        }
    };
    vec![
        level(block.knee.at(offset), block.knee_girth.at(offset)),
        level(block.long_inseam.at(offset), block.hem_girth.at(offset)),
    ]
}
