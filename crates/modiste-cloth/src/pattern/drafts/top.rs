//! The top block: front, back and two set-in sleeves, short (T-shirt) or long.

use modiste_body::{Gender, Part};
use modiste_core::Vec2;

use super::super::{Anchors, Curve, FitRule, GradedPattern, LowerPart, Outline, Panel, Rib, Wrap};
use super::{
    InCuts, Pen, Trend, edge_named, increasing_root, leading_girths, mirrored, mirrored_labels, stitch, without_panels,
};

/// What differs between the women's and the men's block. Lengths in metres; trends are on the chest girth.
#[derive(Debug, Clone, Copy)]
struct Block {
    first_chest: f64,
    last_chest: f64,
    /// Mean chest girth, the centre of every trend.
    centre: f64,
    /// ANSUR II: waist, buttock, neck base and flexed biceps girth, biacromial breadth.
    waist: Trend,
    hip: Trend,
    neck: Trend,
    biceps: Trend,
    biacromial: Trend,
    /// High shoulder point to hem, and to the underarm.
    length: Trend,
    underarm: Trend,
    /// Cap top to the hem of a short sleeve.
    sleeve: Trend,
    /// ANSUR II: acromion to elbow, elbow to wrist, wrist girth.
    upper_arm: Trend,
    lower_arm: Trend,
    wrist: Trend,
    chest_ease: f64,
    hem_ease: f64,
    biceps_ease: f64,
    /// Beyond the acromion, half.
    shoulder_extra: f64,
    /// Beyond a sixth of the neck base girth.
    neck_extra: f64,
    /// Fall of the shoulder seam per metre of run.
    shoulder_slope: f64,
    /// How far the side seam comes in at the waist.
    waist_shaping: f64,
}

const WOMEN: Block = Block {
    first_chest: 0.70,
    last_chest: 1.34,
    centre: 0.947,
    waist: Trend { mean: 0.861, slope: 1.020 },
    hip: Trend { mean: 1.021, slope: 0.682 },
    neck: Trend { mean: 0.371, slope: 0.156 },
    biceps: Trend { mean: 0.306, slope: 0.278 },
    biacromial: Trend { mean: 0.365, slope: 0.064 },
    length: Trend { mean: 0.610, slope: 0.125 },
    underarm: Trend { mean: 0.212, slope: 0.110 },
    sleeve: Trend { mean: 0.185, slope: 0.050 },
    upper_arm: Trend { mean: 0.311, slope: 0.030 },
    lower_arm: Trend { mean: 0.241, slope: 0.020 },
    wrist: Trend { mean: 0.155, slope: 0.060 },
    chest_ease: 0.100,
    hem_ease: 0.130,
    biceps_ease: 0.075,
    shoulder_extra: 0.012,
    neck_extra: 0.022,
    shoulder_slope: 0.36,
    waist_shaping: 0.012,
};

const MEN: Block = Block {
    first_chest: 0.82,
    last_chest: 1.46,
    centre: 1.059,
    waist: Trend { mean: 0.941, slope: 1.132 },
    hip: Trend { mean: 1.020, slope: 0.733 },
    neck: Trend { mean: 0.435, slope: 0.220 },
    biceps: Trend { mean: 0.358, slope: 0.311 },
    biacromial: Trend { mean: 0.416, slope: 0.114 },
    length: Trend { mean: 0.700, slope: 0.125 },
    underarm: Trend { mean: 0.240, slope: 0.120 },
    sleeve: Trend { mean: 0.225, slope: 0.050 },
    upper_arm: Trend { mean: 0.335, slope: 0.035 },
    lower_arm: Trend { mean: 0.268, slope: 0.025 },
    wrist: Trend { mean: 0.176, slope: 0.065 },
    chest_ease: 0.110,
    hem_ease: 0.100,
    biceps_ease: 0.075,
    shoulder_extra: 0.018,
    neck_extra: 0.018,
    shoulder_slope: 0.36,
    waist_shaping: 0.0,
};

impl Block {
    /// The block of an ease: looser tops are wider and longer, their shoulders fall and their sleeves are set lower.
    fn in_cut(&self, ease: f64) -> Self {
        let and = |trend: Trend, more: f64| Trend { mean: trend.mean + more * ease, ..trend };
        Self {
            length: and(self.length, 0.020),
            underarm: and(self.underarm, 0.012),
            sleeve: and(self.sleeve, 0.010),
            wrist: and(self.wrist, 0.020),
            chest_ease: self.chest_ease + 0.065 * ease,
            hem_ease: self.hem_ease + 0.065 * ease,
            biceps_ease: self.biceps_ease + 0.030 * ease,
            shoulder_extra: self.shoulder_extra + 0.010 * ease,
            ..*self
        }
    }
}

/// Measures of one size (m), all read off the block.
#[derive(Debug, Clone, Copy)]
struct Measures {
    chest_half: f64,
    hem_half: f64,
    waist_shaping: f64,
    length: f64,
    underarm: f64,
    neck_half: f64,
    neck_front: f64,
    neck_back: f64,
    shoulder_half: f64,
    shoulder_drop: f64,
    biceps: f64,
    /// Cap top to hem.
    sleeve: f64,
    forearm: Option<Forearm>,
}

/// What a long sleeve covers beyond the elbow.
#[derive(Debug, Clone, Copy)]
struct Forearm {
    /// Height (y) of the elbow.
    elbow: f64,
    /// Width of the hem.
    hem: f64,
}

/// How far the sleeves reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sleeve {
    Short,
    Long,
}

/// Drafts the T-shirt in every size and cut.
pub fn draft_tshirt(gender: Gender) -> GradedPattern {
    draft("tshirt", gender, Sleeve::Short)
}

/// Drafts the shirt with long sleeves in every size and cut.
pub fn draft_longsleeve(gender: Gender) -> GradedPattern {
    draft("longsleeve", gender, Sleeve::Long)
}

fn draft(garment: &str, gender: Gender, sleeve: Sleeve) -> GradedPattern {
    let block = match gender {
        Gender::Female => WOMEN,
        Gender::Male => MEN,
    };
    let chests = leading_girths(block.first_chest, block.last_chest);
    let drafts = InCuts::new(&chests, |chest, ease| draft_size(&measures(&block.in_cut(ease), chest, sleeve)));
    let column = |panel: usize| drafts.outlines(|draft| draft[panel].0.clone());
    let labels = |panel: usize| drafts.regular[0][panel].1.clone();
    let panel = |name: &str, labels: Vec<String>, [slim, outlines, loose]: [Vec<Outline>; 3], wrap, part| Panel {
        name: name.to_owned(),
        edge_labels: labels,
        outlines,
        slim,
        loose,
        wrap,
        part,
        lower_parts: Vec::new(),
        covers: Vec::new(),
    };
    let elbows: Option<Vec<f64>> =
        chests.iter().map(|&chest| Some(measures(&block, chest, sleeve).forearm?.elbow)).collect();
    let sleeve = |name: &str, labels, outlines: [Vec<Outline>; 3], wrap: Wrap, [upper, lower]: [Part; 2]| Panel {
        lower_parts: elbows.iter().map(|below| LowerPart { part: lower, below: below.clone() }).collect(),
        ..panel(name, labels, outlines, wrap, upper)
    };
    let right_sleeve = drafts.outlines(|draft| mirrored(&draft[2].0));
    let named = (garment, gender, "jersey");
    let mut pattern = without_panels(named, FitRule::Upper, (&chests, block.centre), |chest| {
        [chest, block.waist.at(chest - block.centre), block.hip.at(chest - block.centre)]
    });
    pattern.panels = vec![
        panel("front", labels(0), column(0), Wrap::TorsoFront, Part::Chest),
        panel("back", labels(1), column(1), Wrap::TorsoBack, Part::Chest),
        sleeve("left_sleeve", labels(2), column(2), Wrap::LeftArm, [Part::LeftUpperArm, Part::LeftForearm]),
        sleeve(
            "right_sleeve",
            mirrored_labels(&labels(2)),
            right_sleeve,
            Wrap::RightArm,
            [Part::RightUpperArm, Part::RightForearm],
        ),
    ];
    stitch(
        &mut pattern,
        &[
            ("front:side_left", "back:side_left"),
            ("front:side_right", "back:side_right"),
            ("front:shoulder_left", "back:shoulder_left"),
            ("front:shoulder_right", "back:shoulder_right"),
            ("left_sleeve:underarm_front", "left_sleeve:underarm_back"),
            ("right_sleeve:underarm_front", "right_sleeve:underarm_back"),
            ("front:armhole_left", "left_sleeve:cap_front"),
            ("back:armhole_left", "left_sleeve:cap_back"),
            ("front:armhole_right", "right_sleeve:cap_front"),
            ("back:armhole_right", "right_sleeve:cap_back"),
        ],
    );
    for edge in ["front:shoulder_left", "front:shoulder_right"] {
        let edge = edge_named(&pattern, edge);
        pattern.anchors.push(Anchors { edge, count: 10 });
    }
    for edge in ["front:neck_left", "front:neck_right", "back:neck_left", "back:neck_right"] {
        let edge = edge_named(&pattern, edge);
        pattern.ribs.push(Rib { edge, scale: 0.94, modulus: 40.0 });
    }
    pattern
}

/// A long sleeve ends this far beyond the wrist (m).
const BEYOND_WRIST: f64 = 0.012;

/// Room at the wrist (m).
const WRIST_EASE: f64 = 0.065;

fn measures(block: &Block, chest: f64, sleeve: Sleeve) -> Measures {
    let offset = chest - block.centre;
    let hip = block.hip.at(offset);
    let neck = block.neck.at(offset) / 6.0;
    let girth = chest + block.chest_ease;
    // The underarm stays outside the shoulder tip in the narrowest sizes.
    let shoulder_half = (0.5 * block.biacromial.at(offset) + block.shoulder_extra).min(0.25 * girth - 0.024);
    let neck_half = neck + block.neck_extra;
    let upper_arm = block.upper_arm.at(offset) - block.shoulder_extra;
    let (sleeve, forearm) = match sleeve {
        Sleeve::Short => (block.sleeve.at(offset), None),
        Sleeve::Long => {
            let forearm = Forearm { elbow: -upper_arm, hem: block.wrist.at(offset) + WRIST_EASE };
            (upper_arm + block.lower_arm.at(offset) + BEYOND_WRIST, Some(forearm))
        }
    };
    Measures {
        chest_half: 0.25 * girth,
        hem_half: 0.25 * girth.max(hip + block.hem_ease),
        waist_shaping: block.waist_shaping,
        length: block.length.at(offset),
        underarm: block.underarm.at(offset),
        neck_half,
        neck_front: neck + 0.028,
        neck_back: 0.022,
        shoulder_half,
        shoulder_drop: (shoulder_half - neck_half) * block.shoulder_slope,
        biceps: block.biceps.at(offset) + block.biceps_ease,
        sleeve,
        forearm,
    }
}

/// Front, back and left sleeve of one size.
fn draft_size(m: &Measures) -> [(Outline, Vec<String>); 3] {
    let front = draft_front(m);
    let back = draft_back(m);
    let armhole = |piece: &(Outline, Vec<String>)| {
        let edge = piece.1.iter().position(|l| l == "armhole_left").unwrap_or(0);
        piece.0.edge_length(edge)
    };
    let sleeve = draft_sleeve(m, armhole(&front), armhole(&back));
    [front, back, sleeve]
}

/// The front is cut 1 cm wider than the back over the bust.
const FRONT_EXTRA: f64 = 0.0025;

fn draft_front(m: &Measures) -> (Outline, Vec<String>) {
    let (chest, hem) = (m.chest_half + FRONT_EXTRA, m.hem_half + FRONT_EXTRA);
    let (side, tip) = side_and_armhole(m, chest, hem, 0.018);
    Pen::start((-hem, -m.length))
        .line("hem", (hem, -m.length))
        .cubic("side_left", side[0], side[1], (chest, -m.underarm))
        .cubic("armhole_left", tip[1], tip[0], (m.shoulder_half, -m.shoulder_drop))
        .line("shoulder_left", (m.neck_half, 0.0))
        .cubic(
            "neck_left",
            (m.neck_half, -0.55 * m.neck_front),
            (0.6 * m.neck_half, -m.neck_front),
            (0.0, -m.neck_front),
        )
        .cubic(
            "neck_right",
            (-0.6 * m.neck_half, -m.neck_front),
            (-m.neck_half, -0.55 * m.neck_front),
            (-m.neck_half, 0.0),
        )
        .line("shoulder_right", (-m.shoulder_half, -m.shoulder_drop))
        .cubic("armhole_right", left(tip[0]), left(tip[1]), (-chest, -m.underarm))
        .cubic("side_right", left(side[1]), left(side[0]), (-hem, -m.length))
        .close()
}

fn draft_back(m: &Measures) -> (Outline, Vec<String>) {
    let (chest, hem) = (m.chest_half - FRONT_EXTRA, m.hem_half - FRONT_EXTRA);
    let (side, tip) = side_and_armhole(m, chest, hem, 0.008);
    Pen::start((-hem, -m.length))
        .cubic("side_right", left(side[0]), left(side[1]), (-chest, -m.underarm))
        .cubic("armhole_right", left(tip[1]), left(tip[0]), (-m.shoulder_half, -m.shoulder_drop))
        .line("shoulder_right", (-m.neck_half, 0.0))
        .cubic(
            "neck_right",
            (-m.neck_half + 0.004, -0.8 * m.neck_back),
            (-0.5 * m.neck_half, -m.neck_back),
            (0.0, -m.neck_back),
        )
        .cubic(
            "neck_left",
            (0.5 * m.neck_half, -m.neck_back),
            (m.neck_half - 0.004, -0.8 * m.neck_back),
            (m.neck_half, 0.0),
        )
        .line("shoulder_left", (m.shoulder_half, -m.shoulder_drop))
        .cubic("armhole_left", tip[0], tip[1], (chest, -m.underarm))
        .cubic("side_left", side[1], side[0], (hem, -m.length))
        .line("hem", (-hem, -m.length))
        .close()
}

type Controls = [(f64, f64); 2];

/// Control points of the left side seam (hem end first) and armhole (shoulder end first); `hollow` (m) is how far the
/// armhole curves in below the shoulder tip.
fn side_and_armhole(m: &Measures, chest: f64, hem: f64, hollow: f64) -> (Controls, Controls) {
    let rise = m.length - m.underarm;
    let side = [
        (hem + (chest - hem) / 3.0 - m.waist_shaping, -m.length + rise / 3.0),
        (chest - (chest - hem) / 3.0 - m.waist_shaping, -m.underarm - rise / 3.0),
    ];
    let depth = m.underarm - m.shoulder_drop;
    let run = chest - m.shoulder_half;
    let armhole = [
        (m.shoulder_half - hollow, -m.shoulder_drop - 0.55 * depth),
        (chest - 0.75 * run - 0.015, -m.underarm + 0.002),
    ];
    (side, armhole)
}

/// The left sleeve seen from outside: its cap is as long as the armhole, half by half, and as wide as the arm with ease.
fn draft_sleeve(m: &Measures, front_armhole: f64, back_armhole: f64) -> (Outline, Vec<String>) {
    // A higher cap leaves less width for the same armhole; the height that gives the wanted width is the answer.
    let width = |height: f64| cap_width(height, front_armhole) + cap_width(height, back_armhole);
    let height = increasing_root(0.03, 0.9 * front_armhole.min(back_armhole), |h| m.biceps - width(h));
    let (front, back) = (cap_width(height, front_armhole), cap_width(height, back_armhole));
    let [front_low, front_high] = cap_controls(front, height);
    let [back_low, back_high] = cap_controls(back, height);
    let taper = m.forearm.map_or(0.014, |forearm| 0.5 * (front + back - forearm.hem));
    Pen::start((-front + taper, -m.sleeve))
        .line("hem", (back - taper, -m.sleeve))
        .line("underarm_back", (back, -height))
        .cubic("cap_back", back_low, back_high, (0.0, 0.0))
        .cubic("cap_front", left(front_high), left(front_low), (-front, -height))
        .line("underarm_front", (-front + taper, -m.sleeve))
        .close()
}

/// Control points of half a cap that falls from the origin to `(width, -height)`, lower one first.
fn cap_controls(width: f64, height: f64) -> Controls {
    [(0.62 * width, -0.95 * height), (0.48 * width, 0.0)]
}

/// Width of the half cap of this height whose curve is `length` long (m).
fn cap_width(height: f64, length: f64) -> f64 {
    increasing_root(1e-3, length, |width| {
        let [low, high] = cap_controls(width, height).map(|(x, y)| Vec2::new(x, y));
        let (start, end) = (Vec2::new(width, -height), Vec2::ZERO);
        Curve::cubic(start, low, high, end).length(start, end) - length
    })
}

fn left(point: (f64, f64)) -> (f64, f64) {
    (-point.0, point.1)
}
