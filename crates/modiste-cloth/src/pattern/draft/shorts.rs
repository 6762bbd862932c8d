//! The shorts block: front and back of each leg, to mid-thigh, with an elastic waist.

use modiste_body::{Gender, Part};

use super::super::{Anchors, EdgeId, FitRule, GradedPattern, LowerPart, Outline, Panel, Size, Wrap};
use super::{Pen, Trend, mirrored, mirrored_labels, stitch};

/// What differs between the women's and the men's block. Lengths in metres; trends are on the hip girth.
#[derive(Debug, Clone, Copy)]
struct Block {
    first_hip: f64,
    last_hip: f64,
    /// Mean buttock girth, the centre of every trend.
    centre: f64,
    /// ANSUR II: chest and waist girth.
    chest: Trend,
    waist: Trend,
    /// Crotch line to waist band along the side, on the cloth.
    rise: Trend,
    /// Inside leg of the shorts.
    inseam: Trend,
    hip_ease: f64,
    /// Crotch extensions as fractions of the hip girth.
    front_fork: f64,
    back_fork: f64,
}

const STEP: f64 = 0.04;

const WOMEN: Block = Block {
    first_hip: 0.78,
    last_hip: 1.42,
    centre: 1.021,
    chest: Trend { mean: 0.947, slope: 0.81 },
    waist: Trend { mean: 0.861, slope: 1.057 },
    rise: Trend { mean: 0.222, slope: 0.080 },
    inseam: Trend { mean: 0.165, slope: 0.040 },
    hip_ease: 0.100,
    front_fork: 0.050,
    back_fork: 0.108,
};

const MEN: Block = Block {
    first_hip: 0.78,
    last_hip: 1.42,
    centre: 1.020,
    chest: Trend { mean: 1.059, slope: 0.95 },
    waist: Trend { mean: 0.941, slope: 1.276 },
    rise: Trend { mean: 0.230, slope: 0.090 },
    inseam: Trend { mean: 0.200, slope: 0.040 },
    hip_ease: 0.110,
    front_fork: 0.055,
    back_fork: 0.105,
};

/// The band sits this far from the waist (at the navel) towards the hip, as a fraction of the way.
const BAND_BELOW_WAIST: f64 = 0.25;

/// Drafts the shorts in every size.
pub fn draft_shorts(gender: Gender) -> GradedPattern {
    let block = match gender {
        Gender::Female => WOMEN,
        Gender::Male => MEN,
    };
    let count = ((block.last_hip - block.first_hip) / STEP).round() as usize + 1;
    let hips: Vec<f64> = (0..count).map(|i| block.first_hip + STEP * i as f64).collect();
    let sizes = hips
        .iter()
        .map(|&hip| Size {
            name: format!("{:.0}", hip * 100.0),
            chest_girth: block.chest.at(hip - block.centre),
            waist_girth: block.waist.at(hip - block.centre),
            hip_girth: hip,
        })
        .collect();
    let drafts: Vec<[(Outline, Vec<String>); 2]> = hips.iter().map(|&hip| draft_size(&block, hip)).collect();
    let panel = |name: &str, piece: usize, right: bool, wrap: Wrap, thigh: Part| {
        let labels = &drafts[0][piece].1;
        Panel {
            name: name.to_owned(),
            edge_labels: if right { mirrored_labels(labels) } else { labels.clone() },
            outlines: drafts.iter().map(|d| if right { mirrored(&d[piece].0) } else { d[piece].0.clone() }).collect(),
            wrap,
            part: Part::Pelvis,
            lower_part: Some(LowerPart { part: thigh, below: vec![0.0; hips.len()] }),
        }
    };
    let mut pattern = GradedPattern {
        garment: "shorts".to_owned(),
        gender: gender.name().to_owned(),
        material: "denim".to_owned(),
        template_size: hips.iter().position(|&h| h > block.centre - 0.5 * STEP).unwrap_or(0),
        sizes,
        fit: FitRule::Lower,
        panels: vec![
            panel("left_front", 0, false, Wrap::LeftLegFront, Part::LeftThigh),
            panel("left_back", 1, false, Wrap::LeftLegBack, Part::LeftThigh),
            panel("right_front", 0, true, Wrap::RightLegFront, Part::RightThigh),
            panel("right_back", 1, true, Wrap::RightLegBack, Part::RightThigh),
        ],
        stitches: Vec::new(),
        waist_band: Vec::new(),
        ribs: Vec::new(),
        anchors: Vec::new(),
    };
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
    for panel in 0..pattern.panels.len() {
        if let Some(edge) = pattern.panels[panel].edge_labelled("waist") {
            let edge = EdgeId { panel, edge };
            pattern.waist_band.push(edge);
            pattern.anchors.push(Anchors { edge, count: 5 });
        }
    }
    pattern
}

/// Left front and left back of one size; y = 0 is the crotch line, x = 0 the centre line.
fn draft_size(block: &Block, hip: f64) -> [(Outline, Vec<String>); 2] {
    let offset = hip - block.centre;
    let waist = block.waist.at(offset);
    let band = waist + BAND_BELOW_WAIST * (hip - waist) + 0.015;
    let quarter = 0.25 * (hip + block.hip_ease);
    let (front, back) = (quarter - 0.005, quarter + 0.005);
    let rise = block.rise.at(offset);
    let inseam = block.inseam.at(offset);
    let (front_fork, back_fork) = (block.front_fork * hip, block.back_fork * hip);
    // Of what the waist is narrower than the hip, the centre front and back take a little and the side seams the rest.
    let (centre_front, centre_back) = (0.012, 0.034);
    let side = 0.5 * (front + back - centre_front - centre_back - 0.5 * band);
    let back_raise = 0.040;
    let hip_line = 0.30 * rise;
    let (front_taper, back_taper, side_taper) = (0.012, 0.030, -0.050);

    let seat = 0.42 * rise;
    // The front's outseam mirrors into the back's: same heights, same insets, so both sides are equally long.
    let hip_controls =
        |x: f64| [(x, hip_line + 0.4 * (rise - hip_line)), (x - 0.8 * side, rise - 0.3 * (rise - hip_line))];
    let [low, high] = hip_controls(front);
    let front_piece = Pen::start((-front_fork, 0.0))
        .line("inseam", (-front_fork + front_taper, -inseam))
        .line("hem", (front - side_taper, -inseam))
        .line("outseam", (front, hip_line))
        .cubic("hip", low, high, (front - side, rise))
        .line("waist", (centre_front, rise))
        .line("centre", (0.0, seat))
        .cubic("crotch", (-0.002, 0.15 * rise), (-0.4 * front_fork, 0.003), (-front_fork, 0.0))
        .close();

    // The back inseam leans more, so the back crotch point drops until both inseams are equally long.
    let front_inseam = inseam.hypot(front_taper);
    let drop = inseam - (front_inseam * front_inseam - back_taper * back_taper).sqrt();
    let [low, high] = hip_controls(back);
    let lean = (centre_back) / (rise + back_raise - seat);
    let back_piece = Pen::start((-back_fork, -drop))
        .cubic("crotch", (-0.45 * back_fork, -drop - 0.004), (-0.28 * rise * lean, seat - 0.28 * rise), (0.0, seat))
        .line("centre", (centre_back, rise + back_raise))
        .line("waist", (back - side, rise))
        .cubic("hip", high, low, (back, hip_line))
        .line("outseam", (back - side_taper, -inseam))
        .line("hem", (-back_fork + back_taper, -inseam))
        .line("inseam", (-back_fork, -drop))
        .close();
    [front_piece, back_piece]
}
